"""Overrides: a feed below 100 % plays the plan slower, above it is planned anew and joined.

The program as written is always at hand (``base``). Faster, another course is planned from
the last border behind the machine on, with every feed multiplied; it leaves that border at
the base's speed and is nowhere slower from there on. Where a played course at rate r has the
speed r v and the other one v' at the same place, the other goes on at the rate r v / v',
continuous in speed and acceleration, and is ramped to its own rate. Where v' is smaller the
join waits: first the played course is slowed down, then both meet. A flow above 100 % is
pushed once a course is played that is slow enough for the air.
"""

import math
from contextlib import suppress
from functools import partial
from typing import Final

from cdhr_host.errors import CdhrError, MotionError
from cdhr_host.job.changes import OVERTAKEN, Changes
from cdhr_host.job.feeder import KEPT, Feeder
from cdhr_host.motion.leg import AS_PROGRAMMED, FeedOverride
from cdhr_host.motion.playback import Pace, Start, landing, ramp
from cdhr_host.motion.ramps import choices
from cdhr_host.pipeline.course import Course
from cdhr_host.pipeline.score import Part
from cdhr_host.pipeline.spots import spot, when

LATER: Final = (0, 2, 5, 10, 18, 28, 40)
"""ticks after the first that may be changed at which a join is tried"""
EASY: Final = 1.0 + 1e-7
"""a rate at which a course is joined may be above 1 by rounding only"""
AGAIN: Final = 0.1
"""s until a join that was not possible is tried again"""


class Feeds:
    """Which course is played for the feed that is wanted."""

    def __init__(self, feeder: Feeder, changes: Changes) -> None:
        self._feeder = feeder
        self._changes = changes
        self.base: Course | None = None
        self._wanted = 1.0
        self._flow = 1.0
        self._gain = 1.0
        """of the flow, as it is played"""
        self._next_try = 0

    def begin(self, base: Course, feed: float, flow: float) -> float:
        """A program is begun as it is written; the share of the flow that it can begin with."""
        self.base, self._wanted, self._flow, self._next_try = base, feed, flow, 0
        self._gain = min(flow, 1.0)
        return self._gain

    def end(self) -> None:
        """Nothing is played any more."""
        self.base = None

    @property
    def rate(self) -> float:
        """Of the course that is played now, for the feed wanted; 1 at most."""
        score = self._feeder.score
        factor = score.last.course.staircase.feed_override.factor if score is not None else 1.0
        return min(self._wanted / factor, 1.0)

    def want(self, feed: float, flow: float, *, moving: bool) -> None:
        """Another feed from now on, at this share of the flow."""
        self._wanted, self._flow, self._next_try = feed, flow, 0
        if flow < self._gain:
            self._push(flow)
        if moving and not self._joined():
            self._changes.pace(self.rate, late=self._changes.lead)
        self._push_more()

    def turn(self, *, moving: bool) -> None:
        """Join the right course once that is possible, and keep the base at hand."""
        base, score = self.base, self._feeder.score
        if base is None or score is None:
            return
        ready = self._feeder.settled and self._feeder.next_tick >= self._next_try
        if moving and ready and not self.right and not self._joined():
            self._next_try = self._feeder.next_tick + round(AGAIN / self._feeder.period)
        self._push_more()
        self._follow(base)

    def _push_more(self) -> None:
        """The flow that is wanted, once the plan that is played leaves the air room for it."""
        score = self._feeder.score
        if score is None or self._flow <= self._gain:
            return
        if self._flow <= max(1.0, score.last.course.staircase.feed_override.flow):
            self._push(self._flow)

    def _push(self, flow: float) -> None:
        with suppress(MotionError):
            self._changes.flow(flow)
            self._gain = flow

    def plan_time(self) -> float | None:
        """Ticks of the program as written that are done; None where that is not known."""
        base, place = self.base, self._feeder.place()
        if base is None or place is None:
            return None
        course, u, _ = place
        return u if course is base else self._on_base(course, u)

    def choose_at_rest(self) -> None:
        """Before going on from rest: the right course at the same place."""
        feeder, score = self._feeder, self._feeder.score
        if score is None or feeder.making is None or self.right or feeder.stop is not None:
            return
        begin = feeder.next_tick - 1
        part = score.last
        now = part.pace.start(float(begin))
        other = self._other(part.course, now.u)
        here = spot(part.course, now.u)
        if other is None or here is None or (u := when(other, here)) is None:
            return
        other.drop(int(u) - KEPT)
        feeder.making.score = score.with_part(Part(begin, other, Pace.of(tick=begin, u=u, rate=0.0)))

    @property
    def right(self) -> bool:
        """Whether the course that is played is the one for the feed wanted."""
        score = self._feeder.score
        if score is None:
            return True
        return score.last.course.staircase.feed_override == self._override()

    def _override(self) -> FeedOverride:
        return FeedOverride(max(self._wanted, 1.0), max(self._flow, 1.0))

    def _joined(self) -> bool:
        """Join the right course soon; whether that was possible, or is the case already."""
        feeder, score = self._feeder, self._feeder.score
        if score is None or feeder.standing or self.right:
            return False
        first = feeder.changeable
        part, soonest = score.part_at(first), first + round(self._changes.lead / feeder.period)
        with suppress(MotionError):
            other = self._other(part.course, part.pace.start(float(first)).u)
            return other is not None and any(self._join(other, soonest + later, first) for later in LATER)
        return False

    def _other(self, course: Course, u: float) -> Course | None:
        """The right course, planned from before a time of the course that is played on."""
        base, override = self.base, self._override()
        if base is None:
            return None
        there = u if course is base else self._on_base(course, u)
        if override == AS_PROGRAMMED or there is None:
            return base if there is not None else None
        base.plan(math.ceil(there))
        return base.hastened(there, override) if spot(base, there) is not None else None

    def _join(self, other: Course, tick: int, first: int) -> bool:
        """Play the other course from a tick on, if limits allow it; the air knows of it from ``first`` on."""
        feeder, score = self._feeder, self._feeder.score
        assert score is not None
        part = score.part_at(tick)
        start = self._start(part, other, tick)
        if start is None:
            return False
        other.drop(int(start.u) - KEPT)
        target = min(self._wanted / self._override().factor, 1.0)
        ahead = self._changes.ahead(other, start.u, tick, before=score.before(tick))
        shaped = partial(_shaped, start, target)
        for pace in choices(ahead, shaped, tick, abs(target - start.rate), waits=(0.0,)):
            try:
                feeder.revise(score.with_part(Part(tick, other, pace)), first)
            except CdhrError as error:
                if not feeder.plays and error.problems[0].kind not in OVERTAKEN:
                    raise  # a fault of the far side is told once
                continue
            self._changes.wanted = target
            return True
        return False

    def _start(self, part: Part, other: Course, tick: int) -> Start | None:
        """Where the other course is joined, and at which rate; None where it is slower or not known."""
        now = part.pace.start(float(tick))
        here = spot(part.course, now.u)
        if here is None or (u := when(other, here)) is None:
            return None
        there = spot(other, u)
        if there is None or there.moves != here.moves or there.number != here.number:
            return None
        if there.speed <= 0.0:
            return Start(tick, u, now.rate) if here.speed <= 0.0 else None
        rate = now.rate * here.speed / there.speed
        if rate > EASY:
            return None
        period = self._feeder.period
        acceleration = now.rate**2 * here.acceleration + now.slope / period * here.speed
        slope = (acceleration - rate**2 * there.acceleration) / there.speed * period
        return Start(tick, u, min(rate, 1.0), slope)

    def _on_base(self, course: Course, u: float) -> float | None:
        here = spot(course, u)
        return None if here is None or self.base is None else when(self.base, here)

    def _follow(self, base: Course) -> None:
        """Let go of what the base has behind the machine."""
        if (u := self.plan_time()) is not None:
            while (stop := base.stop()) is not None and stop.tick <= u:
                base.passed()
            base.drop(int(u) - KEPT)
            course = self._feeder.score.last.course if self._feeder.score else base
            base.forget(min(base.oldest, course.oldest))


def _shaped(start: Start, target: float, _: int, lasting: int) -> Pace:
    make = landing if target == 1.0 else ramp
    return Pace.of(tick=start.tick, u=start.u, rate=start.rate).then(make(start, lasting, target))
