"""The same place on the way in two plans of one text that were made with different feeds."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.leg import Leg
from cdhr_host.motion.sampling import Timed
from cdhr_host.motion.time_law import TimeLaw
from cdhr_host.pipeline.course import Course, Placed
from cdhr_host.pipeline.shift import Shift

HALVINGS = 60
"""of a piece of a time law, down to rounding"""
NEAR = 1e-9
"""m or s beyond a stretch that are rounding"""


@dataclass(frozen=True, slots=True)
class Spot:
    """A place on a drawn leg, or a moment of a stand."""

    number: int
    """of the leg, or of the one that follows the stand"""
    moves: bool
    s: float
    """m of the drawn leg, or s since the stand began"""
    speed: float = 0.0
    """m/s, s' of the plan"""
    acceleration: float = 0.0
    """m/s², s'' of the plan"""


def spot(course: Course, u: float) -> Spot | None:
    """Where a time of a plan is, in ticks; None on a shift."""
    step = course.placed_at(u).step
    if not isinstance(step, Timed):
        return None
    t = min(max((u - step.begin) * step.period, 0.0), step.stretch.duration)
    if not isinstance(step.stretch, Leg):
        return Spot(step.stretch.number, False, t)
    s, speed, acceleration = (float(part[0]) for part in step.stretch.law.at(np.array([t])))
    return Spot(step.stretch.number, True, s + step.stretch.passed, speed, acceleration)


def when(course: Course, place: Spot) -> float | None:
    """Ticks of a plan at which it is at a place; it is planned on as far as needed.

    None where it never is, or was before what is kept of it.
    """
    while (found := _when(course, place)) is None and not course.over:
        if _beyond(course, place):
            return None
        course.plan(course.staircase.tick)
    return found


def same_place(course: Course, u: float, other: Course) -> float | None:
    """A time of a plan, in ticks -> the time at which another plan of the same text is there."""
    if other is course:
        return u
    if (here := spot(course, u)) is not None:
        return when(other, here)
    shift = course.placed_at(u)
    other.plan(other.staircase.tick)
    for placed in other.placed():
        if placed.cause == shift.cause and isinstance(placed.step, Shift):
            return placed.begin + u - shift.begin
    return None


def _when(course: Course, place: Spot) -> float | None:
    found = (_within(placed, place) for placed in course.placed())
    return next((tick for tick in found if tick is not None), None)


def _beyond(course: Course, place: Spot) -> bool:
    """Whether a course is planned further than a place already."""
    steps = [each.step for each in course.placed() if isinstance(each.step, Timed)]
    if not steps:
        return False
    last = steps[-1].stretch
    if last.number != place.number:
        return last.number > place.number
    return isinstance(last, Leg) and (not place.moves or last.law.end + last.passed > place.s)


def _within(placed: Placed, place: Spot) -> float | None:
    step = placed.step
    if not isinstance(step, Timed) or step.stretch.number != place.number:
        return None
    stretch = step.stretch
    if not isinstance(stretch, Leg):
        here = not place.moves and place.s <= stretch.duration + NEAR
        return step.begin + min(place.s, stretch.duration) / step.period if here else None
    s = place.s - stretch.passed
    first = float(stretch.law.state[0, 0])
    if not place.moves or not first - NEAR <= s <= stretch.law.end + NEAR:
        return None
    return step.begin + time_of(stretch.law, s) / step.period


def time_of(law: TimeLaw, s: float) -> float:
    """s at which a law reaches a place, by halving the piece it lies on."""
    piece = max(int(np.searchsorted(law.state[0], s, side="right")) - 1, 0)
    begin = float(law.t[piece])
    low, high = 0.0, (float(law.t[piece + 1]) if piece + 1 < len(law.t) else law.duration) - begin
    s0, v, a, j = law.state[:, piece].tolist()
    for _ in range(HALVINGS):
        x = (low + high) / 2
        low, high = (x, high) if s0 + x * (v + x * (a / 2 + x * (j / 6))) < s else (low, x)
    return begin + (low + high) / 2
