"""Speeds at the borders of cells.

A speed change from v0 to v1 with s'' = 0 at both ends and |s''| <= a, |s'''| <= j takes
T = 2 sqrt(d/j) if d = |v1 - v0| <= a²/j, else d/a + a/j, over the distance (v0 + v1)/2 · T.

At most borders s'' = 0. Beside a corner that is braked into, a straight begins with
s'' = b v² or ends with -b v² (``Cells.pulls``). It is then part of a longer change, from
the speed v - (b v²)²/2j at which s'' would have been 0 with full jerk, and must rise to at
least v + (b v²)²/2j before it can fall.

A bend can be run through in several ways, the faster, the less the speed may change in it. From border to
border it must be one of them; which, is chosen when the speeds at all borders are known (``choice``).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.motion.cells import Cells
from cdhr_host.values import Array, Flags, Ints

NEWTON_STEPS = 6
"""From at most twice the root of a rising convex function that is never flat, from above."""
FARTHER = 1.25
"""How much shorter cells are taken to be where what follows is not known. Slowing down to v/3 takes 9 % more
way than to rest, and no other speed more; somewhat more where s'' is not 0 at the end."""
HALVINGS = 48
"""Of an interval of speeds: to rounding."""
SPARE = 1 - 1e-6
"""Of the length of a cell with pulls: near an end's peak it varies with the root of rounding."""
ROUNDING = 1e-13
"""m by which a change of speed may be longer than its cell."""
CLOSE = 1e-13
"""m, how well a search meets the length of a cell, from below."""


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


@dataclass(frozen=True, slots=True)
class End:
    """One end of K cells, as the speed change sees it that the cell is part of."""

    change: Array
    """(K,) m/s², how s'' rises from this end inwards"""
    least: Array
    """(K,) m/s, the speed at which the whole change begins"""
    spared: Array
    """(K,) m, the part of the whole change that lies beyond the end"""
    peak: Array
    """(K,) m/s, the least speed to which it must lead"""

    def only(self, which: Ints) -> "End":
        """Those of some of the cells."""
        return End(self.change[which], self.least[which], self.spared[which], self.peak[which])


def end(speed: Array, pull: Array, jerk: Array) -> End:
    """Ends at which s' is (K,) m/s and s'' = pull s'²."""
    change = pull * speed**2
    time = np.divide(change, jerk, out=np.zeros_like(change), where=change > 0)
    gain = change * time / 2
    least = speed - gain
    return End(change, least, (least + gain / 3) * time, speed + gain)


def ends(cells: Cells, borders: Array) -> tuple[End, End]:
    """Both ends of each cell, of border speeds (K+1,) m/s."""
    jerk = cells.jerk[0]  # where there are pulls there is one way
    return end(borders[:-1], cells.pulls[0], jerk), end(borders[1:], cells.pulls[1], jerk)


def needed(both: tuple[End, End], peak: Array, cells: Cells) -> Array:
    """(M, K) m: the distance from the first end up to a peak (K,) or (M, K) m/s and down to the other end."""
    a, j = cells.acceleration, cells.jerk
    return sum((change_distance(one.least, peak, a, j) - one.spared for one in both), np.zeros(a.shape))


def feasible(both: tuple[End, End], cells: Cells) -> Flags:
    """(M, K) whether each cell can have these ends."""
    peak = np.maximum(both[0].peak, both[1].peak)
    within = needed(both, peak, cells) <= cells.length + ROUNDING
    return np.asarray(within & (peak <= cells.speed), dtype=np.bool_)


def _below_peak(peak: Array, pull: Array, jerk: Array) -> Array:
    """(K,) m/s: speed of an end that leads to a peak, v + (pull v²)²/2j = peak."""
    steep = np.divide(pull**2, 2 * jerk, out=np.zeros_like(pull), where=pull > 0)
    if not pull.any():
        return peak
    with np.errstate(divide="ignore", over="ignore"):
        speed = np.minimum(peak, np.sqrt(np.sqrt(peak / steep)))
    for _ in range(NEWTON_STEPS):
        speed -= (speed + steep * speed**4 - peak) / (1 + 4 * steep * speed**3)
    return speed


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
        pulls=cells.pulls[::-1, ::-1],
    )


def _caps(cells: Cells) -> Array:
    """(K+1,) m/s: what the cells on both sides of a border allow, by themselves."""
    sides = [_below_peak(cells.speed[-1], pull, cells.jerk[0]) for pull in cells.pulls]
    sides = [np.minimum(side, _pulling(pull, cells)) for side, pull in zip(sides, cells.pulls, strict=True)]
    cap: Array = np.minimum(np.append(sides[0], np.inf), np.concatenate(([np.inf], sides[1])))
    pulled = np.flatnonzero(cells.pulls.any(axis=0))
    if len(pulled):
        some = cells.only(pulled)
        first, last = (end(cap[pulled + i], some.pulls[i], some.jerk[0]) for i in (0, 1))
        short = needed((first, last), np.maximum(first.peak, last.peak), some)[0] > some.length
        narrow = pulled[short]
        for border, speed in zip((narrow, narrow + 1), _narrowed(cells.only(narrow)), strict=True):
            np.minimum.at(cap, border, speed)
    return cap


def _pulling(pull: Array, cells: Cells) -> Array:
    """(K,) m/s: the speed at which s'' at an end is the cell's greatest."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        speed = np.sqrt(cells.acceleration[0] / pull)
    return np.asarray(np.where(pull > 0.0, speed, np.inf), dtype=np.float64)


def _narrowed(cells: Cells) -> tuple[Array, Array]:
    """Greatest speeds of both ends of cells, leading to the same peak, that their lengths allow."""
    jerk = cells.jerk[0]
    low, high = np.zeros(len(cells.length)), cells.speed[0]
    for _ in range(HALVINGS if len(low) else 0):
        middle = (low + high) / 2
        both = [end(_below_peak(middle, pull, jerk), pull, jerk) for pull in cells.pulls]
        fits = needed((both[0], both[1]), middle, cells)[0] <= SPARE * cells.length
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    return _below_peak(low, cells.pulls[0], jerk), _below_peak(low, cells.pulls[1], jerk)


def _pass(cap: Array, cells: Cells) -> Array:
    """(K+1,) -> (K+1,): each speed lowered to what the one before it can reach."""
    first, last = ends(cells, cap)
    short = np.flatnonzero(last.peak > first.peak)
    some = cells.only(short)
    short = short[~feasible((first.only(short), last.only(short)), some).any(axis=0)]
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
    pulls: list[list[float]]
    """1/m"""
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
            cells.length.tolist(), cells.pulls.T.tolist(), ways[0].tolist(), cells.several.tolist(), ways
        )

    def reached(self, k: int, v0: float, v1: float) -> float:
        """m/s: greatest speed up to v1 that cell k reaches from v0."""
        length = self.length[k]
        if any(self.pulls[k]):
            return _pulled(v0, v1, length, self.first[k], self.pulls[k])
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


@dataclass(frozen=True, slots=True)
class _Way:
    """By how much one cell with pulls is too short to go from a given end to one at v1."""

    first: tuple[float, float, float]
    """least, spared and peak of the given end, as in ``End``"""
    length: float
    a: float
    j: float
    pull: float
    """of the other end"""

    def lacking(self, v1: float) -> float:
        """m"""
        least, spared, peak = _end(v1, self.pull, self.j)
        peak = max(peak, self.first[2])
        there, back = self._change(self.first[0], peak), self._change(least, peak)
        return there + back - self.first[1] - spared - self.length

    def _change(self, low: float, high: float) -> float:
        d, knee = high - low, self.a * self.a / self.j
        time = 2 * math.sqrt(d / self.j) if d <= knee else d / self.a + self.a / self.j
        return (low + high) / 2 * time

    def below_peak(self) -> float:
        """m/s: speed of the other end that leads to the given end's peak."""
        peak = self.first[2]
        steep = self.pull**2 / (2 * self.j)
        if not steep:
            return peak
        speed = min(peak, math.sqrt(math.sqrt(peak) / math.sqrt(steep)))
        for _ in range(NEWTON_STEPS):
            speed -= (speed + steep * speed**4 - peak) / (1 + 4 * steep * speed**3)
        return speed


def _end(speed: float, pull: float, jerk: float) -> tuple[float, float, float]:
    time = pull * speed**2 / jerk
    gain = jerk * time * time / 2
    return speed - gain, (speed - gain + gain / 3) * time, speed + gain


def _pulled(v0: float, v1: float, length: float, limits: list[float], pulls: list[float]) -> float:
    """m/s: greatest speed up to v1 that a cell with pulls and ``limits`` as in ``_Ways`` reaches from v0."""
    _, a, j = limits
    way = _Way(_end(v0, pulls[0], j), SPARE * length, a, j, pulls[1])
    low, high = way.below_peak(), v1
    if low >= high or (over := way.lacking(high)) <= 0.0:
        return v1
    under, kept = way.lacking(low), 0
    # Illinois method: false position, with the value halved at an end that stays.
    while under < -CLOSE:
        middle = (low * over - high * under) / (over - under)
        found = way.lacking(middle)
        if found > 0.0:
            high, over, under = middle, found, under / 2 if kept == 1 else under
            kept = 1
        else:
            low, under, over = middle, found, over / 2 if kept == -1 else over
            kept = -1
            if found >= -CLOSE:
                break
        if high - low <= 1e-15:
            break
    return low
