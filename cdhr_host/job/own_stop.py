"""The stop that a link makes by itself, found back: from which tick on it ends where the nozzle stands.

A stop's way depends on what the drives were fed: on the plan at 100 % played slower, or on a plan
made anew for an override above it. So the rows are made again as the drives had them.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from cdhr_host.errors import MotionError
from cdhr_host.motion.hold import rows_needed
from cdhr_host.motion.leg import FeedOverride
from cdhr_host.pipeline.course import Course
from cdhr_host.pipeline.spots import same_place
from cdhr_host.values import Array, Setpoints

AS_WRITTEN: Final = 1.001
"""pace up to which the plan as written was played, perhaps slower; what it has above 1 is rounding"""
STRIDE: Final = 4
"""rows between looks at where a stop that begins there ends; in between it is looked at"""
DOUBTFUL: Final = 40
"""where one of them is nearer than this, in rows, or they are on both sides"""
Stops = Callable[[Setpoints], Setpoints]
"""rows ahead -> the rows a link plays instead when it comes to rest by itself"""


@dataclass(frozen=True, slots=True)
class Ahead:
    """Rows that a link may have had before it."""

    course: Course
    """the program's plan at 100 %, in whose ticks places are told"""
    played: Course
    """the plan that the rows are of"""
    tick: Array
    """(N,) of it"""
    rows: Setpoints

    def stop_begins(self, rested: float, stops: Stops) -> list[float]:
        """Ticks from which on a link's own stop ends at another, ascending; none where none does."""
        if (at := same_place(self.course, rested, self.played)) is None:
            return []
        longest = rows_needed(self.course.staircase.profile)
        rows = _begins(self.rows, int(np.abs(self.tick - at).argmin()), longest, stops)
        found = (same_place(self.played, float(self.tick[row]), self.course) for row in rows)
        return [tick for tick in found if tick is not None]

    def stop_way(self, stops: Stops) -> float:
        """m of a link's own stop from the first row on."""
        steps = np.diff(stops(self.rows).nozzle_G, axis=0)
        return float(np.linalg.norm(steps, axis=1).sum())


def ahead(course: Course, reach: tuple[float, float], pace: float) -> Ahead:
    """The rows between two ticks of a plan, as drives have them at a pace."""
    if pace > AS_WRITTEN:
        with suppress(MotionError):  # what cannot be planned was not played either
            if (hastened := _hastened(course, reach, pace)) is not None:
                return hastened
    rows = course.rows(math.floor(reach[0]), planned_to(course, reach[1]))
    tick = np.arange(float(rows.tick[0]), float(rows.tick[-1]), min(pace, 1.0))
    return Ahead(course, course, tick, _between(rows, tick))


def planned_to(course: Course, tick: float) -> int:
    """A tick, or that of the plan's next stop where it is earlier; the plan is made up to there."""
    course.plan(math.ceil(tick) + 1)
    stop = course.stop()
    return math.ceil(tick) if stop is None else min(math.ceil(tick), stop.tick)


def _hastened(course: Course, reach: tuple[float, float], factor: float) -> Ahead | None:
    """The same with every feed multiplied; None where the upper platform shifts, at a feed of its own."""
    fast = course.hastened(reach[0], FeedOverride(factor))
    if (first := same_place(course, reach[0], fast)) is None:
        return None
    while (stop := fast.stop()) is not None and stop.tick <= first:
        fast.passed()
    more = rows_needed(course.staircase.profile)
    rows = fast.rows(math.floor(first), planned_to(fast, first + reach[1] - reach[0] + more))
    return Ahead(course, fast, rows.tick.astype(np.float64), rows)


def _between(rows: Setpoints, tick: Array) -> Setpoints:
    """Rows at (N,) ticks that need not be whole, on the straight between two."""
    below = np.floor(tick).astype(np.int64) - int(rows.tick[0])
    share = (tick - np.floor(tick))[:, None]
    low, high = rows[below], rows[np.minimum(below + 1, len(rows) - 1)]
    return replace(
        low,
        nozzle_G=low.nozzle_G + share * (high.nozzle_G - low.nozzle_G),
        slider=low.slider + share * (high.slider - low.slider),
    )


def _begins(rows: Setpoints, rested: int, longest: int, stops: Stops) -> list[int]:
    """Rows from which a link's own stop ends at a row, one of each row of neighbours that do.

    A stop is as long as what lies ahead is fast. So one that begins on a slow move before a fast one
    may end where another does that begins much later.
    """
    coarse = [*range(max(rested - longest, 0), rested, STRIDE), rested]
    off = {k: _ends_at(rows, k, stops) - rested for k in coarse}
    for one, other in pairwise(coarse):
        if off[one] * off[other] <= 0 or min(abs(off[one]), abs(off[other])) <= DOUBTFUL:
            off.update({k: _ends_at(rows, k, stops) - rested for k in range(one + 1, other)})
    near = np.array(sorted(k for k, away in off.items() if abs(away) <= 1), dtype=np.intp)
    groups = np.split(near, np.flatnonzero(np.diff(near) > 1) + 1) if len(near) else []
    return [min(group.tolist(), key=lambda k: abs(off[k])) for group in groups]


def _ends_at(rows: Setpoints, begin: int, stops: Stops) -> int:
    """Row of the plan nearest to where a stop from another row on ends."""
    end = stops(rows[begin:]).nozzle_G[-1]
    return begin + int(np.linalg.norm(rows.nozzle_G[begin:] - end, axis=1).argmin())
