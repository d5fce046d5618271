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
An exact stop is one more corner, from or to direction zero: there the curve starts or ends
at rest in s itself (q' = q'' = 0), h before the first and h after the last point.

A corner that stands alone gets a kernel of its own, wider the less it turns: no kernel but
its own reaches where its segments' halves do, and there q leaves p by |turn| h/6 at most, so
that h = 2 h0/|turn| makes use of the h0/3 that all are allowed.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.values import Array, Flags, Ints

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


def smooth(points: Array, h: float, *, opens: bool, closes: bool) -> SmoothPath:
    """(M+1, 3) m: the smoothed path of a polyline with M segments of positive length.

    ``opens`` and ``closes`` say whether the polyline starts and ends at rest. Where it does
    not, it is part of a longer one, and the result is exact only from h after the first
    point to h before the last. Pieces begin at s = -h, and end at the last point, or h
    after it where the polyline closes.
    """
    steps = np.diff(points, axis=0)
    lengths = norms(steps)
    drawn = np.concatenate(([0.0], np.cumsum(lengths)))
    direction = steps / lengths[:, None]
    corner, turn = _corners(direction, opens=opens, closes=closes)
    last = drawn[-1] + h if closes else drawn[-1]
    width = _widths(lengths, corner, turn, h)
    knots, third, bending = _knots(drawn[corner], turn, width, np.append(drawn[:-1], -h), last)
    widths = np.diff(knots, append=last)[:, None]
    segment = np.clip(np.searchsorted(drawn, knots, side="right") - 1, 0, len(lengths) - 1)
    straight = bending == 0
    second = _before(third * widths)
    second[straight] = 0.0
    initial = np.zeros(3) if opens else direction[0]
    slope = initial + _before(second * widths + third * widths**2 / 2)
    slope = _anchored(slope, direction[segment], straight)
    increments = slope * widths + second * widths**2 / 2 + third * widths**3 / 6
    value = points[0] - h * initial + _before(increments)
    value = _anchored(
        value, points[segment] + (knots - drawn[segment])[:, None] * direction[segment], straight
    )
    coefficients = np.stack([np.ascontiguousarray(rows.T) for rows in (value, slope, second, third)])
    return SmoothPath(knots, float(last), coefficients, segment, bending)


def _anchored(sums: Array, drawn: Array, straight: Flags) -> Array:
    """Running sums (K, 3) shifted to what is drawn wherever the path is straight, and on from there.

    So neither rounding nor turns too small to be corners add up along the path.
    """
    latest = np.maximum.accumulate(np.where(straight, np.arange(len(sums)), -1))
    shift = np.where((latest >= 0)[:, None], (drawn - sums)[latest], 0.0)
    return np.asarray(sums + shift, dtype=np.float64)


def _corners(direction: Array, *, opens: bool, closes: bool) -> tuple[Ints, Array]:
    """Points at which the direction changes, and by which vector."""
    rest = np.zeros((1, 3))
    around = np.concatenate((rest if opens else direction[:1], direction, rest if closes else direction[-1:]))
    bends = np.flatnonzero(norms(np.diff(around, axis=0)) > STRAIGHT)
    # Each corner takes along the turns before it that were too small to be one.
    before = around[np.concatenate(([0], bends[:-1] + 1))] if len(bends) else around[:0]
    return bends, around[bends + 1] - before


def reaches(lengths: Array, h: float) -> Array:
    """(M,) m -> (M+1,) m: how far the kernel of a corner at each point may reach along the path."""
    half = np.concatenate(([0.0], lengths, [0.0])) / 2
    return np.maximum(np.minimum(half[:-1], half[1:]), h)


def _widths(lengths: Array, corner: Ints, turn: Array, h: float) -> Array:
    """(K,) m: half-width of each corner's kernel."""
    return np.maximum(np.minimum(reaches(lengths, h)[corner], 2 * h / norms(turn)), h)


def _knots(corner: Array, turn: Array, width: Array, also: Array, last: float) -> tuple[Array, Array, Ints]:
    """Piece starts (K,), q''' on each (K, 3), and how many kernels reach into it (K,).

    Pieces begin where a kernel does, at its middle and end, and ``also`` elsewhere.
    """
    at = np.concatenate((corner - width, corner, corner + width, also))
    jump = np.zeros((len(at), 3))
    count = np.zeros(len(at), dtype=np.int64)
    n, steep = len(corner), turn / width[:, None] ** 2
    jump[:n], jump[n : 2 * n], jump[2 * n : 3 * n] = steep, -2 * steep, steep
    count[:n], count[2 * n : 3 * n] = 1, -1
    order = np.argsort(at, kind="stable")
    at = np.clip(at[order], also[-1], last)
    third, active = np.cumsum(jump[order], axis=0), np.cumsum(count[order])
    keep = np.diff(at, append=last) > 0
    third[active == 0] = 0.0
    return at[keep], third[keep], active[keep]


def _before(increments: Array) -> Array:
    """Running sum of all earlier rows."""
    return np.concatenate((np.zeros((1, increments.shape[1])), np.cumsum(increments, axis=0)[:-1]))


def norms(vectors: Array) -> Array:
    """(N, 3) -> (N,): lengths of vectors."""
    lengths: Array = np.sqrt(np.einsum("nk,nk->n", vectors, vectors))
    return lengths
