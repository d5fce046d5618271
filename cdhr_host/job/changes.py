"""Changes of what is played: hold, resume, another feed or flow.

A change is a new pace from the first tick on that the link can still replace. It reaches the
machine at once, however much the far side has buffered.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from cdhr_host.errors import DriveError, JobError, MotionError, Problem
from cdhr_host.job.feeder import Feeder
from cdhr_host.motion.flow import UNBOUNDED
from cdhr_host.motion.playback import Pace, landing, ramp, steady
from cdhr_host.motion.ramps import WAITS, Ahead, choices, longest
from cdhr_host.pipeline.course import Course
from cdhr_host.pipeline.score import Gain, Part, Prime, Score
from cdhr_host.values import Setpoints

TRIES: Final = 8
"""how often a change is worked out anew when the link meanwhile has gone on"""
OVERTAKEN: Final = frozenset({"late-revision", "state"})
"""kinds of a change that the link refuses because it has gone on, or stops by itself, meanwhile"""
SHARES: Final = (1.0, 0.6, 0.3, 0.1)
"""of a change, tried in this order"""
SAME: Final = 1e-9
"""of rates that are one"""
BUG: Final = "please report this as a bug, with the program"
FLOW_TIME: Final = 0.1
"""s in which the flow goes to another share"""


class Changes:
    """What may be done to what a feeder plays.

    ``wanted`` is the rate to be reached: where the plan has room for only a part of a change,
    the rest follows from ``settle``.
    """

    def __init__(self, feeder: Feeder) -> None:
        self._feeder = feeder
        self.wanted = 1.0
        self._late = 0.0

    @property
    def lead(self) -> float:
        """s until the air can follow a change, where the profile waits for that."""
        score = self._feeder.score
        if score is None or self._feeder.link.profile.job.hold != "clean":
            return 0.0
        return score.staircase.rig.air.change_lead

    def begin(self, rate: float) -> None:
        """A course is begun at this rate."""
        self.wanted = rate

    def pace(self, rate: float, *, late: float = 0.0) -> None:
        """Go over to another rate, ``late`` s from now."""
        self.wanted, self._late = rate, late
        self._retried(self._paced)

    def settle(self) -> None:
        """Do what is left of a change once the pace is constant again."""
        score = self._feeder.score
        if score is None or self._feeder.standing or not self._feeder.settled:
            return
        if abs(score.last.pace.target - self.wanted) > SAME:
            self._late = self.lead
            self._retried(self._paced)

    def go_on(self, rate: float, *, prime: float = 0.0) -> None:
        """From rest on the path back to a rate, after ``prime`` s of pushing clay while standing."""
        feeder, score = self._feeder, self._playing()
        assert feeder.making is not None
        self.wanted, begin = rate, feeder.next_tick - 1
        part = score.last
        if feeder.stop is not None:
            pace = Pace((steady(begin, feeder.stop.tick - 1.0, rate),))
            part.course.leave()
            feeder.making.go_on(score.with_part(Part(feeder.next_tick, part.course, pace)))
            return
        score = replace(score, prime=self._prime(score, begin, prime))
        primed = (score.prime.end - begin) * feeder.period if prime else 0.0
        late = max(primed, score.staircase.rig.air.start_lead)
        for pace in self._paces(begin, rate, waits=(0.0,), late=late):
            feeder.making.go_on(score.with_part(Part(part.tick, part.course, pace)))
            return
        raise JobError(Problem("resume", "no way to go on from here keeps the machine's limits", hint=BUG))

    def flow(self, share: float) -> None:
        """Another share of the flow from now on."""
        self._retried(lambda first: self._flowing(first, share))

    def _retried(self, change: Callable[[int], None]) -> None:
        """A change from the first tick on that may still be changed once it is worked out."""
        ahead, feeder = 0, self._feeder
        for _ in range(TRIES if feeder.score is not None else 0):
            begun = feeder.changeable
            try:
                change(min(begun + ahead, feeder.next_tick))
            except DriveError as error:
                if error.problems[0].kind not in OVERTAKEN:
                    raise
                if not feeder.plays:  # why the far side stops is told with its answers
                    return
                ahead = 2 * (feeder.changeable - begun) + 1
            else:
                return
        if feeder.score is not None:
            raise JobError(Problem("late", "the link goes on faster than a change can be worked out"))

    def _over(self, first: int) -> bool:
        """Whether nothing follows from a tick on but standing."""
        if self._feeder.standing and first >= self._feeder.next_tick:
            return True
        course, u, _ = self._playing().beat(first)
        stop = course.stop()
        return stop is not None and math.floor(u) >= stop.tick

    def _flowing(self, first: int, share: float) -> None:
        score, feeder = self._playing(), self._feeder
        assert feeder.making is not None
        if self._over(first):
            feeder.making.score = replace(score, gain=Gain(share, share))
            return
        now = float(score.gain.at(np.array([first]))[0])
        begin = first + round(self.lead / feeder.period)
        gain = Gain(now, share, begin, max(1, round(FLOW_TIME / feeder.period)))
        feeder.revise(replace(score, gain=gain), first)

    def _paced(self, first: int) -> None:
        """The wanted rate, or a part of the way to it; nothing where there is no room for either."""
        if self._over(first):
            return
        score = self._playing()
        part = score.part_at(first)
        for pace in self._paces(first, self.wanted, late=self._late):
            with suppress(MotionError):
                self._feeder.revise(score.with_part(Part(part.tick, part.course, pace)), first)
                return

    def _paces(
        self, first: int, rate: float, *, waits: Sequence[float] = WAITS, late: float = 0.0
    ) -> Iterator[Pace]:
        """Paces from a tick on, best first: to a rate, then to rates on the way to it."""
        part = self._playing().part_at(first)
        now = part.pace.start(float(first))
        ahead = self.ahead(part.course, now.u, first)
        begin = first + round(late / self._feeder.period)
        for share in SHARES:
            target = rate if share == 1.0 else now.rate + share * (rate - now.rate)
            make = partial(_made, part.pace, begin, target)
            yield from choices(ahead, make, first, share * abs(rate - now.rate), waits=waits)

    def ahead(self, course: Course, u: float, first: int, *, before: Setpoints | None = None) -> Ahead:
        """The plan from a time on, for as long as a change may take or up to where it stands.

        ``before``: rows before tick ``first`` where they are not those that were fed.
        """
        profile = self._feeder.link.profile
        last = math.ceil(u + longest(profile) / self._feeder.period)
        course.plan(last)
        stop = course.stop()
        plan = course.rows(math.floor(u), min(last, stop.tick) if stop else last)
        air = course.staircase.limits.flow if profile.job.hold == "clean" else UNBOUNDED
        return Ahead(
            plan, self._before(first, plan) if before is None else before, course.nozzle, profile, air
        )

    def _before(self, first: int, plan: Setpoints) -> Setpoints:
        before = self._feeder.before(first)
        return plan[:0] if before is None else before

    def _prime(self, score: Score, begin: int, duration: float) -> Prime:
        """Clay while standing, as much a second as the plan lays where it goes on."""
        if not duration:
            return Prime()
        part = score.last
        u = np.array([part.pace.start(float(begin)).u])
        flow = float(part.course.nozzle(u).flow[0])
        first = begin + 1 + round(score.staircase.rig.air.start_lead / self._feeder.period)
        return Prime(first, first + round(duration / self._feeder.period), flow)

    def _playing(self) -> Score:
        if self._feeder.score is None:
            raise JobError(Problem("state", "nothing is being played"))
        return self._feeder.score


def _made(pace: Pace, begin: int, target: float, wait: int, lasting: int) -> Pace:
    """A pace that goes over to a target, ``wait`` ticks after ``begin``."""
    shaped = landing if target == 1.0 else ramp
    return pace.then(shaped(pace.start(float(begin + wait)), lasting, target))
