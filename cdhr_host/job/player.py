"""One machine under a job: programs, typed G-code, jogs and lifts, played one after the other."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import numpy as np

from cdhr_host.drives.link import MachineLink, Told, untold
from cdhr_host.drives.reference import NEXT_STEP
from cdhr_host.errors import JobError, MotionError, Problem
from cdhr_host.job.aside import Aside
from cdhr_host.job.changes import Changes
from cdhr_host.job.feeder import Feeder
from cdhr_host.job.feeds import Feeds
from cdhr_host.job.program import Program
from cdhr_host.job.short import furthest, proven, straight, through
from cdhr_host.pipeline import Staircase
from cdhr_host.pipeline.course import Course, Stop
from cdhr_host.pipeline.score import Gain
from cdhr_host.pipeline.tape import Tape
from cdhr_host.program.parse import parse_line
from cdhr_host.units import MM
from cdhr_host.values import Array, Feedback, Pause, Setpoints

STEP_SPEED: Final = 25 * MM
"""m/s of a single step"""
BACK_SPEED: Final = 25 * MM
"""m/s on the way back to a held program"""
REFERENCE: Final = 50e-6
"""m from the reference pose that count as standing there"""
Observer = Callable[[Setpoints, Feedback], None]


class Kind(Enum):
    """What is being played."""

    PROGRAM = "program"
    TYPED = "typed"
    JOG = "jog"
    LIFT = "lift"
    BACK = "back"
    """to the place where a program is held"""


@dataclass(frozen=True, slots=True)
class Rest:
    """Something played has come to rest, and all of it was executed."""

    kind: Kind
    stop: Stop | None
    """the stop of the plan this is; None where a hold brought it to rest"""


class Player:
    """What moves the machine. Not to be called from more than one thread."""

    def __init__(self, link: MachineLink) -> None:
        self.link = link
        self.profile = link.profile
        self.feeder = Feeder(link)
        self.changes = Changes(self.feeder)
        self.feeds = Feeds(self.feeder, self.changes)
        self.staircase = Staircase(link.profile)
        self.kind: Kind | None = None
        self.aside: Aside | None = None
        """a held program, while something else moves the machine"""
        self._course: Course | None = None
        self.feed = 1.0
        self.gain = 1.0
        self.executed: tuple[Setpoints, Feedback] | None = None
        """the last batch"""
        self.observers: list[Observer] = []
        self.referenced = False
        """whether the drives know where the machine stands"""
        self.homing: Told = untold
        self._adopt()

    @property
    def busy(self) -> bool:
        """Whether something is being played, at rest or not."""
        return self.kind is not None

    @property
    def homed(self) -> bool:
        """Whether it stands at the reference pose."""
        return bool(np.abs(self.feeder.slider).max() <= REFERENCE)

    @property
    def up_to_speed(self) -> bool:
        """Whether a program is played, and what was executed last was at a constant pace."""
        return self.kind is Kind.PROGRAM and self.feeder.settled

    @property
    def standing(self) -> tuple[Array, Array, Array]:
        """(3,) nozzle in G, (3,) the upper platform's displacement, (6,) sliders, m, when nothing moves."""
        return self.staircase.standing_G, self.staircase.upper, self.feeder.slider

    def _adopt(self) -> None:
        """Take the machine to stand where its drives say; raises MotionError where no pose fits."""
        self.refer()
        if not self.referenced:
            return
        slider = self.link.slider
        if np.abs(slider).max() > REFERENCE:
            self.feeder.slider = slider
            self.staircase.stand_at(*self.staircase.rig.standing(slider))

    def refer(self) -> None:
        """Ask the drives, once more, whether they know the reference pose."""
        self.referenced = self.link.referenced

    def home(self) -> None:
        """Have drives find a reference pose that they do not know, one slider after the other.

        ``homing`` hears each one's number as its turn comes. Where the profile's drives are not
        homed, nothing happens. Raises DriveError.
        """
        if self.referenced or self.profile.canopen.reference != "homing":
            return
        self.link.home(self.homing)
        self.feeder.slider = np.zeros(6)
        self.staircase.stand_at(np.zeros(3), np.zeros(3))
        self._adopt()

    def check_referenced(self) -> None:
        """Raises JobError with the next step where nobody knows where the machine stands."""
        if not self.referenced:
            raise JobError(
                Problem(
                    "unreferenced",
                    "the machine is not referenced: nothing may move",
                    hint=NEXT_STEP[self.profile.canopen.reference],
                )
            )

    @property
    def pause(self) -> Pause | None:
        """The program's pause at which it stands, if it does."""
        stop = self.feeder.stop if self.kind is Kind.PROGRAM and self.feeder.at_rest else None
        return stop.pause if stop is not None else None

    def refuse_start(self) -> None:
        """Raises JobError: a program begins at the reference pose only."""
        raise JobError(_not_homed())

    def plan_time(self, before: float) -> float:
        """s of the program as written that are done; ``before`` if that is not known."""
        u = self.feeds.plan_time() if self.kind is Kind.PROGRAM else None
        return before if u is None else u * self.profile.drives.period

    def cleared(self) -> None:
        """The part was taken off: nothing stands in the way of G28."""
        self.staircase.restore(replace(self.staircase.modal, top=-math.inf, near=math.inf))

    def give_up(self) -> None:
        """A fault: what is played is not gone on with."""
        self.feeder.drop()
        self.feeds.end()
        self._close()
        self.leave()
        self.kind = self._course = None

    def _close(self) -> None:
        if self._course is not None:
            self._course.close()

    def turn(self) -> Rest | None:
        """Feed and collect once; what has come to rest. Raises DriveError, MotionError, ProgramError."""
        self.feeds.turn(moving=self.kind is Kind.PROGRAM and self.changes.wanted > 0.0)
        self.changes.settle()
        self.feeder.feed()
        self.collect()
        if self.kind is not None and self.feeder.at_rest:
            return Rest(self.kind, self.feeder.stop)
        return None

    def collect(self) -> None:
        """Take what was executed and hand it on."""
        for rows, feedback in self.feeder.collect():
            self.executed = rows, feedback
            for observer in self.observers:
                observer(rows, feedback)

    def print(self, program: Program) -> None:
        """Begin a program; the machine stands at the reference pose. Raises JobError if it does not."""
        if not self.homed:
            raise JobError(_not_homed())
        self.staircase = Staircase(self.profile, rig=self.staircase.rig)
        commands = self.staircase.commands(program.file.chunks())
        course = Course(self.staircase.fork(), Tape(commands))
        self._play(Kind.PROGRAM, course, min(self.feed, 1.0))

    def lines(self, course: Course) -> None:
        """Begin what a client's lines have planned so far."""
        self._play(Kind.PROGRAM, course, min(self.feed, 1.0))
        self.feeds.end()  # what is to come is not known: nothing can be planned anew with another feed

    @property
    def free(self) -> bool:
        """Whether the machine stands and may be moved: what is held can be set aside."""
        return self.kind is None or (self.kind is Kind.PROGRAM and self.feeder.at_rest)

    def set_aside(self) -> None:
        """Leave a held program where it is, to move the machine otherwise."""
        if self.kind is not Kind.PROGRAM or self._course is None:
            return
        self.aside = Aside.of(self.feeder, self._course, self.feeds.base, self.staircase)
        self.staircase = Staircase(self.profile, rig=self.staircase.rig)
        assert self.feeder.last is not None
        self.staircase.stand_at(self.feeder.last.nozzle_G[-1], self.feeder.last.upper[-1])
        self.feeder.end()
        self.kind = self._course = None

    def back(self) -> bool:
        """Begin the way back to the program set aside; whether there is any. Raises MotionError."""
        assert self.aside is not None
        places = self.aside.way_back(self.staircase.standing_G, self.profile.bed.clear_height)
        if len(places):
            self._play(Kind.BACK, through(self.staircase, places, BACK_SPEED), 1.0)
        return bool(len(places))

    def take_up(self) -> None:
        """The machine is back where the program was set aside: it is what is played again, at rest."""
        aside = self.aside
        assert aside is not None
        self.feeder.arm()
        self.feeder.making = aside.going_on(self.feeder.next_tick)
        self.feeds.base = aside.base
        self.staircase, self._course, self.aside = aside.staircase, aside.course, None
        self.kind = Kind.PROGRAM

    def recover(self, aside: Aside) -> None:
        """Stand where the machine stands, with a program to be gone on with from elsewhere."""
        self.aside = aside
        self.feeder.next_tick = max(self.feeder.next_tick, 1)

    def leave(self) -> None:
        """What was set aside is not gone on with."""
        if self.aside is not None:
            self.aside.course.close()
            self.aside = None

    def typed(self, text: str) -> bool:
        """Prove a short text, then begin it; whether anything is to move.

        G28 homes drives that know no reference pose. Refused text leaves the machine as it was.
        Raises ProgramError, MotionError, JobError, DriveError.
        """
        self.set_aside()
        if _begins_with_home(text):
            self.home()
        before = self.staircase.modal
        course = proven(self.staircase, text)
        if not course.moves():
            return False
        if not self.referenced:
            self.staircase.restore(before)
            self.check_referenced()
        self._play(Kind.TYPED, course, 1.0)
        return True

    def step(self, distance: Array) -> bool:
        """Begin one straight move by (3,) m, modes staying as they are. Raises MotionError."""
        self.set_aside()
        self._play(Kind.TYPED, straight(self.staircase, distance, STEP_SPEED), 1.0)
        return True

    def play(self, course: Course) -> None:
        """Begin a short course that is proven."""
        self.set_aside()
        self._play(Kind.TYPED, course, 1.0)

    def jog(self, direction: Array, speed: float) -> Problem:
        """Begin to go straight along (3,) to the nearest limit; which one that is."""
        self.set_aside()
        course, limit = furthest(self.staircase, direction, speed)
        if course is not None:
            self._play(Kind.JOG, course, 1.0)
        return limit

    def lift(self, heights: Iterable[float]) -> float:
        """Begin to go straight up by the first of these heights, m, that can be done; 0 if none can."""
        speed = self.profile.limits.speed_max / 2
        for height in heights:
            try:
                course = straight(self.staircase, np.array([0.0, 0.0, height]), speed)
            except MotionError:
                continue
            self._play(Kind.LIFT, course, 1.0)
            return height
        return 0.0

    def over(self) -> None:
        """What is played has come to rest, and is given up or done; stand there."""
        self._close()
        ended = self.feeder.stop is not None and self.feeder.stop.pause is None
        self.feeder.end()
        self.feeds.end()
        if ended and self._course is not None:
            self._stand_after(self._course.staircase)
        elif self.feeder.last is not None:
            self.staircase.stand_at(self.feeder.last.nozzle_G[-1], self.feeder.last.upper[-1])
        self.kind = self._course = None

    def _stand_after(self, done: Staircase) -> None:
        """Stand where all of a course leads, exactly; what it read for itself alone is forgotten."""
        if done.reads_with(self.staircase):
            self.staircase = done
        else:
            self.staircase.stand_at(done.standing_G, done.upper)

    def hold(self) -> None:
        """Come to rest on the path; what is coming to rest already is left to it."""
        if self.changes.wanted == 0.0:
            return
        clean = self.profile.job.hold == "clean" and self.kind is Kind.PROGRAM
        self.changes.pace(0.0, late=self.staircase.rig.air.change_lead if clean else 0.0)

    def go_on(self) -> None:
        """From rest back to speed."""
        self.feeds.choose_at_rest()
        self.changes.go_on(self.feeds.rate, prime=self.profile.job.resume_prime)

    def override(self, feed: float | None, flow: float | None, *, moving: bool) -> None:
        """Other shares of feed and flow, at once while a program moves. Raises MotionError."""
        if feed is not None or flow is not None:
            self.feed, self.gain = feed or self.feed, flow or self.gain
            self.feeds.want(self.feed, self.gain, moving=moving)

    def _play(self, kind: Kind, course: Course, rate: float) -> None:
        share = self.feeds.begin(course, self.feed, self.gain) if kind is Kind.PROGRAM else 1.0
        self.feeder.begin(course, rate, Gain(share, share))
        self.changes.begin(rate)
        self.kind, self._course = kind, course


def _begins_with_home(text: str) -> bool:
    """Whether the first line of a text is G28."""
    block, _ = parse_line(text.split("\n", 1)[0], 1)
    return block is not None and block.code == "G28"


def _not_homed() -> Problem:
    return Problem(
        "reference",
        "the machine does not stand at its reference pose, where every program begins",
        hint="send G28 first",
    )
