"""How corners are rounded: wide where the nozzle need not slow down, braking where it must.

A corner between directions d0 and d1 is rounded by a kernel (smooth_path), at whose every
place ds/dt may stay the same. Where that would cost much speed, and both segments leave
room, the nozzle instead brakes into the corner or accelerates out of it, or both: with u
the time from the middle, in [-T, T], its jerk is

    p0 d0 + r1 d1 before the middle,   r0 d0 + p1 d1 after it.

The motion along d0 comes to rest, the one along d1 begins to move, and both overlap by 2 T.
They join straights at the speed V = (3 r + p) T²/2, the same on both sides, with s'' of
size D = (r + p) T, a way of (7 r + p) T³/6 from the corner. p = -r is the kernel itself,
without braking. In s = V u these are two cubics like all others of the path, but |q''|
begins with a part -D0/V² along d0 and ends with D1/V² along d1, which the time law must meet
with s'' = -D0 and s'' = D1. Slower by any factor, the same holds.

The nozzle is nowhere further from both segments than it is from the corner in the middle,
T³/6 |r1 d1 - r0 d0|: before, it has moved less along d1, and after, less is left along d0.
And |v| <= V, for the sum of the two speeds begins and ends there and is less in the middle.

Of the shares p/r in SHARES those are taken with which the nozzle is soonest from the middle of
one segment in the middle of the next.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.beside import Allowance, Beside
from cdhr_host.motion.chords import Turns, widened
from cdhr_host.values import Array, Flags, Ints

SHARES = np.linspace(-1.0, 1.0, 9)
"""p/r that are compared on each side; the first is the kernel's."""
FINER = (0.125, 0.04)
"""Steps of p/r around the best of them, by which it is then made better."""
NEARBY = np.array([0.0, -1.0, 1.0])
HALVINGS = 12
"""Of an interval of speeds, to compare times."""
TIED = 1e-9
"""Of a time, less is no gain: which of two equal ways is taken must not depend on rounding."""
RADIANS, METRES = 9, 12
"""Decimals of what the choice is made by, for the same reason."""
ALONE = 0.999
"""Of the usual half-width, the least room on both sides of a corner that stands alone."""


@dataclass(frozen=True, slots=True)
class Rounding:
    """The stretches of s in which K corners are rounded."""

    half: Array
    """(K,) m in s, half of each"""
    saved: Array
    """(2, K) m, by which each half is longer than the drawn way it stands for"""
    brake: Array
    """(2, K) 1/m, D/V² on each side"""
    third: Array
    """(2, 2, K) 1/m²: in half i, q''' is third[i, 0] d0 + third[i, 1] d1"""


@dataclass(frozen=True, slots=True)
class Corners:
    """K corners of a polyline, and what is around them; rows of pairs are before and after."""

    turn: Array
    """(K,) length of the change of direction"""
    room: Array
    """(2, K) m, of the straights beside it"""
    feed: Array
    """(2, K) m/s"""
    limits: Array
    """(2, K) m/s² and m/s³ that braking corners keep"""
    width: Array
    """(K,) m, three times the distance by which each may be cut"""

    def only(self, which: Ints) -> "Corners":
        """Some of them."""
        room, feed, limits = self.room[:, which], self.feed[:, which], self.limits[:, which]
        return Corners(self.turn[which], room, feed, limits, self.width[which])

    def rounded(self) -> "Corners":
        """Without the last digits, in which sums along the path differ with where they begin."""
        turn, room, width = self.turn.round(RADIANS), self.room.round(METRES), self.width.round(METRES)
        return Corners(turn, room, self.feed, self.limits, width)


@dataclass(frozen=True, slots=True)
class Widths:
    """What the tolerance, and the ends of the path, allow the kernels of K corners."""

    usual: float
    """m, half-width of the kernels that span several corners"""
    own: Array
    """(K,) m, the same for a corner that stands alone; less where the way to it was drawn straight"""
    ends: Array
    """(2, K) m to both ends of the path; half of it is left for the stop"""
    borders: Array
    """(N,) m of the polyline where points were moved or the feed changes, ascending"""


def turns(around: Beside, turn: Array, widths: Widths) -> Turns:
    """K corners, whose changes of direction are (K,), with the kernels they have each for itself."""
    reach = around.room.min(axis=0)
    alone = reach >= ALONE * widths.usual
    shared = np.minimum(widths.usual, widths.ends.min(axis=0) / 2)
    half = np.where(alone, np.minimum(reach, 2 * widths.own / turn), shared)
    return Turns(around.at, turn, half, alone, around.room, widths.ends, widths.borders)


def roundings(
    single: Turns, even: Array, corner: Ints, widths: Widths, allowed: Allowance | None
) -> Rounding:
    """Roundings of the corners at points ``corner`` (K,) of a polyline; ``even`` as in ``Beside``."""
    if allowed is None:
        return _kernels(single.half)
    feed = _beside(allowed.feed, corner, 0.0)
    half, chords = widened(single, feed.max(axis=0), widths.usual, allowed)
    share = _beside(allowed.share, corner, 0.0).min(axis=0)
    limits = np.multiply.outer(np.array([allowed.acceleration, allowed.jerk]), share)
    corners, found = Corners(single.turn, even, feed, limits, widths.own), _kernels(half)
    _brake(found, _worthwhile(half, corners, ~chords, widths.usual, allowed), corners)
    return found


def _kernels(half: Array) -> Rounding:
    """Kernels of half-widths (K,) m, without braking."""
    none, steep = np.zeros((2, len(half))), 1 / half**2
    return Rounding(half, none, none.copy(), np.array([[-steep, steep], [steep, -steep]]))


def _beside(values: Array, corner: Ints, end: float) -> Array:
    """(M,) -> (2, K): values of the segments before and after each corner; at the ends, ``end``."""
    padded = np.concatenate(([end], values, [end]))
    return np.stack((padded[corner], padded[corner + 1]))


def _worthwhile(half: Array, around: Corners, single: Flags, h: float, allowed: Allowance) -> Ints:
    """Corners with room on both sides at which a kernel would hold up a change of speed.

    Only ``single`` (K,) ones, not chords that are smoothed together. Not where the air bounds that change:
    a flow that falls and rises within a corner is the hardest for it.
    """
    by_jerk = np.cbrt(allowed.jerk * half**2 / around.turn)
    by_acceleration = np.sqrt(allowed.acceleration * half / around.turn)
    slow = np.minimum(by_jerk, by_acceleration) < around.feed.max(axis=0)
    roomy = around.room.min(axis=0) >= ALONE * h
    return np.flatnonzero(slow & roomy & single & (around.limits[0] >= allowed.acceleration))


@dataclass(frozen=True, slots=True)
class _Swing:
    """Ways around corners, one for each pair of shares: arrays (..., K, S) of S pairs."""

    share: Array
    """(2, K, S) p/r"""
    r: Array
    """(2, K, S) m/s³"""
    duration: Array
    """(K, S) s, T"""

    @property
    def speed(self) -> Array:
        """m/s, V"""
        found: Array = self.r[0] * (3 + self.share[0]) / 2 * self.duration**2
        return found

    @property
    def braking(self) -> Array:
        """m/s², D"""
        return self.r * (1 + self.share) * self.duration

    @property
    def reach(self) -> Array:
        """m of each segment"""
        return self.r * (7 + self.share) / 6 * self.duration**3


def _swings(around: Corners, share: Array) -> _Swing:
    """The widest way around each corner, by shares, that limits, tolerance, room and feeds allow.

    Room and feed are kept for bringing s'' to zero beyond the corner.
    """
    a, j = around.limits[:, :, None]
    cosine = (1 - around.turn**2 / 2)[:, None]
    r = 1 / (3 + share)
    p = share * r
    jerks = (p[i] ** 2 + r[1 - i] ** 2 + 2 * p[i] * r[1 - i] * cosine for i in (0, 1))
    r = r * (j / np.sqrt(np.maximum(*jerks)))
    apart = np.sqrt(np.maximum(r[0] ** 2 + r[1] ** 2 - 2 * r[0] * r[1] * cosine, 0.0))
    v, d = r * (3 + share) / 2, r * (1 + share)
    way = r * (7 + share) / 6 + v * d / j + d**3 / (3 * j**2)
    with np.errstate(divide="ignore"):
        bounds = (
            np.cbrt(2 * around.width[:, None] / apart),
            a / np.maximum(apart, d.max(axis=0)),
            np.cbrt(around.room[:, :, None] / way).min(axis=0),
            np.sqrt(around.feed[:, :, None] / (v + d**2 / (2 * j))).min(axis=0),
        )
    return _Swing(share, r, np.minimum.reduce(bounds))


def _soonest(around: Corners) -> _Swing:
    """The best way around each corner: arrays (2, K) and (K,)."""
    share = np.stack(np.meshgrid(SHARES, SHARES)).reshape(2, 1, -1)
    swing = _swings(around, share)
    best = _first(_time(swing, around))
    share = share[:, 0, best]
    for step in FINER:
        around_it = step * np.stack(np.meshgrid(NEARBY, NEARBY)).reshape(2, 1, -1)
        near = np.clip(share + around_it, SHARES[0], SHARES[-1])
        swing = _swings(around, near)
        best = _first(_time(swing, around))
        share = np.take_along_axis(near, best[None], axis=2)
    best_r = np.take_along_axis(swing.r, best[None], axis=2)[:, :, 0]
    return _Swing(share[:, :, 0], best_r, np.take_along_axis(swing.duration, best, axis=1)[:, 0])


def _first(times: Array) -> Ints:
    """(K, S) -> (K, 1): the first of the least."""
    found: Ints = np.argmax(times <= times.min(axis=1, keepdims=True) * (1 + TIED), axis=1)
    return found[:, None]


def _time(swing: _Swing, around: Corners) -> Array:
    """(K, S) s: from the middle of one segment to the middle of the next, s'' = 0 in both."""
    speed, braking, limits = swing.speed, swing.braking, around.limits[:, :, None]
    j = limits[1]
    spared = braking / j
    # The change of speed is part of one that begins with s'' = 0, where j has only just set in.
    least = speed - braking * spared / 2
    room = around.room[:, :, None] - swing.reach + (least + braking * spared / 6) * spared
    low, high = speed + braking * spared / 2, np.broadcast_to(around.feed[:, :, None], braking.shape)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        fits = (least + middle) / 2 * _change(middle - least, limits) <= room
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    change = _change(low - least, limits)
    cruise = np.maximum(room - (least + low) / 2 * change, 0.0) / low
    return np.asarray((swing.duration + change - spared + cruise).sum(axis=0), dtype=np.float64)


def _change(difference: Array, limits: Array) -> Array:
    """m/s, (m/s², m/s³) -> s, for a change of speed with s'' = 0 at both ends."""
    a, j = limits
    peak = np.maximum(np.minimum(a, np.sqrt(j * np.maximum(difference, 0.0))), np.finfo(float).tiny)
    return np.asarray(difference / peak + peak / j)


def _brake(found: Rounding, which: Ints, around: Corners) -> None:
    """Replace those kernels that braking is quicker than."""
    if not len(which):
        return
    swing = _soonest(around.only(which).rounded())
    braked = (swing.share > -1.0).any(axis=0)
    which, share, r = which[braked], swing.share[:, braked], swing.r[:, braked]
    speed, duration = swing.speed[braked], swing.duration[braked]
    found.half[which] = speed * duration
    found.saved[:, which] = speed * duration - swing.reach[:, braked]
    found.brake[:, which] = swing.braking[:, braked] / speed**2
    third = np.array([[share[0] * r[0], r[1]], [r[0], share[1] * r[1]]])
    found.third[:, :, which] = third / speed**3
