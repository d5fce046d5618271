"""Where an interrupted print goes on: from its journal, its program's plan and where the machine stands.

The plan of a file is the same each time it is made, so a tick of it is a place. The journal says
which tick was executed last (or later, at most as far as the drives had been fed). Between these
two the nozzle came to rest; the encoders say where. When a link comes to rest by itself, the air is
off from the first tick of its stop on, so the bead ended before the nozzle did: at the tick from
which such a stop ends where the nozzle stands.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.aside import Aside
from cdhr_host.job.journal import SYNC_EVERY, Executed, Journal, boot_name
from cdhr_host.job.making import Making
from cdhr_host.job.own_stop import Ahead, Stops, ahead, planned_to
from cdhr_host.job.program import Program
from cdhr_host.motion.hold import longest_wait, rows_needed
from cdhr_host.motion.leg import Leg
from cdhr_host.motion.playback import Pace
from cdhr_host.motion.sampling import Timed
from cdhr_host.pipeline import Staircase
from cdhr_host.pipeline.course import Course
from cdhr_host.pipeline.rig import Rig
from cdhr_host.pipeline.score import Gain, Part, Score
from cdhr_host.pipeline.tape import Tape
from cdhr_host.units import MM
from cdhr_host.values import Array

SAME: Final = 0.02 * MM
"""how far the journal's nozzle may be from the plan's"""
NEAR: Final = 0.3 * MM
"""how far the nozzle may stand from the path and still count as on it, where the axes stopped together"""
FINE: Final = 0.5
"""ticks between places at which the nozzle is looked for"""
BEGUN: Final = 2.0
"""ticks by which a link's own stop may have begun later than is found: both its ends are rounded to rows"""
BACK: Final = 60.0
"""s of plan looked back over for the overlap"""


@dataclass(frozen=True, slots=True)
class Recovery:
    """Where and how a print goes on."""

    tick: float
    """of the plan at 100 %, at which it goes on"""
    line: int
    nozzle_G: Array
    """(3,) m, there"""
    bead: float
    """tick at which the bead ended, at the earliest"""
    rested: float
    """tick of the plan at which the nozzle came to rest"""
    overlap: float
    """m of path laid once more, at most"""
    away: float
    """m from the path to where the nozzle stands"""
    sure: bool
    """whether the bead's end is known, and not only bounded"""


class Resuming:
    """A program, and the way to a place in it."""

    def __init__(self, program: Program, rig: Rig) -> None:
        self._program = program
        self._rig = rig

    def found(self, journal: Journal, measured_G: Array, stops: Stops, overlap: float) -> Recovery:
        """From a journal and (3,) m where the nozzle stands; ``overlap`` m is what the operator wants.

        Raises JobError where the journal is not of this plan, or the nozzle not near its path.
        """
        if journal.executed is None:
            return self._not_begun(journal)
        last, fed, course = self._known(journal)
        bead, rested, away, sure = self._rest(course, journal, (last, fed), measured_G, stops)
        return self._going_on(course, (bead, rested), overlap, away=away, sure=sure)

    def moved(self, journal: Journal, overlap: float) -> Recovery:
        """From a journal alone, where the machine was moved since: the bead ended there, or later."""
        if journal.executed is None:
            return self._not_begun(journal)
        last, fed, course = self._known(journal)
        rested = last.plan_tick if journal.state == "held" else fed
        return self._going_on(course, (last.plan_tick, rested), overlap, sure=rested == last.plan_tick)

    def at_line(self, line: int) -> Recovery:
        """From the first tick of a line on. Raises JobError for a line that moves nothing."""
        course = self._course(0.0)
        while (tick := _first_of(course, line)) is None:
            if course.over:
                raise _refusal(
                    f"no motion at line {line} or after it", f"{self._program.file.name} ends before"
                )
            course.skip(course.staircase.tick + 1)
        return self._at(course, tick)

    def length(self, first: float, last: float) -> float:
        """m of path between two ticks of the plan."""
        course = self._course(first)
        course.plan(math.ceil(last) + 1)
        return self._length(course, first, last)

    def aside(self, tick: float) -> Aside:
        """The program, standing at a tick of its plan, to be gone on with."""
        course = self._course(tick)
        pace = Pace.of(tick=0, u=tick, rate=0.0)
        making = Making(Score(course.staircase, (Part(0, course, pace),), Gain()), 1)
        making.ended = True
        return Aside(making, course, course, course.staircase, 0, self._place(course, tick))

    @property
    def _period(self) -> float:
        return self._rig.profile.drives.period

    def _course(self, tick: float) -> Course:
        """The program's plan, from a tick on."""
        staircase = Staircase(self._rig.profile, rig=self._rig)
        course = Course(staircase.fork(), Tape(staircase.commands(self._program.file.chunks())))
        course.skip(math.floor(tick))
        course.plan(math.ceil(tick) + 1)
        return course

    def _not_begun(self, journal: Journal) -> Recovery:
        """A print that was on its way to where it should have gone on; what it moved was no clay."""
        tick = journal.opened.first_tick
        if tick <= 0.0:
            raise _refusal("nothing of this print was executed", "cdhr stream FILE begins it anew")
        return self._at(self._course(tick), tick)

    def _at(self, course: Course, tick: float) -> Recovery:
        """Exactly there."""
        return Recovery(tick, self._line(course, tick), self._place(course, tick), tick, tick, 0.0, 0.0, True)

    def _known(self, journal: Journal) -> tuple[Executed, float, Course]:
        """What was executed last, the tick that the drives may have got to, and the plan around them."""
        last = journal.executed
        assert last is not None
        fed = max(journal.fed.plan_tick if journal.fed else last.plan_tick, last.plan_tick)
        if journal.state != "held" and (journal.damage is not None or _cut(journal)):
            fed += SYNC_EVERY / self._period * max(journal.pace, 1.0)  # records that the disk never had
        course = self._course(max(last.plan_tick - BACK / self._period, 0.0))
        course.plan(math.ceil(fed) + 1)
        while (stop := course.stop()) is not None and stop.tick <= last.plan_tick:
            course.passed()
        self._check_plan(course, last)
        return last, fed, course

    def _going_on(
        self, course: Course, ended: tuple[float, float], overlap: float, *, away: float = 0.0, sure: bool
    ) -> Recovery:
        """Before the bead's end, by the overlap; ``ended`` are the ticks of the bead's end and of rest."""
        bead, rested = ended
        stop = course.stop()
        rested = rested if stop is None else min(rested, stop.tick - 1.0)
        tick = self._before(course, bead, overlap)
        line, place = self._line(course, tick), self._place(course, tick)
        twice = self._length(course, tick, min(bead + BEGUN, rested) if sure else rested) + away
        return Recovery(tick, line, place, bead, rested, twice, away, sure)

    def _check_plan(self, course: Course, last: Executed) -> None:
        """Raises JobError where the plan is not the one the journal was written by."""
        away = float(np.linalg.norm(self._place(course, last.plan_tick) - np.array(last.nozzle_mm) * MM))
        if away > SAME:
            raise _refusal(
                f"the journal's nozzle is {away / MM:.3f} mm from the plan's (limit {SAME / MM:g} mm)",
                "file, profile and version of this program must be those of the interrupted print; "
                "--from-layer goes on without a journal's place",
            )

    def _rest(
        self, course: Course, journal: Journal, known: tuple[Executed, float], measured_G: Array, stops: Stops
    ) -> tuple[float, float, float, bool]:
        """Ticks at which the bead ended and the nozzle rests, m from the path, and whether that is sure."""
        last, fed = known
        reach = fed + rows_needed(self._rig.profile) * max(journal.pace_most, 1.0)
        end = max(float(planned_to(course, reach)), last.plan_tick)
        tick = np.append(np.arange(last.plan_tick, end, FINE), end)
        away = np.linalg.norm(course.nozzle(tick).position_G - measured_G, axis=1)
        limit = self._astray(course, journal, (last.plan_tick, reach), stops)
        if away.min() > limit:
            found = f"{away.min() / MM:.2f} mm from the path it was on (limit {limit / MM:.2g} mm)"
            raise _refusal(
                f"the nozzle stands {found}",
                "if it was moved since, say --moved; if not, reference the machine",
            )
        first, latest = _rested(away, max(NEAR, float(away.min())))
        if journal.state == "held" and tick[first] - last.plan_tick < 1.0:
            return last.plan_tick, last.plan_tick, float(away[first]), True
        played = self._played(course, journal, (last.plan_tick, reach))
        begins = [each.stop_begins(float(tick[first]), stops) for each in played]
        bead = min(each[0] if each else last.plan_tick for each in begins)
        if journal.changing:
            bead -= longest_wait(self._rig.profile) / self._period * journal.pace_most
        as_links_do = journal.state != "fault" and not _cut(journal)
        sure = len(begins[0]) == 1 and not journal.changing and first == latest and as_links_do
        return max(bead, last.plan_tick), float(tick[latest]), float(away[first]), sure

    def _astray(self, course: Course, journal: Journal, known: tuple[float, float], stops: Stops) -> float:
        """m from its path at which the nozzle may stand; ``known`` are the last tick and the latest.

        A drive that trips stops its own cable at once, and so does each brake by itself, while
        the others may still go the way of a whole stop.
        """
        if journal.state != "fault" and not _cut(journal):
            return NEAR
        return NEAR + ahead(course, known, max(journal.pace_most, 1.0)).stop_way(stops)

    def _played(self, course: Course, journal: Journal, reach: tuple[float, float]) -> list[Ahead]:
        """The rows between two ticks at the slowest and the fastest pace that a link may have had.

        A stop from between these two is the longer of both at most, and what is gone while it waits
        for a change of pace to be over.
        """
        slowest = min(journal.pace, 1.0) if journal.changing else journal.pace_most
        return [ahead(course, reach, pace) for pace in sorted({slowest, journal.pace_most})]

    def _before(self, course: Course, tick: float, way: float) -> float:
        """The tick this much path before another; that of the last rest at the most."""
        u = np.append(np.arange(max(tick - BACK / self._period, course.kept_from), tick), tick)
        gone = self._gone(course, u)
        return float(u[int(np.searchsorted(gone, gone[-1] - way, side="right")) - 1]) if len(u) > 1 else tick

    def _length(self, course: Course, first: float, last: float) -> float:
        """m of path between two ticks."""
        return float(self._gone(course, np.append(np.arange(first, last), last))[-1])

    def _gone(self, course: Course, u: Array) -> Array:
        """(N,) ticks -> (N,) m of path since the first."""
        steps = np.diff(course.nozzle(u).position_G, axis=0)
        return np.concatenate(([0.0], np.cumsum(np.linalg.norm(steps, axis=1))))

    def _place(self, course: Course, tick: float) -> Array:
        place: Array = course.nozzle(np.array([tick])).position_G[0]
        return place

    def _line(self, course: Course, tick: float) -> int:
        return int(course.nozzle(np.array([tick])).line[0])


def _cut(journal: Journal) -> bool:
    """Whether the power was cut: the disk may lack records, and the drives stopped as their brakes do."""
    return journal.power_was_cut(boot_name())


def _rested(away: Array, enough: float) -> tuple[int, int]:
    """(N,) m from a path's rows -> the rows nearest the first and the last time that it comes near enough."""
    near = np.flatnonzero(away <= enough)
    visits = np.split(near, np.flatnonzero(np.diff(near) > 1) + 1)
    first, latest = (visit[away[visit].argmin()] for visit in (visits[0], visits[-1]))
    return int(first), int(latest)


def _first_of(course: Course, line: int) -> float | None:
    """The first tick of a line or one after it, where it is planned."""
    for placed in course.placed():
        step = placed.step
        if (
            isinstance(step, Timed)
            and isinstance(step.stretch, Leg)
            and step.stretch.segments.line[-1] >= line
        ):
            tick = np.arange(step.ticks.start, step.ticks.stop)
            found = np.flatnonzero(step.track(tick).line >= line)
            if len(found):
                return float(tick[found[0]])
    return None


def _refusal(message: str, hint: str) -> JobError:
    return JobError(Problem("resume", message, hint=hint))
