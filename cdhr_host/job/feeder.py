"""What is played on a link: rows fed ahead, rows executed taken back, and what is to come changed.

A change (hold, resume, override) is a new pace from the first tick on that the link can still
replace. It reaches the machine at once, however much the far side has buffered.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cdhr_host.drives.link import LinkState, MachineLink
from cdhr_host.drives.rows import RowQueue, joined
from cdhr_host.errors import DriveError, JobError, MotionError, Problem
from cdhr_host.job.echo import check_echo
from cdhr_host.motion.playback import Pace, landing, ramp, steady
from cdhr_host.motion.ramps import HISTORY, SETTLING, WAITS, Ahead, Choice, choices, longest
from cdhr_host.pipeline.course import Course, Stop
from cdhr_host.pipeline.score import Gain, Part, Score
from cdhr_host.values import Array, Feedback, Setpoints

CHUNK: Final = 1024
"""rows worked out at a time"""
TRIES: Final = 8
"""how often a change is worked out anew when the link meanwhile has gone on"""
FLOW_TIME: Final = 0.1
"""s in which the flow goes to another share"""
KEPT: Final = 64
"""ticks of the plan kept behind what was executed"""


class Feeder:
    """One link, and what is played on it."""

    def __init__(self, link: MachineLink) -> None:
        self.link = link
        self.score: Score | None = None
        self.next_tick = 0
        self.standing = True
        """whether the last row fed is at rest"""
        self.stop: Stop | None = None
        """the stop of the plan that this rest is, if it is one"""
        self.last: Setpoints | None = None
        """the last row executed"""
        self.slider: Array = np.zeros(6)
        """(6,) m, where the sliders stand or were commanded last"""
        self._sent = RowQueue()
        self._done: Setpoints | None = None
        self._stop_known = False

    @property
    def buffered(self) -> int:
        """Ticks fed and not executed yet."""
        return len(self._sent)

    @property
    def at_rest(self) -> bool:
        """Whether all that was fed is executed and ends at rest."""
        return self.standing and not len(self._sent)

    @property
    def period(self) -> float:
        """s"""
        return self.link.profile.drives.period

    def begin(self, course: Course, rate: float, gain: Gain) -> None:
        """Play a course from the tick it begins at; the machine is at rest."""
        first = course.first
        if self.link.state in (LinkState.OPEN, LinkState.STOPPED):
            self.link.arm(self.slider)
            self._sent.clear()
            self._done, self._stop_known = None, False
            self.next_tick = first
        pace = Pace.of(tick=self.next_tick, u=first, rate=rate)
        self.score = Score(course.staircase, (Part(self.next_tick, course, pace),), gain)
        self.standing, self.stop = False, None

    def end(self) -> None:
        """The machine is at rest and stays so."""
        self.link.stop()
        self.score, self.standing, self.stop = None, True, None

    def drop(self) -> None:
        """Nothing more is fed; what the link still plays is expected."""
        self.score, self.standing, self.stop = None, True, None

    @property
    def settled(self) -> bool:
        """Whether what was executed last was at a constant pace, or at rest."""
        if self.score is None or self.last is None:
            return True
        return int(self.last.tick[0]) >= self.score.last.pace.settled

    def feed(self) -> None:
        """Feed what there is credit for."""
        while self.score is not None and not self.standing and (free := self.link.free) > 0:
            rows, self.stop, self.standing = self.score.rows(
                self.next_tick, self.next_tick + min(free, CHUNK)
            )
            if self.link.feed(rows) < len(rows):
                raise DriveError(Problem("credit", "the link took fewer rows than it had room for"))
            self._sent.append(rows)
            self.next_tick += len(rows)

    def collect(self) -> list[tuple[Setpoints, Feedback]]:
        """What was executed since the last call, compared with what was fed."""
        feedback = self.link.feedback()
        self._plan_stop()
        if not len(feedback):
            return []
        if len(feedback) > len(self._sent):
            raise DriveError(Problem("echo", "the drives executed more rows than were sent"))
        rows = self._sent.take(len(feedback))
        check_echo(rows, feedback, self.link.resolution)
        self.last, self.slider = rows[-1:], rows.slider[-1]
        self._done = rows[-HISTORY:] if self._done is None else joined([self._done, rows])[-HISTORY:]
        self._forget(int(rows.tick[-1]))
        return [(rows, feedback)]

    def hold(self) -> Choice | None:
        """Come to rest on the path; None when what was fed ends at rest anyway."""
        return self.pace(0.0)

    def pace(self, rate: float) -> Choice | None:
        """Go over to another rate from now on; None when the rest of what is fed stands."""
        if self.score is None:
            return None
        for _ in range(TRIES):
            first = self._changeable()
            if self.standing and first >= self.next_tick:
                return None
            try:
                return self._paced(first, rate)
            except DriveError as error:
                if error.problems[0].key != "late-revision":
                    raise
        raise JobError(Problem("late", "the link goes on faster than a change can be worked out"))

    def go_on(self, rate: float) -> Choice | None:
        """From rest on the path back to a rate."""
        score = self._playing()
        part = score.last
        begin = self.next_tick - 1
        if self.stop is not None:
            part.course.passed()
            pace = Pace((steady(begin, self.stop.tick - 1.0, rate),))
            self.score = score.with_part(Part(self.next_tick, part.course, pace))
            self.standing, self.stop = False, None
            return None
        chosen = next(self._choices(begin, rate, waits=(0.0,)))
        self.score = score.with_part(Part(part.tick, part.course, chosen.pace))
        self.standing = False
        return chosen

    def flow(self, share: float) -> None:
        """Another share of the flow from now on."""
        if self.score is None:
            return
        first = self._changeable()
        if self.standing and first >= self.next_tick:
            self.score = replace(self.score, gain=Gain(share, share))
            return
        now = float(self.score.gain.at(np.array([first]))[0])
        gain = Gain(now, share, first, max(1, round(FLOW_TIME / self.period)))
        self._replace(first, replace(self.score, gain=gain))

    def place(self) -> tuple[Course, float, float] | None:
        """Course, time of its plan in ticks and rate of what was executed last."""
        if self.score is None or self.last is None:
            return None
        return self.score.beat(int(self.last.tick[0]))

    def _playing(self) -> Score:
        if self.score is None:
            raise JobError(Problem("state", "nothing is being played"))
        return self.score

    def _changeable(self) -> int:
        """The first tick that may still be changed."""
        return min(self.link.revisable, self.next_tick) if len(self._sent) else self.next_tick

    def _paced(self, first: int, rate: float) -> Choice:
        score = self._playing()
        last: MotionError | None = None
        for chosen in self._choices(first, rate):
            part = score.part_at(first)
            try:
                self._replace(first, score.with_part(Part(part.tick, part.course, chosen.pace)))
            except MotionError as error:
                last = error
            else:
                return chosen
        assert last is not None
        raise last

    def _look_ahead(self, score: Score, at: int, *, stands: bool) -> None:
        """Raises MotionError for what the machine could not do between a tick and a constant pace."""
        until = math.ceil(score.last.pace.settled) + SETTLING
        while at < until and not stands:
            rows, _, stands = score.rows(at, min(at + CHUNK, until))
            at += len(rows)

    def _choices(self, first: int, rate: float, waits: Sequence[float] = WAITS) -> Iterator[Choice]:
        """Paces to a rate from a tick on, best first."""
        score = self._playing()
        part = score.part_at(first)
        now = part.pace.start(float(first))

        def make(wait: int, lasting: int) -> Pace:
            start = part.pace.start(float(first + wait))
            shaped = landing if rate == 1.0 else ramp
            return part.pace.then(shaped(start, lasting, rate))

        plan = self._plan_ahead(part.course, now.u)
        ahead = Ahead(plan, self._before(first), part.course.nozzle, self.link.profile)
        return choices(ahead, make, first, abs(rate - now.rate), waits=waits)

    def _plan_ahead(self, course: Course, u: float) -> Setpoints:
        """Rows of the plan for as long as a change may take, or up to where it stands."""
        first = math.floor(u)
        last = math.ceil(u + longest(self.link.profile) / self.period)
        course.plan(last)
        stop = course.stop()
        return course.rows(first, min(last, stop.tick) if stop else last)

    def _before(self, first: int) -> Setpoints:
        """The rows already fed before a tick, as many as a change's jerk sees."""
        parts = [] if self._done is None else [self._done]
        if len(self._sent):
            waiting = self._sent.take(len(self._sent))
            self._sent.put_back(waiting)
            parts.append(waiting[: max(first - int(waiting.tick[0]), 0)])
        return joined(parts)[-HISTORY:] if parts else self._plan_ahead(self._playing().last.course, 0.0)[:0]

    def _plan_stop(self) -> None:
        """Once the link stops by itself, expect the stop's rows instead of those fed for these ticks."""
        tick = self.link.stop_tick
        if tick is None or self._stop_known or not len(self._sent):
            return
        self._stop_known = True
        rows = self._sent.take(len(self._sent))
        as_sent = int(np.searchsorted(rows.tick, tick))
        self._sent.append(rows[:as_sent])
        self._sent.append(self.link.stop_rows(rows[as_sent:]))

    def _forget(self, tick: int) -> None:
        """Let go of what lies well before an executed tick."""
        if self.score is None:
            return
        self.score = self.score.since(tick - KEPT)
        first = self.score.parts[0]
        first.course.drop(math.floor(first.pace.start(float(tick - KEPT)).u) - KEPT)

    def _replace(self, first: int, score: Score) -> None:
        """Play another score from a tick on, at the link too."""
        count = min(max(self.next_tick - first, CHUNK), self.link.free + self.next_tick - first)
        parts: list[Setpoints] = []
        at, stop, stands = first, None, False
        while at < first + count and not stands:
            rows, stop, stands = score.rows(at, min(at + CHUNK, first + count))
            parts.append(rows)
            at += len(rows)
        self._look_ahead(score, at, stands=stands)
        rows = joined(parts)
        if len(self._sent):
            self.link.revise(rows)
            self._sent.cut(first - self._sent.first_tick())
            self._sent.append(rows)
            self.next_tick = at
            self.stop, self.standing = stop, stands
        self.score = score
