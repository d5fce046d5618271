"""The nozzle's path: the drawn polyline, smoothed to a curve with continuous curvature.

The polyline p(s), by its arc length s, is convolved with a triangular kernel of half-width
h: q(s) = integral K(u) p(s - u) du, K(u) = (h - |u|)/h². The result is a cubic spline in s:

* q, q' and q'' are continuous; q''(s) = sum over corners k of (d[k+1] - d[k]) K(s - s[k]),
  with d the unit direction of each segment, so curvature and its change stay bounded;
* |q'| <= 1, since q' is an average of unit vectors: a rate ds/dt never exceeds the nozzle
  speed it stands for;
* |q(s) - p(s)| <= integral K(u)|u| du = h/3, since p is 1-Lipschitz: the nozzle deviates by
  at most h/3 from the drawn path, and passes within h/3 of each of its points.

Chords of a curve are smoothed together because the kernel spans them; a line stays a line.
Towards an exact stop the kernels become narrower, so that none reaches beyond it. While widths
differ by no more than the corners are apart q' stays an average of unit vectors, and by partial
summation q leaves p by no more than a third of the greatest width.

A corner that stands alone gets a kernel of its own, wider the less it turns: no kernel but
its own reaches where its segments' halves do, and there q leaves p by |turn| h/6 at most, so
that h = 2 h0/|turn| makes use of the h0/3 that all are allowed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdhr_host.motion import chords
from cdhr_host.motion.approach import Moved
from cdhr_host.motion.beside import Allowance, Beside, beside
from cdhr_host.motion.chords import Turns
from cdhr_host.motion.corner import Widths, open_rows, roundings, turns
from cdhr_host.motion.rounding import Rounding
from cdhr_host.motion.vectors import norms
from cdhr_host.values import Array, Flags, Ints

LEVEL = 1e-6
"""Of a turn, less does not lead up or down."""
STRAIGHT = 1e-9
"""Direction changes below this (rad) are no corners."""


@dataclass(frozen=True, slots=True)
class SmoothPath:
    """K cubic pieces: q(s) = c[0] + c[1] x + c[2] x²/2 + c[3] x³/6 with x = s - start."""

    start: Array
    """(K,) m, where each piece begins, ascending"""
    end: float
    """m, where the last piece ends"""
    coefficients: Array
    """(4, 3, K) q, q', q'', q''' at the start of each piece"""
    segment: Ints
    """(K,) drawn segment each piece follows"""
    bending: Ints
    """(K,) corners whose kernel reaches into the piece; 0 where the path is straight"""
    gear: Array
    """(2, K) |q'| where the corner begins, and where it ends, that a piece belongs to, if its rounding is a
    shape (``motion.swings``); 0 elsewhere"""
    steep: Array
    """(K,) greatest |q'|"""
    drawn: Array
    """(M+1,) m, s from which each drawn segment goes on straight; for the last point, its end"""
    known: float
    """m, s up to which no further drawing changes the path"""

    def only(self, which: Ints) -> "SmoothPath":
        """With some of the pieces; between them lies nothing that digits can tell."""
        start, bending = self.start[which], self.bending[which]
        pieces = self.coefficients[:, :, which], self.segment[which], bending
        shape = self.gear[:, which], self.steep[which]
        return SmoothPath(start, self.end, *pieces, *shape, self.drawn, self.known)

    def lengths(self) -> Array:
        """(K,) m: length in s of each piece."""
        return np.diff(self.start, append=self.end)

    def bounds(self) -> tuple[Array, Array]:
        """((K,), (K,)): greatest |q''| (1/m) and |q'''| (1/m²) within each piece."""
        _, _, second, third = self.coefficients
        after = second + third * self.lengths()
        largest = np.maximum(norms(second.T), norms(after.T))
        bent = self.bending > 0
        return np.where(bent, largest, 0.0), np.where(bent, norms(third.T), 0.0)

    def along(self) -> tuple[Array, Array]:
        """((K,), (K,)): bounds of |q' q''| (1/m) and |q' q'''| (1/m²) within each piece.

        The greatest of the coefficients in Bernstein's polynomials.
        """
        _, slope, second, third = self.coefficients
        x = self.lengths()
        after = second + third * x
        middle, last = slope + second * x / 2, slope + (second + after) * x / 2
        rises = (
            _dot(slope, second),
            (2 * _dot(middle, second) + _dot(slope, after)) / 3,
            (_dot(last, second) + 2 * _dot(middle, after)) / 3,
            _dot(last, after),
        )
        turns = [_dot(each, third) for each in (slope, middle, last)]
        bent = self.bending > 0
        return np.where(bent, _greatest(rises), 0.0), np.where(bent, _greatest(turns), 0.0)

    def swung(self) -> Array:
        """(N, 3) m: control points of the pieces of corners that may leave the hull of what is drawn."""
        out = self.gear[0] > 0.0
        x, (c0, c1, c2, c3) = self.lengths()[out], self.coefficients[:, :, out]
        hull = (
            c0,
            c0 + c1 * x / 3,
            c0 + 2 * c1 * x / 3 + c2 * x**2 / 6,
            c0 + x * (c1 + x * (c2 / 2 + x * c3 / 6)),
        )
        return np.concatenate([each.T for each in hull])

    def at(self, s: Array) -> tuple[Ints, Array, Array, Array]:
        """(N,) -> piece (N,), q, q', q'' (N, 3) each."""
        piece = np.clip(np.searchsorted(self.start, s, side="right") - 1, 0, len(self.start) - 1)
        x = s - self.start[piece]
        value, slope, bend = np.empty((3, 3, len(s)))
        for k in range(3):
            c0, c1, c2, c3 = (row[piece] for row in self.coefficients[:, k])
            value[k] = c0 + x * (c1 + x * (c2 / 2 + x * (c3 / 6)))
            slope[k] = c1 + x * (c2 + x * (c3 / 2))
            bend[k] = c2 + x * c3
        return piece, value.T, slope.T, bend.T


def smooth(
    points: Array,
    h: float,
    *,
    passed: float = math.inf,
    closes: bool = False,
    allowed: Allowance | None = None,
    moved: Moved | None = None,
) -> SmoothPath:
    """(M+1, 3) m: the smoothed path of a polyline with M segments of positive length.

    It is part of a path that began ``passed`` m before the first point and ends, if it
    ``closes``, at the last; there the result is the drawn path. Otherwise it is exact only from
    the farthest reach of a kernel after the first point to as much before the last. Pieces begin
    where the first kernel does, at s = -h or before. With an allowance, corners that would cost much
    speed take shapes.
    ``moved`` is what was done to the points already (``motion.approach``).
    """
    steps = np.diff(points, axis=0)
    lengths = norms(steps)
    drawn = np.concatenate(([0.0], np.cumsum(lengths)))
    direction = steps / lengths[:, None]
    corner, directions = _corners(direction)
    ends = np.stack((passed + drawn[corner], (drawn[-1] if closes else math.inf) - drawn[corner]))
    turn = norms(directions[1] - directions[0])
    around = beside(drawn, corner, turn, least=h, allowed=allowed)
    spent = np.zeros(len(points)) if moved is None else moved.spent
    swings = (directions[1] - directions[0])[:, 2] <= LEVEL * turn
    borders = drawn[(spent > 0.0) | _changes(allowed, len(points))]
    widths = Widths(h, h - 3.0 * spent[corner], ends, borders, swings)
    single = turns(around, directions, widths)
    rounding = roundings(single, around, (corner, *directions), widths, allowed)
    saved = np.zeros((2, len(points)))
    saved[:, corner] = rounding.saved
    after = drawn + np.cumsum(saved.sum(axis=0))
    middle = after - saved[1]
    last = after[-1]
    begin = float(np.min(middle[corner] - rounding.half[0], initial=-h))
    knots, lasting, kinks = _knots(middle[corner], directions, rounding, np.append(middle[:-1], begin), last)
    segment = np.clip(np.searchsorted(middle, knots, side="right") - 1, 0, len(lengths) - 1)
    onwards = points[segment] + (knots - after[segment])[:, None] * direction[segment]
    begins = points[0] + begin * direction[0], direction[0]
    coefficients = _coefficients(kinks, lasting[:, None], begins, (onwards, direction[segment]))
    here = np.flatnonzero(np.diff(knots, append=last) > 0)
    row = open_rows(around, turn, h)
    known = -math.inf if moved is None else _known(around, row, corner, moved.firm - 1, drawn)
    if allowed is not None and moved is not None:
        known = _firm(single, known, float(drawn[moved.firm - 1]), drawn, h=h, allowed=allowed)
    known = _along(known, drawn, after)
    shape = kinks.gear, kinks.steep
    path = SmoothPath(knots, float(last), coefficients, segment, kinks.bending, *shape, after, known)
    return path if len(here) == len(knots) else path.only(here)


@dataclass(frozen=True, slots=True)
class _Kinks:
    """What changes from piece to piece."""

    third: Array
    """(K, 3) q''' on each piece"""
    slope: Array
    """(K, 3) sum of the jumps of q' up to each piece"""
    bending: Ints
    """(K,) corners whose rounding reaches into the piece"""
    gear: Array
    """(2, K) as in the path"""
    steep: Array
    """(K,) as in the path"""


def _coefficients(
    kinks: _Kinks, lasting: Array, begins: tuple[Array, Array], drawn: tuple[Array, Array]
) -> Array:
    """(4, 3, K) q and its derivatives at the start of each piece, of lengths (K, 1) m.

    ``begins`` (3,) are q and q' at the first, ``drawn`` (K, 3) on each where the path is straight.
    """
    third, straight = kinks.third, kinks.bending == 0
    second = _before(third * lasting)
    second = _anchored(second, np.zeros_like(second), straight)
    slope = begins[1] + kinks.slope + _before(second * lasting + third * lasting**2 / 2)
    slope = _anchored(slope, drawn[1], straight)
    value = begins[0] + _before(slope * lasting + second * lasting**2 / 2 + third * lasting**3 / 6)
    value = _anchored(value, drawn[0], straight)
    return np.stack([np.ascontiguousarray(rows.T) for rows in (value, slope, second, third)])


def _known(around: Beside, row: Ints, corner: Ints, edge: int, drawn: Array) -> float:
    """m of the polyline up to which no further drawing changes what single corners need.

    Up to point ``edge`` the turns stay; ``row`` (K,) is the first corner of the row each is in.
    """
    if edge < 1:
        return -math.inf
    sure = row[: int(np.searchsorted(corner, edge))]
    return around.firm(sure, float(drawn[edge]), around.ways[edge - 1])


def _firm(single: Turns, known: float, edge: float, drawn: Array, *, h: float, allowed: Allowance) -> float:
    """m of the polyline up to which no further drawing changes the path.

    Up to ``known`` m it does not for what single corners need, and up to ``edge`` m the turns stay.
    """
    near = (drawn[1:] > edge - chords.reach(h)) & (drawn[:-1] < edge)
    widest = chords.widest(float(allowed.feed[near].max(initial=0.0)), h, allowed)
    return chords.firm(single, known, edge, widest) if widest else known


def _changes(allowed: Allowance | None, count: int) -> Flags:
    """(M+1,) points at which the feed changes."""
    found = np.zeros(count, dtype=np.bool_)
    if allowed is not None:
        found[1:-1] = np.diff(allowed.feed) != 0.0
    return found


def _along(place: float, drawn: Array, after: Array) -> float:
    """m of the polyline -> m in s."""
    point = int(np.searchsorted(drawn, place, side="right")) - 1
    return float(after[point] + place - drawn[point]) if point >= 0 else -math.inf


def _dot(a: Array, b: Array) -> Array:
    """(3, K), (3, K) -> (K,)."""
    return np.asarray(np.einsum("kn,kn->n", a, b), dtype=np.float64)


def _greatest(rows: Sequence[Array]) -> Array:
    """Greatest size of each column."""
    return np.asarray(np.max(np.abs(rows), axis=0), dtype=np.float64)


def _anchored(sums: Array, drawn: Array, straight: Flags) -> Array:
    """Running sums (K, 3) shifted to what is drawn wherever the path is straight, and on from there.

    So neither rounding nor turns too small to be corners add up along the path: beside a corner taken at a
    hundredth of a mm/s q'' is a million times what it is elsewhere.
    """
    latest = np.maximum.accumulate(np.where(straight, np.arange(len(sums)), -1))
    shift = np.where((latest >= 0)[:, None], (drawn - sums)[latest], 0.0)
    return np.asarray(sums + shift, dtype=np.float64)


def _corners(direction: Array) -> tuple[Ints, tuple[Array, Array]]:
    """Points at which the direction changes, and the directions before and after."""
    around = np.concatenate((direction[:1], direction, direction[-1:]))
    bends = np.flatnonzero(norms(np.diff(around, axis=0)) > STRAIGHT)
    # Each corner takes along the turns before it that were too small to be one.
    before = around[np.concatenate(([0], bends[:-1] + 1))] if len(bends) else around[:0]
    return bends, (before, around[bends + 1])


def _knots(
    middle: Array, turns: tuple[Array, Array], rounding: Rounding, also: Array, last: float
) -> tuple[Array, Array, _Kinks]:
    """Piece starts and lengths (K,), and what is on each.

    Pieces begin where a rounding does, where its q''' changes, at its end, and ``also`` elsewhere.
    """
    at = np.concatenate((*_places(middle, rounding), also))
    order = np.argsort(at, kind="stable")
    at = np.clip(at[order], also[-1], last)
    keep = np.diff(at, append=last) > 0
    one, rest = np.ones(len(middle), np.int64), np.zeros(len(at) - 3 * len(middle), np.int64)
    bending = np.cumsum(np.concatenate((-one, one, 0 * one, rest))[order])
    third = _summed(_steps(turns, rounding, len(also))[order])
    third[bending == 0] = 0.0
    slope, gear, steep = np.zeros_like(third), np.zeros((2, len(at))), np.ones(len(at))
    if rounding.shaped.any():
        number = np.where(rounding.shaped, np.arange(1, len(middle) + 1), 0)
        of = np.cumsum(np.concatenate((-number, number, 0 * number, rest))[order])
        later = np.cumsum(np.concatenate((-number, 0 * number, number, rest))[order])
        within = np.flatnonzero(of)
        gear[:, within] = rounding.gear[:, of[within] - 1]
        steep[within] = rounding.steep[(later[within] > 0).astype(np.int64), of[within] - 1]
        slope = np.cumsum(_jumps(turns, rounding, len(rest))[order], axis=0)
    lengths = np.diff(at[keep], append=last).astype(np.float64)
    kinks = _Kinks(third[keep], slope[keep], bending[keep], gear[:, keep], steep[keep])
    return at[keep].astype(np.float64), lengths, kinks


def _places(middle: Array, rounding: Rounding) -> list[NDArray[np.longdouble]]:
    """m in s of ends, begins and middles of K roundings, and of places within them; (K,) or (E,) each.

    Ends come first: where one begins at the end of another it comes after that.
    """
    inner, spatial, exact = rounding.inner, rounding.spatial, middle.astype(np.longdouble)
    begin, end = exact - rounding.half[0], exact + rounding.half[1]
    later = np.flatnonzero(rounding.follows)
    begin[later] = end[later - 1]
    return [end, begin, exact, exact[inner.corner] + inner.at, exact[spatial.corner] + spatial.at]


def _jumps(turns: tuple[Array, Array], rounding: Rounding, rest: int) -> Array:
    """(E, 3): by how much q' jumps at ends, begins and middles, and at the ``rest``."""
    (before, after), (first, final), follows = turns, rounding.gear, rounding.follows
    begins = np.where(follows, 0.0, first - 1)[:, None]
    ends = np.where(np.append(follows[1:], False), 0.0, 1 - final)[:, None]
    return np.concatenate((ends * after, begins * before, 0 * before, np.zeros((rest, 3))))


def _steps(turns: tuple[Array, Array], rounding: Rounding, also: int) -> Array:
    """(E, 3) 1/m²: how much q''' changes at ends, begins, middles, between them, and ``also`` elsewhere."""
    (before, after), inner = turns, rounding.inner
    begin, middle, end = (old[:, None] * before + new[:, None] * after for old, new in rounding.step)
    old, new = inner.step[:, :, None]
    within = old * before[inner.corner] + new * after[inner.corner]
    return np.concatenate((end, begin, middle, within, rounding.spatial.step, np.zeros((also, 3))))


def _before(increments: Array) -> Array:
    """Running sum of all earlier rows."""
    return np.concatenate((np.zeros((1, increments.shape[1])), _summed(increments)[:-1]))


def _summed(rows: Array) -> Array:
    """Running sum with more digits: in a bend of metres nothing is straight, and rounding adds up."""
    return np.cumsum(rows, axis=0, dtype=np.longdouble).astype(np.float64)
