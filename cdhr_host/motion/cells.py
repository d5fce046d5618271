"""Cells: stretches of path with one set of bounds on s', s'' and s''' each.

Whatever a time law does inside the bounds of a cell, the nozzle keeps its limits there. A
straight cell gives the whole of them to s'' and s'''; a bent one keeps a part for turning.
At the borders of cells s'' = 0: so they are as long as their bounds are alike. A corner with a shape
(``motion.swings``) is a cell in which s' stays the same; where it begins and ends |q'| may be less than
1, its gears.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.budget import Bends, Menu, menu
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.smooth_path import SmoothPath
from cdhr_host.values import Array, Flags, Ints

LONG_RUN = 4.0
"""A bend longer than this many half-widths must let the speed change inside it."""
CELL = 2.0
"""Length of the shortest cells of a long bend, in half-widths."""
SIZES = (8, 4, 2)
"""Numbers of such cells that may become one."""
ALIKE = 0.85, 0.2
"""Speeds and shares of cells that may become one are within these parts of each other."""
MERGE = 0.1
"""m, cells are merged up to this length, so that a long path has borders to stop at."""
LASTING = 1.0
"""s, and up to what is passed in this time, so that a slow one has them as often."""
FREE = 0.6
"""A bend that leaves this share of the limits to changing speed goes together with its neighbours."""
SHORT = 0.01
"""m, straights up to this length go together with such bends."""
TOGETHER = 2
"""Times MERGE or LASTING: how long rows of cells may be in which the speed changes as one."""
TOUCHING = 1e-12
"""m, less is rounding."""


@dataclass(frozen=True, slots=True)
class Cells:
    """K stretches of path in order, each with bounds on ds/dt and its derivatives.

    A bend can be run through in several ways, the faster, the less the speed may change; ways are
    in this order. A straight has one, M times.
    """

    start: Array
    """(K,) m in s"""
    length: Array
    """(K,) m in s"""
    speed: Array
    """(M, K) m/s, greatest s' on each of M ways to run through a cell"""
    acceleration: Array
    """(M, K) m/s², greatest |s''|; 0 where the speed must stay constant"""
    jerk: Array
    """(M, K) m/s³, greatest |s'''|; 0 where the speed must stay constant"""
    settled: float
    """m in s: cells up to it keep their bounds whatever path follows"""
    bent: Flags
    """(K,) whether the cell lies in a long bend"""
    gear: Array
    """(2, K) |q'| at its start and at its end: the nozzle's speed there, of s' within it"""
    together: Ints
    """(K,) number of the row of cells in which the speed may change as one (motion.hastened); -1 in none"""

    @property
    def several(self) -> Flags:
        """(K,) whether there is more than one way to run through it."""
        speed, a = self.speed, self.acceleration
        return np.asarray((speed[0] != speed[-1]) | (a[0] != a[-1]), dtype=np.bool_)

    def only(self, which: Ints | slice) -> "Cells":
        """Some of the cells."""
        return Cells(
            self.start[which],
            self.length[which],
            self.speed[:, which],
            self.acceleration[:, which],
            self.jerk[:, which],
            self.settled,
            self.bent[which],
            self.gear[:, which],
            self.together[which],
        )


@dataclass(frozen=True, slots=True)
class _Stretches:
    """Pieces of the path between two places, or rows of them, with what bounds the speed there."""

    start: Array
    """m in s"""
    length: Array
    cap: Array
    """m/s"""
    spend: Array
    """share of acceleration and jerk that the air leaves for changing speed"""
    room: Array
    """share of the acceleration that the cables leave"""
    bends: Bends
    bent: Flags
    gear: Array
    """as in the path"""
    run: Ints
    """number of the bend or straight"""
    long: Flags
    """whether that is a long bend"""

    @property
    def shaped(self) -> Flags:
        """Whether it is a corner with a shape."""
        return np.asarray(self.gear[0] > 0.0, dtype=np.bool_)


def cells(
    path: SmoothPath,
    bends: Bends,
    feed: Array,
    span: tuple[float, float],
    limits: MotionLimits,
    *,
    share: tuple[Array, Array],
    passed: float,
    long: tuple[float, float],
) -> Cells:
    """Cells of a path over a span of s.

    ``feed`` (K,) m/s is the speed wanted on each piece; the first ``share`` (K,) is what the air leaves of
    acceleration and jerk for changing it, the second what the cables leave of the acceleration;
    a bend counts as long in any case if it begins or ends within ``long`` m of the span's ends: it
    was begun earlier, or the nozzle rests there. A leg is divided where its length, of which ``passed`` (m)
    lies before s = 0, is a multiple of a cell's; so it is divided alike whenever it is planned again, and
    what could be braked from a border still can.
    """
    h = limits.half_width
    rate = np.minimum(feed, limits.speed) / path.steep
    pieces = _between(path, bends, (rate, *share), span, h=h, at_ends=long)
    rows = _rows(pieces, h, passed)
    cap = np.minimum(rows.cap, _pushed_speed(rows, limits))
    ways = menu(cap, rows.room, rows.bends, rows.long, rows.shaped, limits).within(rows.spend)
    speed, spent = ways.usual(rows.long, cap)
    held_up = rows.long & (speed < cap)
    heads, settled = _alike(rows, speed, spent, h, (passed, _begun(path, span[0])))
    open_end = bool(rows.bent[-1])
    rows, ways = _merged(rows, heads), ways.least(heads)
    speed, spent = (np.minimum.reduceat(each, heads) for each in (speed, spent))
    spent, last = _levelled(rows, speed, spent, passed, settled if open_end else np.inf)
    apart = np.where(np.maximum.reduceat(held_up, heads), np.arange(len(heads)), -1)
    heads = _heads(speed, spent, *rows.gear, _multiples(rows.start + passed, _longest(speed)), apart)
    rows, ways = _merged(rows, heads), ways.least(heads)
    a, j, gear = (
        ways.share * limits.acceleration,
        ways.share * limits.jerk,
        np.where(rows.shaped, rows.gear, 1.0),
    )
    settled, together = min(span[1], last), _together(rows, ways, passed)
    return Cells(rows.start, rows.length, ways.speed, a, j, settled, rows.long, gear, together)


def _together(rows: _Stretches, ways: Menu, passed: float) -> Ints:
    """(K,) numbers of rows of cells that turning holds up, with the straights between them.

    They begin and end where the path and its feed alone say so. Where the air leaves a part of the limits
    there are none.
    """
    held = (ways.speed[0] != ways.speed[-1]) | ~rows.bent
    held &= ~rows.shaped & (rows.spend == 1.0)
    place = _multiples(rows.start + passed, TOGETHER * _longest(rows.cap))
    number = np.cumsum(np.diff(held, prepend=False) | (np.diff(place, prepend=0.0) != 0))
    return np.where(held, number, -1)


def _pushed_speed(rows: _Stretches, limits: MotionLimits) -> Array:
    """(K,) m/s: greatest s' in a bend whose slowing down the air can follow with its share.

    A corner turned by theta is cut, so that |q'| falls to cos(theta/2) in its middle: along the path
    q'' is up to |q''| sin(theta/2). A corner with the usual kernel has sin(theta/2) = |q''| h/2, a
    wider kernel of its own (h = 2 h0/theta) about the root of |q''| h0/2, which is the greater one.
    Shapes are made only where the air's share is the whole.
    """
    bend = rows.bends.second
    with np.errstate(divide="ignore"):
        sine = np.sqrt(np.minimum(1.0, bend * limits.half_width / 2.0))
        found = np.sqrt(rows.spend * limits.acceleration / (bend * sine))
    return np.where(rows.shaped, np.inf, found)


def _between(
    path: SmoothPath,
    bends: Bends,
    wanted: tuple[Array, Array, Array],
    span: tuple[float, float],
    *,
    h: float,
    at_ends: tuple[float, float],
) -> _Stretches:
    """The pieces of a path that lie in a span of s, cut at its ends; ``wanted``: speeds, both shares."""
    feed, share, room = wanted
    ends = np.append(path.start[1:], path.end)
    first = span[0] + min(TOUCHING, (span[1] - span[0]) / 2)
    used = np.flatnonzero((ends > first) & (path.start < span[1]))
    start = np.maximum(path.start[used], span[0])
    length = np.minimum(ends[used], span[1]) - start
    bent, gear = path.bending[used] > 0, path.gear[:, used]
    shaped = gear[0] > 0.0
    run = np.cumsum((np.diff(bent, prepend=bent[0]) != 0) | (np.diff(shaped, prepend=shaped[0]) != 0))
    heads = np.flatnonzero(np.diff(run, prepend=-1))
    long = bent & (np.add.reduceat(length, heads)[run] > LONG_RUN * h)
    begins, finishes = start[heads][run], np.append(start[heads[1:]], span[1])[run]
    long |= bent & ((begins <= span[0] + at_ends[0]) | (finishes >= span[1] - at_ends[1]))
    return _Stretches(
        start, length, feed[used], share[used], room[used], bends.only(used), bent, gear, run, long & ~shaped
    )


def _rows(pieces: _Stretches, h: float, passed: float) -> _Stretches:
    """Pieces together: a short bend is one, a long one many; straights end where the feed changes,
    and every MERGE or LASTING."""
    bent, place = pieces.bent, pieces.start + passed
    part = np.where(pieces.long, _multiples(place, CELL * h), 0.0)
    fed = _numbered(pieces.cap) + _numbered(pieces.spend) + _numbered(pieces.room)
    stretch = np.where(bent, 0.0, _multiples(place, _longest(pieces.cap)))
    return _merged(pieces, _heads(pieces.run, part, np.where(bent & ~pieces.long, 0, fed), stretch))


def _numbered(values: Array) -> Ints:
    """(K,) number of the row of equal neighbours that each is in."""
    return np.cumsum(np.diff(values, prepend=values[0]) != 0)


def _heads(*columns: Array | Ints | Flags) -> Ints:
    """First of each row of neighbours that are the same in all columns."""
    table = np.stack([np.asarray(column, dtype=float) for column in columns])
    change = (np.diff(table, prepend=table[:, :1] - 1.0) != 0).any(axis=0)
    return np.flatnonzero(change)


def _merged(rows: _Stretches, heads: Ints) -> _Stretches:
    """Each row of neighbours, from one of ``heads`` to before the next, as one."""
    return _Stretches(
        rows.start[heads],
        np.add.reduceat(rows.length, heads),
        np.minimum.reduceat(rows.cap, heads),
        np.minimum.reduceat(rows.spend, heads),
        np.minimum.reduceat(rows.room, heads),
        rows.bends.largest(heads),
        rows.bent[heads],
        rows.gear[:, heads],
        rows.run[heads],
        rows.long[heads],
    )


def _begun(path: SmoothPath, s: float) -> bool:
    """Whether a bend has begun before a place."""
    piece = int(np.searchsorted(path.start, s - TOUCHING, side="right")) - 1
    return piece >= 0 and bool(path.bending[piece] > 0 and not path.gear[0, piece])


def _alike(
    rows: _Stretches, speed: Array, share: Array, h: float, before: tuple[float, bool]
) -> tuple[Ints, float]:
    """First of each group of cells of a long bend that are alike, and where the last group begins.

    Groups begin at multiples of their size, so that they are the same whenever planned again.
    ``before``: m passed before s = 0, and whether the first bend has begun earlier. A group that has, too,
    was not alike: else no border would lie in it.
    """
    passed, begun = before
    place = _multiples(rows.start + passed, CELL * h)
    place = np.where(rows.long, place, -1.0 - np.arange(len(place)))
    label = np.arange(len(place), dtype=float)
    most = np.maximum(_longest(rows.cap) / (CELL * h), 1.0)
    for size in reversed(SIZES):
        heads = _heads(rows.run, np.floor(place / size))
        group = np.repeat(np.arange(len(heads)), np.diff(np.append(heads, len(place))))
        even = np.minimum.reduceat(speed, heads) >= ALIKE[0] * np.maximum.reduceat(speed, heads)
        even &= np.minimum.reduceat(share, heads) >= ALIKE[1] * np.maximum.reduceat(share, heads)
        even &= rows.long[heads] & (size <= most[heads])
        even &= np.minimum.reduceat(rows.cap, heads) == np.maximum.reduceat(rows.cap, heads)
        even[0] &= not begun or place[0] % size == 0
        label = np.where(even[group], heads[group], label)
    greatest = max((size for size in SIZES if size <= most[-1]), default=1)
    last = _heads(rows.run, np.floor(place / greatest))[-1]
    return _heads(label), float(rows.start[last])


def _levelled(
    rows: _Stretches, speed: Array, share: Array, passed: float, settled: float
) -> tuple[Array, float]:
    """Shares (K,), the same in rows of bends that take little and the short straights between them.

    And where the last of these begins that may go on beyond what is ``settled`` (m), or else that.
    """
    free = (share >= FREE) & (rows.bent | (rows.length < SHORT)) & ~rows.shaped
    heads = _heads(free, speed, _multiples(rows.start + passed, _longest(speed)))
    count = np.diff(np.append(heads, len(share)))
    least = np.repeat(np.minimum.reduceat(share, heads), count)
    bent = np.repeat(np.logical_or.reduceat(rows.bent, heads), count)
    level = np.where(free & bent, least, share)
    last = int(np.searchsorted(rows.start, settled)) - 1
    open_row = heads[np.searchsorted(heads, last, side="right") - 1] if last >= 0 and free[last] else last + 1
    return level, float(rows.start[open_row]) if open_row < len(rows.start) else np.inf


def _longest(speed: Array) -> Array:
    """(K,) m/s -> (K,) m that cells may have: MERGE halved until it lasts no longer than LASTING."""
    halves = np.floor(np.log2(np.maximum(speed * LASTING / MERGE, 2.0**-20)))
    return MERGE * np.exp2(np.minimum(halves, 0.0))


def _multiples(length: Array, cell: Array | float) -> Array:
    """(K,) m, m -> (K,): whole cells before each length; what rounding has put before a border is on it."""
    whole: Array = np.floor((length + TOUCHING) / cell)
    return whole
