"""What lies around sharp corners, drawn so that the nozzle brakes and accelerates on straights.

A nozzle brakes before a sharp corner and accelerates after it, which it does best on a straight
(``motion.corner``). So points are moved, none of them off by more than SPENT half-widths:

* sharp corners a speck apart become one in their middle;
* a short step to the side between two of them becomes a gentler one, where all is driven alike;
* points up to REACH half-widths from a corner are moved onto the chord to the last of them, or the next one
  after these, where a straight is or can be made on both of its sides.

As no point is off by more than SPENT half-widths, no place between two of them is, and the
corners themselves round by so much less.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.beside import SHARP
from cdhr_host.motion.vectors import norms, units
from cdhr_host.values import Array, Flags, Ints

REACH = 6.0
"""half-widths, how far from the corner points are moved"""
FARTHEST = 12.0
"""half-widths, the longest straight made: to the next point beyond those moved"""
SPENT = 1 / 5
"""half-widths, how far a point may move: three fifths of the tolerance"""
TRIES = (1.0, 0.8, 0.65, 0.5, 0.4)
"""Of REACH, lengths that are tried after that."""
CALM = 0.75
"""Turns that may lie within two half-widths beyond a straight's end: where kernels overlap, the path is
up to a sixth of the turns between them times h off, and with SPENT that must be less than a third of h."""
ONWARDS = 0.5
"""Least cosine between a moved segment and its straight."""
ALONE = 2.25
"""half-widths to other sharp corners, and the ends, that two must have to become one."""
LEAST = 2.5
"""half-widths, the shortest straight made."""
TOUCHING = 1e-9
"""m and rad: equal but for rounding, which must not decide what is moved."""
TOGETHER = 4
"""Sharp corners that may become one, at most."""
TINY = np.finfo(float).tiny
SLANTED = 4.0
"""half-widths, the longest side step between two sharp corners that is drawn slanted."""
SLANTS = tuple(2.0 * 0.9**k for k in range(22))
"""half-widths, tried, by which its ends are moved apart,"""
ROOM = 0.95
"""and of the segments beside it, the most."""
GENTLER = 0.95
"""Of its turns, what must be left at the most,"""
ACUTE = 1.4
"""and less than a right angle of them: else its ends are further off than from the straight."""
SPECK = 0.02
"""Of the distance by which corners are moved to become one, what is left between them."""


@dataclass(frozen=True, slots=True)
class _Drawn:
    """A polyline as it was drawn; K sharp corners."""

    points: Array
    """(M+1, 3) m"""
    along: Array
    """(M+1,) m"""
    turn: Array
    """(M+1,) change of direction, 0 at both ends"""
    sharp: Ints
    """(K,) points"""

    @classmethod
    def of(cls, points: Array, sharp: Ints | None = None) -> "_Drawn":
        """A polyline, whose sharp corners may be known."""
        steps = np.diff(points, axis=0)
        length = norms(steps)
        turn = np.zeros(len(points))
        turn[1:-1] = norms(np.diff(steps / length[:, None], axis=0))
        along = np.concatenate(([0.0], np.cumsum(length)))
        return cls(points, along, turn, np.flatnonzero(turn > SHARP) if sharp is None else sharp)

    def reversed(self) -> "_Drawn":
        """The same from its end."""
        last = len(self.turn) - 1
        along = self.along[-1] - self.along[::-1]
        return _Drawn(self.points[::-1], along, self.turn[::-1], last - self.sharp[::-1])


@dataclass(frozen=True, slots=True)
class Moved:
    """What became of the points of a polyline."""

    spent: Array
    """(M+1,) m, by how much what lies around each was moved"""
    firm: int
    """The first point that further drawing might move, or around which it might"""


def straightened(points: Array, feed: Array, lays: Flags, h: float) -> tuple[Array, Moved]:
    """(M+1, 3) m, (M,) m/s, (M,) whether clay is laid -> points as they are to be driven."""
    like = (np.diff(feed) == 0.0) & (np.diff(lays.astype(np.int8)) == 0)
    spent = np.zeros(len(points))
    drawn = _Drawn.of(points)
    firm = _firm(drawn, h)
    if len(points) < 3 or not len(drawn.sharp):
        return points, Moved(spent, firm)
    drawn = _slanted(drawn, like, h, spent)
    drawn = _gathered(drawn, feed, h, spent)
    whole, first, last = _joining(drawn, h)
    after, ends = _onwards(drawn, whole, h)
    before, begins = (each[::-1] for each in _onwards(drawn.reversed(), whole[::-1], h))
    begins = len(points) - 1 - begins
    both = after & before
    forth, back = both & (ends > drawn.sharp + 1), both & (begins < drawn.sharp - 1)
    first = np.concatenate((first, drawn.sharp[forth], begins[back]))
    last = np.concatenate((last, ends[forth], drawn.sharp[back]))
    return _moved(drawn, first, last, spent), Moved(spent, firm)


def reach(h: float) -> float:
    """m of path drawn before a point on which its place depends, and one segment more."""
    return (3 * FARTHEST + 2 * SLANTED + 2 * SPENT * TOGETHER) * h


def _firm(drawn: _Drawn, h: float) -> int:
    """The first point that further drawing might move, or around which it might.

    A sharp corner might be next: with a straight of its own, joined to the one before it, or one with others.
    """
    along, pair = drawn.along, 2 * SPENT * h
    sharp, end = drawn.sharp, along[-1]
    near = np.diff(along[sharp]) <= SLANTED * h
    for close, onwards in ((near, SLANTED * h), (_close(drawn, h), ALONE * h)):
        if not len(sharp) or along[-1] - along[sharp[-1]] > onwards:
            continue
        apart = np.flatnonzero(~close)
        begun = int(apart[-1]) + 1 if len(apart) else 0
        if len(sharp) - begun <= TOGETHER:
            sharp, end = sharp[:begun], along[sharp[begun]]
            break
    place = end - pair
    if len(sharp) and end - along[sharp[-1]] <= 2 * FARTHEST * h + pair:
        place = along[sharp[-1]]
    first = int(np.searchsorted(along, place - REACH * h - TOUCHING))
    beyond = first > 0 and along[first - 1] >= place - FARTHEST * h - TOUCHING
    return first - 1 if beyond else first


def _slanted(drawn: _Drawn, like: Flags, h: float, spent: Array) -> _Drawn:
    """Steps to the side between two sharp corners, alone but for each other, become gentler ones.

    Their ends are moved apart, along the segments before and after. ``like`` (M-1,) tells whether a segment
    and the next are driven alike.
    """
    first = _steps(drawn, like, h)
    if not len(first):
        return drawn
    points = drawn.points.copy()
    ahead, after = (units(points[k + 1] - points[k]) for k in (first - 1, first + 1))
    most = ROOM * np.minimum(
        drawn.along[first] - drawn.along[first - 1], drawn.along[first + 2] - drawn.along[first + 1]
    )
    before = norms(units(points[first + 1] - points[first]) - ahead)
    left = np.ones(len(first), dtype=np.bool_)
    for part in SLANTS:
        way = part * h
        begin, end = drawn.points[first] - way * ahead, drawn.points[first + 1] + way * after
        slant = units(end - begin)
        step = drawn.points[first], drawn.points[first + 1]
        off = np.maximum(*(_apart(each, begin, end) for each in step))
        gentle = np.maximum(norms(slant - ahead), norms(after - slant)) <= np.minimum(GENTLER * before, ACUTE)
        good = left & gentle & (off <= SPENT * h) & (way <= most)
        points[first[good]], points[first[good] + 1] = begin[good], end[good]
        spent[first[good]] = spent[first[good] + 1] = off[good]
        left &= ~good
    return _Drawn.of(points, drawn.sharp)


def _apart(points: Array, begin: Array, end: Array) -> Array:
    """(N, 3) -> (N,) m: distance from the straights between two points each, to be passed between these."""
    way, along = points - begin, end - begin
    part = np.clip((way * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), TINY), 0.0, 1.0)
    return norms(way - part[:, None] * along)


def _steps(drawn: _Drawn, like: Flags, h: float) -> Ints:
    """First points of steps to the side that may be slanted."""
    sharp, along, points = drawn.sharp, drawn.along, drawn.points
    gap = np.diff(along[sharp], prepend=along[0], append=along[-1])
    pair = np.flatnonzero((gap[1:-1] <= SLANTED * h) & (np.minimum(gap[:-2], gap[2:]) > SLANTED * h))
    pair = pair[(np.diff(sharp)[pair] == 1) & (gap[1:-1][pair] > 2 * SPENT * h)]
    first = sharp[pair]
    first = first[(first > 0) & (first < len(points) - 2)]
    first = first[like[first - 1] & like[first]]
    turns = np.diff(units(np.diff(points, axis=0)), axis=0)
    opposite = np.einsum("nk,nk->n", turns[first - 1], turns[first]) < 0.0
    return np.asarray(first[opposite], dtype=np.intp)


def _gathered(drawn: _Drawn, feed: Array, h: float, spent: Array) -> _Drawn:
    """Sharp corners next to each other, and alone but for each other, become one in their middle.

    The other points lie specks beside it on its straights, on the side whose feed is theirs.
    """
    first, last = _groups(drawn, h)
    points, gone = drawn.points.copy(), []
    for begin, end in zip(first.tolist(), last.tolist(), strict=True):
        group = drawn.points[begin : end + 1]
        middle, off = _middle(group)
        inner = feed[begin:end]
        before = int(np.argmin(np.append(inner == feed[begin - 1], False)))
        if off > SPENT * h or (inner[before:] != feed[end]).any():
            continue
        speck = SPECK * off * (np.arange(len(group)) - before)[:, None]
        onwards = np.where(speck < 0.0, middle - points[begin - 1], points[end + 1] - middle)
        points[begin : end + 1] = middle + speck * units(onwards)
        spent[begin : end + 1] = (1 + SPECK * len(inner)) * off
        gone += [begin + k for k in range(len(group)) if k != before]
    return _Drawn.of(points, np.setdiff1d(drawn.sharp, gone)) if gone else drawn


def _groups(drawn: _Drawn, h: float) -> tuple[Ints, Ints]:
    """First and last point of each group of sharp corners that might become one."""
    sharp, along = drawn.sharp, drawn.along
    heads = np.flatnonzero(np.concatenate(([True], ~_close(drawn, h)))[: len(sharp)])
    tails = np.append(heads[1:], len(sharp)) - 1
    ends = np.concatenate((along[:1], along[sharp], along[-1:]))
    apart = np.minimum(along[sharp[heads]] - ends[heads], ends[tails + 2] - along[sharp[tails]])
    some = (tails > heads) & (tails - heads < TOGETHER) & (apart >= ALONE * h)
    return sharp[heads[some]], sharp[tails[some]]


def _close(drawn: _Drawn, h: float) -> Flags:
    """(K-1,) whether each sharp corner and the next are points in a row, near enough to become one."""
    near = np.diff(drawn.along[drawn.sharp]) <= 2 * SPENT * h
    return np.asarray(near & (np.diff(drawn.sharp) == 1), dtype=np.bool_)


def _middle(group: Array) -> tuple[Array, float]:
    """(N, 3) m -> the middle (3,) m of those two that are furthest apart, and how far from it all are."""
    apart = np.linalg.norm(group[:, None] - group, axis=2)
    one, other = np.unravel_index(int(np.argmax(apart)), apart.shape)
    middle: Array = (group[one] + group[other]) / 2
    return middle, float(norms(group - middle).max())


def _joining(drawn: _Drawn, h: float) -> tuple[Flags, Ints, Ints]:
    """Which gaps between sharp corners (K-1,) become one straight, and the points on both sides of those."""
    first, last = drawn.sharp[:-1], drawn.sharp[1:]
    apart = drawn.along[last] - drawn.along[first]
    whole = (last - first > 1) & (apart >= ALONE * h) & (apart <= 2 * REACH * h)
    whole[whole] = _fits(drawn, first[whole], last[whole], h)
    return whole, first[whole], last[whole]


def _onwards(drawn: _Drawn, whole: Flags, h: float) -> tuple[Flags, Ints]:
    """After each sharp corner (K,): whether a straight is or can be there, and up to which point.

    That is the corner itself where none is made. Up to another sharp corner it may be as short as it is.
    """
    along, sharp = drawn.along, drawn.sharp
    joined = np.append(whole | (np.diff(sharp) == 1), False)
    undone = np.flatnonzero(~joined & (sharp < len(along) - 2))
    first, half = sharp[undone], _halves(drawn)[undone]
    last, found = first.copy(), np.zeros(len(first), dtype=np.bool_)
    reaches = (along[first] + np.minimum(part * REACH * h, half) + TOUCHING for part in TRIES)
    beyond = np.minimum(np.searchsorted(along, along[first] + REACH * h + TOUCHING, "right"), len(along) - 1)
    farthest = along[first] + np.minimum(FARTHEST * h, half) + TOUCHING
    near = np.where(along[beyond] <= farthest, beyond, first)
    for end in (near, *(np.searchsorted(along, most, "right") - 1 for most in reaches)):
        usable = ~found & (end > first + 1) & (end < len(along) - 1)
        usable[usable] = _calm(drawn, first[usable], end[usable], h)
        usable[usable] = _fits(drawn, first[usable], end[usable], h)
        last[usable], found = end[usable], found | usable
    there, ends = joined | (along[sharp + 1] - along[sharp] >= 2 * h), sharp.copy()
    there[undone] |= found
    ends[undone] = last
    return there, ends


def _halves(drawn: _Drawn) -> Array:
    """(K,) m from each sharp corner to the point nearest to the middle between it and the next."""
    along, sharp = drawn.along, drawn.sharp
    middle = (along[sharp[:-1]] + along[sharp[1:]]) / 2
    point = np.searchsorted(along, middle)
    short = middle - along[point - 1] <= along[point] - middle + TOUCHING
    return np.append(along[point - short] - along[sharp[:-1]], np.inf)


def _calm(drawn: _Drawn, first: Ints, last: Ints, h: float) -> Flags:
    """Whether the straight is long enough, and what follows gentle enough, for its corner to stand alone."""
    turned = np.concatenate(([0.0], np.cumsum(drawn.turn)))
    beyond = np.searchsorted(drawn.along, drawn.along[last] + 2 * h, "right")
    gentle = turned[beyond] - turned[first + 1] <= CALM + TOUCHING
    return np.asarray(gentle & (drawn.along[last] - drawn.along[first] >= LEAST * h), dtype=np.bool_)


def _off(drawn: _Drawn, first: Ints, last: Ints) -> tuple[Ints, Array, Ints]:
    """Points after ``first`` up to ``last`` of each row, where they go, and where each row begins."""
    count = last - first
    heads = np.cumsum(count) - count
    row = np.repeat(np.arange(len(first)), count)
    point = first[row] + 1 + np.arange(len(row)) - heads[row]
    start = drawn.points[first]
    unit = units(drawn.points[last] - start)
    onwards = np.einsum("nk,nk->n", drawn.points[point] - start[row], unit[row])
    return point, start[row] + onwards[:, None] * unit[row], heads


def _fits(drawn: _Drawn, first: Ints, last: Ints, h: float) -> Flags:
    """Whether what lies between is near enough to the chord, and runs along it."""
    if not len(first):
        return np.zeros(0, dtype=np.bool_)
    point, target, heads = _off(drawn, first, last)
    off = norms(target - drawn.points[point])
    row = np.repeat(np.arange(len(first)), last - first)
    ahead = units(drawn.points[point] - drawn.points[point - 1])
    unit = units(drawn.points[last] - drawn.points[first])[row]
    along = np.minimum.reduceat(np.einsum("nk,nk->n", ahead, unit), heads) >= ONWARDS
    return np.asarray(along & (np.maximum.reduceat(off, heads) <= SPENT * h), dtype=np.bool_)


def _moved(drawn: _Drawn, first: Ints, last: Ints, spent: Array) -> Array:
    """(M+1, 3) m: what lies between on the chord."""
    if not len(first):
        return drawn.points
    point, target, heads = _off(drawn, first, last)
    moved = drawn.points.copy()
    off = norms(target - drawn.points[point])
    inner = np.ones(len(point), dtype=np.bool_)
    inner[np.append(heads[1:], len(point)) - 1] = False
    moved[point[inner]] = target[inner]
    for side in (first, last):
        np.maximum.at(spent, side, np.maximum.reduceat(off, heads))
    return moved
