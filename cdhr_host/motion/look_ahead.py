"""Speeds at the borders of cells.

A speed change from v0 to v1 with s'' = 0 at both ends and |s''| <= a, |s'''| <= j takes
T = 2 sqrt(d/j) if d = |v1 - v0| <= a²/j, else d/a + a/j, over the distance (v0 + v1)/2 · T.

At all borders s'' = 0. Speeds at borders are the nozzle's. A corner with gears is passed at one s', which is
these over its gears.

A bend can be run through in several ways, the faster, the less the speed may change in it. From border to
border it must be one of them; which, is chosen when the speeds at all borders are known (``choice``).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.motion.cells import Cells
from cdhr_host.values import Array, Flags

FARTHER = 1.25
"""How much shorter cells are taken to be where what follows is not known. Slowing down to v/3 takes 9 % more
way than to rest, and no other speed more."""
HALVINGS = 48
"""Of an interval of speeds: to rounding."""
ROUNDING = 1e-13
"""m by which a change of speed may be longer than its cell."""
SAME = 1e-11
"""Parts by which s' at both ends of a corner with gears may differ: rounding."""


def change_time(d: Array, a: Array, j: Array) -> Array:
    """m/s -> s: duration of the fastest change by d; infinite where a is 0 and d is not."""
    with np.errstate(divide="ignore", invalid="ignore"):
        time = np.where(d * j <= a * a, 2 * np.sqrt(d / j), d / a + a / j)
    return np.where(d == 0, 0.0, np.where(a > 0, time, np.inf))


def change_distance(v0: Array, v1: Array, a: Array, j: Array) -> Array:
    """(K,) m: distance of the fastest speed change; infinite where a is 0 and the speeds differ."""
    return np.asarray((v0 + v1) / 2 * change_time(np.abs(v1 - v0), a, j), dtype=np.float64)


def reachable(v0: float, length: float, a: float, j: float) -> float:
    """m/s: greatest speed a change from v0 reaches within a length; v0 where a is 0.

    Beyond d = a²/j the distance is a quadratic in d, below it a cubic in sqrt(d/j) with one
    real root (y³ + p y = q, p >= 0), which the hyperbolic form gives without cancellation.
    """
    if a <= 0.0 or length <= 0.0:
        return v0
    knee = a * a / j
    if (2 * v0 + knee) * a / j >= length:
        p, q = 2 * v0 / j, length / j
        if p < 1e-12 * math.cbrt(q) ** 2:
            y = math.cbrt(q)
        else:
            root = math.sqrt(p / 3)
            y = 2 * root * math.sinh(math.asinh(1.5 * q / p / root) / 3)
        return v0 + j * y * y
    b, c = 2 * v0 + knee, length * a - v0 * knee
    return v0 + 4 * c / (b + math.sqrt(b * b + 8 * c))


def inside(cells: Cells, borders: Array) -> tuple[Array, Array]:
    """(K+1,) m/s of the nozzle at borders -> s' (K,) at both ends of each cell."""
    first, last = borders[:-1] / cells.gear[0], borders[1:] / cells.gear[1]
    geared = (cells.gear != 1.0).any(axis=0)
    return first, np.where(geared & (np.abs(last - first) <= SAME * first), first, last)


def needed(both: tuple[Array, Array], peak: Array, cells: Cells) -> Array:
    """(M, K) m: the distance from the first end up to a peak (K,) or (M, K) m/s and down to the other end."""
    a, j = cells.acceleration, cells.jerk
    return change_distance(both[0], peak, a, j) + change_distance(both[1], peak, a, j)


def feasible(both: tuple[Array, Array], cells: Cells) -> Flags:
    """(M, K) whether each cell can have these ends."""
    peak = np.maximum(*both)
    within = needed(both, peak, cells) <= cells.length + ROUNDING
    return np.asarray(within & (peak <= cells.speed * (1 + SAME)), dtype=np.bool_)


def border_speeds(cells: Cells, entry: float, exit_speed: float) -> tuple[Array, Array]:
    """(K+1,) speeds at the borders, and the ones a forward pass alone would allow.

    ``entry`` and ``exit_speed`` are given at the first border and the last. A border whose two speeds
    agree cannot become faster by knowing more of the path.
    """
    cap = _caps(cells)
    cap[0] = entry
    forward = _pass(cap, cells)
    cap = forward.copy()
    cap[-1] = min(exit_speed, cap[-1])
    backward = _pass(cap[::-1], _reversed(cells))[::-1]
    return backward, forward


def stoppable(cells: Cells, forward: Array) -> Flags:
    """(K+1,) borders from which the nozzle can slow down to whatever is wanted at the last.

    It passes them at ``forward`` (K+1,) m/s. If it could come to rest in cells that are shorter by
    FARTHER, it can slow down to any other speed in these, border by border.
    """
    cap = forward.copy()
    cap[-1] = 0.0
    shorter = replace(cells, length=cells.length / FARTHER)
    return np.asarray(_pass(cap[::-1], _reversed(shorter))[::-1] == forward, dtype=np.bool_)


def _reversed(cells: Cells) -> Cells:
    return replace(
        cells,
        length=cells.length[::-1],
        speed=cells.speed[:, ::-1],
        acceleration=cells.acceleration[:, ::-1],
        jerk=cells.jerk[:, ::-1],
        gear=cells.gear[::-1, ::-1],
    )


def _caps(cells: Cells) -> Array:
    """(K+1,) m/s: what the cells on both sides of a border allow, by themselves."""
    first, last = cells.speed[-1] * cells.gear
    cap: Array = np.minimum(np.append(first, np.inf), np.concatenate(([np.inf], last)))
    return cap


def _pass(cap: Array, cells: Cells) -> Array:
    """(K+1,) -> (K+1,): each speed lowered to what the one before it can reach."""
    first, last = inside(cells, cap)
    short = np.flatnonzero(last > first)
    short = short[~feasible((first[short], last[short]), cells.only(short)).any(axis=0)]
    if not len(short):
        return cap
    speeds, ways = cap.tolist(), _Ways.of(cells)
    for i in short.tolist():
        k = i
        while k < len(ways.length):
            reached = ways.reached(k, speeds[k], speeds[k + 1])
            if reached >= speeds[k + 1]:
                break
            speeds[k + 1] = reached
            k += 1
    return np.array(speeds)


@dataclass(frozen=True, slots=True)
class _Ways:
    """The ways to run through each of K cells, for one cell after the other."""

    length: list[float]
    """m"""
    gear: list[list[float]]
    """|q'| at both ends"""
    first: list[list[float]]
    """m/s, m/s² and m/s³ of the first way"""
    several: list[bool]
    """whether there are more"""
    all: Array
    """(M, K, 3)"""

    @classmethod
    def of(cls, cells: Cells) -> "_Ways":
        ways = np.stack((cells.speed, cells.acceleration, cells.jerk), axis=-1)
        return cls(
            cells.length.tolist(), cells.gear.T.tolist(), ways[0].tolist(), cells.several.tolist(), ways
        )

    def reached(self, k: int, v0: float, v1: float) -> float:
        """m/s: greatest speed up to v1 that cell k reaches from v0."""
        begin, end = self.gear[k]
        if begin != 1.0 or end != 1.0:
            kept = v0 / begin * end
            return v1 if kept >= v1 * (1 - SAME / 4) else kept
        length = self.length[k]
        if not self.several[k]:
            v, a, j = self.first[k]
            return min(v, reachable(v0, length, a, j))
        best = v0
        for v, a, j in self.all[:, k].tolist():
            if best < v:
                best = max(best, min(v, reachable(v0, length, a, j)))
                if best >= v1:
                    break
        return best
