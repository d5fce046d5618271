"""How a bend shares the limits on acceleration and jerk between turning and changing speed.

With the path q(s) and the time law s(t), the nozzle has

    velocity      q' s'
    acceleration  q'' s'² + q' s''
    jerk          q''' s'³ + 3 q'' s' s'' + q' s'''

and |q'| <= 1. The first terms are nearly at right angles to the last ones. So with |s''| <= x A
and |s'''| <= x J, and bounds on |q''|, |q'''|, |q' q''| and |q' q'''| over a stretch of path,

    (|q''| v²)² + 2 |q' q''| v² x A + (x A)² <= A²
    (|q'''| v³ + 3 |q''| v x A)² + 2 x J (|q' q'''| v³ + 3 |q' q''| v x A) + (x J)² <= J²

keep the limits at any s' <= v.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.smooth_path import SmoothPath
from cdhr_host.values import Array, Flags, Ints

SHARES = (0.95, 0.8, 0.6, 0.4, 0.25, 0.1, 0.03)
"""Shares x of the limits that a bend may spend on changing speed."""
NEARLY = 0.97
"""A share is the usual one when it is the first that keeps this part of the speed wanted,"""
TURNING = 0.88
"""or this part of the speed that a long bend allows, where that is less: there it will change."""
NEWTON_STEPS = 6
"""From above, towards the root of a rising convex function."""


@dataclass(frozen=True, slots=True)
class Bends:
    """Greatest values over each of K stretches of path."""

    second: Array
    """(K,) 1/m, |q''|"""
    third: Array
    """(K,) 1/m², |q'''|"""
    along_second: Array
    """(K,) 1/m, |q' q''|"""
    along_third: Array
    """(K,) 1/m², |q' q'''|"""

    @classmethod
    def of(cls, path: SmoothPath) -> "Bends":
        """Of each piece of a path."""
        return cls(*path.bounds(), *path.along())

    def only(self, which: Ints) -> "Bends":
        """Of some of the stretches."""
        return Bends(*(row[which] for row in self.rows))

    def largest(self, heads: Ints) -> "Bends":
        """Of rows of stretches, each from one of ``heads`` to before the next."""
        return Bends(*(np.maximum.reduceat(row, heads) for row in self.rows))

    @property
    def rows(self) -> tuple[Array, Array, Array, Array]:
        """All four."""
        return self.second, self.third, self.along_second, self.along_third

    def acceleration(self, v: Array, a: Array) -> Array:
        """(K,) m/s²: the most that s' <= v and |s''| <= a lead to."""
        across = self.second * v**2
        found: Array = np.sqrt(across**2 + 2 * self.along_second * v**2 * a + a**2)
        return found

    def jerk(self, v: Array, a: Array, j: Array) -> Array:
        """(K,) m/s³: the most that s' <= v, |s''| <= a and |s'''| <= j lead to."""
        across = self.third * v**3 + 3 * self.second * v * a
        along = self.along_third * v**3 + 3 * self.along_second * v * a
        found: Array = np.sqrt(across**2 + 2 * along * j + j**2)
        return found

    def speed(self, share: float, limits: MotionLimits, room: Array) -> Array:
        """(K,) m/s: greatest s' when this share of the limits goes to changing it; infinite if straight.

        ``room`` (K,) of the acceleration is what the cables leave of it.
        """
        most = room * limits.acceleration
        a, j = share * most, share * room * limits.jerk
        with np.errstate(divide="ignore", invalid="ignore"):
            slow = self.along_second * a
            left = most**2 - a**2
            by_acceleration = np.sqrt(left / (slow + np.sqrt(slow**2 + self.second**2 * left)))
            rest = np.sqrt(limits.jerk**2 - j**2)
            v = np.fmin(np.cbrt(rest / self.third), rest / (3 * self.second * a))
            for _ in range(NEWTON_STEPS if share else 0):
                v = v - self._excess(v, a, j, rest)
        return np.asarray(np.fmin(by_acceleration, v), dtype=np.float64)

    def _excess(self, v: Array, a: Array, j: Array, rest: Array) -> Array:
        """(K,) m/s: Newton's step down to where the jerk is at its limit."""
        across, turned = self.third * v**2, 3 * self.second * a
        along, drawn = self.along_third * v**2, 3 * self.along_second * a
        whole = (across + turned) * v
        value = whole**2 + 2 * j * (along + drawn) * v - rest**2
        slope = 2 * whole * (3 * across + turned) + 2 * j * (3 * along + drawn)
        return np.asarray(value / slope, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Menu:
    """M ways to run through each of K stretches: the faster, the less is left for changing speed."""

    speed: Array
    """(M, K) m/s, greatest s'"""
    share: Array
    """(M, K) of the limits that changing speed may take"""

    def least(self, heads: Ints) -> "Menu":
        """Of rows of stretches, each from one of ``heads`` to before the next."""
        return Menu(*(np.minimum.reduceat(each, heads, axis=1) for each in (self.speed, self.share)))

    def within(self, spend: Array) -> "Menu":
        """No more than (K,) of the limits for changing speed."""
        return Menu(self.speed, np.minimum(self.share, spend))

    def usual(self, long: Flags, cap: Array) -> tuple[Array, Array]:
        """(K,) m/s and (K,): the one of them by which stretches are compared; ``cap`` is the speed wanted."""
        steady = self.speed[-1]
        enough = np.where(long & (steady < cap), TURNING, NEARLY) * steady
        row, column = np.argmax(self.speed >= enough, axis=0), np.arange(len(cap))
        return self.speed[row, column], self.share[row, column]


def menu(  # noqa: PLR0917 -- a column each
    cap: Array, room: Array, bends: Bends, long: Flags, shaped: Flags, limits: MotionLimits
) -> Menu:
    """Speeds, and shares of the limits that may be spent on changing them, of each of K stretches.

    ``cap`` (K,) m/s is wanted; ``room`` (K,) of the acceleration is what the cables leave of it. ``long``
    stretches must let the speed change. Corners with a ``shape`` have their change of speed in their path.
    """
    straight = bends.second == 0
    steady = np.minimum(cap, bends.speed(0.0, limits, room))
    speed = np.tile(steady, (len(SHARES), 1))
    share = np.tile(np.where(straight, 1.0, 0.0), (len(SHARES), 1))
    slower = np.flatnonzero(~straight & ~shaped)
    for row, candidate in enumerate(SHARES):
        reached = np.minimum(cap[slower], bends.only(slower).speed(candidate, limits, room[slower]))
        speed[row:, slower], share[row:, slower] = reached, candidate
        slower = slower[reached < cap[slower]]
    short = slower[~long[slower]]
    speed[-1, short], share[-1, short] = steady[short], 0.0
    return Menu(speed, share * room)
