"""How corners are rounded: wide where the nozzle need not slow down, slowing down where it must.

A corner between directions d0 and d1 is rounded by a kernel (smooth_path), at whose every
place ds/dt may stay the same. Where that would cost much speed, and both segments leave
room, the nozzle takes a *shape* instead (``motion.shapes``, ``motion.swings``): a motion that swings out,
slows down, turns, and speeds up again. ds/dt stays the same all along it, at the greatest speed V on its
way: so |q'| <= 1, and where it begins and ends |q'| is a part of that, its *gears*. At full speed V is as
great as the limits, the tolerance, the feeds and the room beside the corner allow. Slower by any factor, the
same holds: the corner is then run through at the speed the straight before it is left with, over the gear.
"""

from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.motion.beside import SHARP, Allowance, Beside
from cdhr_host.motion.chords import Turns, widened
from cdhr_host.motion.paired import Near, candidates, put, taken
from cdhr_host.motion.rounding import Inner, Rounding, kernels
from cdhr_host.motion.swings import TIED, Corners, Swings, swung, time_around
from cdhr_host.motion.vectors import norms
from cdhr_host.values import Array, Flags, Ints

ALONE = 0.999
"""Of the usual half-width, the least room on both sides of a corner that stands alone,"""
WIDEST = 0.75
"""and of that room its widest kernel; the rest is left for changing speed."""
ROW = 6
"""Sharp corners with less room between them that stand alone all the same, at most;"""
BETWEEN = 0.2
"""and of the usual half-width, the least room of each."""


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
    swings: Flags
    """(K,) whether the nozzle may swing out there: not where that leads below what is drawn"""


def turns(around: Beside, directions: tuple[Array, Array], widths: Widths) -> Turns:
    """K corners between ``directions`` (K, 3) before and after, with the kernels each has for itself."""
    turn = norms(directions[1] - directions[0])
    reach = around.room.min(axis=0)
    alone = _alone(around, turn, widths.usual)
    shared = _narrowed(
        np.minimum(widths.usual, widths.ends.min(axis=0) / 2), around, directions, widths, alone
    )
    single = np.minimum(np.maximum(WIDEST * reach, np.minimum(reach, widths.usual)), 2 * widths.own / turn)
    half = np.where(alone, single, shared)
    return Turns(around.at, turn, half, alone, around.room, widths.ends, widths.borders)


def _narrowed(
    half: Array, around: Beside, directions: tuple[Array, Array], widths: Widths, alone: Flags
) -> Array:
    """(K,) m: kernels that overlap, narrower around a corner that was moved by what they would leave it by.

    With T the most that directions within two half-widths of it differ from one of them, before and after it
    together, they leave the path by T/6 half-widths at most: partial summation, for a kernel leaves the less
    of a turn, the further off that is.
    """
    at, h = around.at, widths.usual
    narrow = half.copy()
    for k in np.flatnonzero(~alone & (widths.own < h)).tolist():
        near = slice(*np.searchsorted(at, (at[k] - 2 * h, at[k] + 2 * h)).tolist())
        if _differ(np.concatenate((directions[0][near][:1], directions[1][near]))) * h > 2 * widths.own[k]:
            some = slice(*np.searchsorted(at, (at[k] - 3 * h, at[k] + 3 * h)).tolist())
            beyond = np.maximum(np.abs(at[some] - at[k]) - 2 * h, 0.0)
            narrow[some] = np.minimum(narrow[some], widths.own[k] + beyond)
    return narrow


def _differ(direction: Array) -> float:
    """(N, 3) -> the most that those after one of them and those before it differ from it, added."""
    apart = np.linalg.norm(direction[:, None] - direction, axis=2)
    return float((np.triu(apart).max(axis=1) + np.tril(apart).max(axis=1)).max())


def open_rows(around: Beside, turn: Array, usual: float) -> Ints:
    """(K,) the first of the row that each corner is in; itself in a row that is too long."""
    row, number = _rows(around, turn, usual), np.arange(len(turn))
    return np.asarray(np.where(number - row < ROW, row, number), dtype=np.intp)


def _rows(around: Beside, turn: Array, usual: float) -> Ints:
    """(K,) the first of the row that each corner is in: sharp ones with little room between them."""
    sharp = turn >= SHARP
    near = np.minimum(around.room[1, :-1], around.room[0, 1:]) < ALONE * usual
    linked = np.concatenate(([False], near & sharp[:-1] & sharp[1:]))
    return np.asarray(np.maximum.accumulate(np.where(linked, 0, np.arange(len(turn)))), dtype=np.intp)


def _alone(around: Beside, turn: Array, usual: float) -> Flags:
    """(K,) whether a corner has room enough on both sides, or stands in a row that has it at both ends."""
    roomy = around.room >= ALONE * usual
    alone = np.asarray(roomy.all(axis=0), dtype=np.bool_)
    if alone.all():
        return alone
    row = _rows(around, turn, usual)
    heads = np.flatnonzero(row == np.arange(len(row)))
    tails = np.append(heads[1:], len(row)) - 1
    count = tails - heads + 1
    enough = np.minimum.reduceat(around.room.min(axis=0), heads) >= BETWEEN * usual
    stands = (count > 1) & (count <= ROW) & roomy[0, heads] & roomy[1, tails] & enough
    return np.asarray(alone | np.repeat(stands, count), dtype=np.bool_)


def roundings(
    single: Turns,
    around: Beside,
    corners: tuple[Ints, Array, Array],
    widths: Widths,
    allowed: Allowance | None,
) -> Rounding:
    """Roundings of K corners of a polyline: their points (K,), and directions (K, 3) before and after."""
    corner, *directions = corners
    if allowed is None:
        return kernels(single.half)
    feed = _beside(allowed.feed, corner, 0.0)
    half, chords = widened(single, feed.max(axis=0), widths.usual, allowed)
    pace = around.pace
    limits = np.multiply.outer(np.array([allowed.acceleration, allowed.jerk]), pace.share.min(axis=0))
    found = Corners(
        single.turn, pace.even, pace.feed, pace.feed, limits, widths.own, widths.swings, around.held
    )
    which = _worthwhile(half, found, single.alone & ~chords, allowed)
    if not len(which):
        return kernels(half)
    run = allowed.runs()
    even = np.append(run[corner[:-1]] == run[corner[1:] - 1], False)
    first = candidates(which, found.only(which), even[which])
    near = _near(first, which[first], around.at, directions)
    return _shaped(kernels(half), which, found.only(which), near)


def _near(first: Ints, corner: Ints, at: Array, directions: list[Array]) -> Near:
    """Pairs that ``corner`` (P,) and the next ones are."""
    (before, after), length = directions, at[corner + 1] - at[corner]
    moves = np.stack((before[corner], after[corner], after[corner + 1]))
    return Near(first, moves.swapaxes(1, 2), length)


def _beside(values: Array, corner: Ints, end: float) -> Array:
    """(M,) -> (2, K): values of the segments before and after each corner; at the ends, ``end``."""
    padded = np.concatenate(([end], values, [end]))
    return np.stack((padded[corner], padded[corner + 1]))


def _worthwhile(half: Array, around: Corners, alone: Flags, allowed: Allowance) -> Ints:
    """Corners that stand ``alone`` (K,) at which a kernel would hold up a change of speed.

    Not where the air bounds that change: a flow that falls and rises within a corner is the hardest for it.
    """
    slow = _kernel_speed(half, around) < around.feed.max(axis=0)
    return np.flatnonzero(slow & alone & (around.limits[0] >= allowed.acceleration))


def _kernel_speed(half: Array, around: Corners) -> Array:
    """(K,) m/s that the limits allow in a kernel."""
    a, j = around.limits
    found: Array = np.minimum(np.cbrt(j * half**2 / around.turn), np.sqrt(a * half / around.turn))
    return found


def _shaped(found: Rounding, which: Ints, around: Corners, near: Near) -> Rounding:
    """With shapes instead of those kernels of corners ``which`` that they are quicker than."""
    half, swings = found.half[:, which], _swings(which, around)
    speed = np.minimum(_kernel_speed(half[0], around), around.feed.min(axis=0))
    usual = time_around(around, 2 * half[0] / speed, np.stack((speed, speed)), half)
    time = time_around(around, swings.duration.sum(axis=0), swings.speed, swings.reach)
    pairs, ways = taken(around, near, np.minimum(usual, time))
    quicker = time < usual
    quicker[np.concatenate((pairs.first, pairs.first + 1))] = False
    better = np.flatnonzero(quicker)
    found = replace(found, inner=_replaced(found, which[better], swings.only(better)))
    return put(found, which[pairs.first], pairs.length, ways)


def _swings(which: Ints, around: Corners) -> Swings:
    """Shapes of corners ``which``, each for itself."""
    swings = swung(around)
    met = np.minimum(around.feed, _met(swings.speed, which, around.shared))
    slower = np.flatnonzero((met * (1 + TIED) < swings.speed).any(axis=0))
    return swings.replaced(slower, swung(replace(around, met=met).only(slower)))


def _met(speed: Array, which: Ints, shared: Flags) -> Array:
    """(2, K) m/s at which the next corner is left or reached on a straight too short for changing speed.

    ``speed`` (2, K) m/s is that of corners ``which`` by themselves.
    """
    met = np.full(speed.shape, np.inf)
    pair = np.flatnonzero((np.diff(which) == 1) & shared[1, :-1])
    slower = np.minimum(speed[1, pair], speed[0, pair + 1])
    met[1, pair], met[0, pair + 1] = slower, slower
    return met


def _replaced(found: Rounding, which: Ints, swings: Swings) -> Inner:
    """Put shapes in the place of kernels; what is between begin, middle and end."""
    speed = swings.peak.max(axis=0)
    length, third = swings.duration * speed, swings.jerk / speed**3
    middle = len(length) // 2
    found.half[:, which] = length[:middle].sum(axis=0), length[middle:].sum(axis=0)
    found.saved[:, which] = found.half[:, which] - swings.reach
    found.gear[:, which], found.steep[:, which] = swings.speed / speed, swings.peak / speed
    step = np.diff(third, axis=1, prepend=0.0, append=0.0)
    found.step[:, :, which] = step[:, [0, middle, -1]].swapaxes(0, 1)
    found.shaped[which] = True
    at = np.cumsum(length, axis=0)[:-1] - found.half[0, which]
    between = np.delete(np.arange(len(at)), middle - 1)
    return Inner(np.tile(which, len(between)), at[between].ravel(), step[:, 1:-1][:, between].reshape(2, -1))
