"""Rows of nodes to be optimised: where they are, and what holds between them."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.budget import Bends
from cdhr_host.motion.closely import Pieces, met, overlapped
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.smooth_path import SmoothPath
from cdhr_host.motion.steps import Motion, Steps
from cdhr_host.motion.time_law import TimeLaw
from cdhr_host.values import Array, Ints

BETWEEN = 0.006
"""s from node to node at most, about."""
APART = 0.0002
"""s between nodes at least; that far apart all borders of the path's pieces are nodes."""
LOOKS = 1e-3
"""s, spacing of looks at the law that is there, in search of when it is where."""
SLOWEST = 1e-6
"""m/s, of a node between the ends, to begin with."""
MARGIN = 0.997, 0.99
"""of acceleration and jerk that steps may use: their limits hold at their ends only."""
SPEED_MARGIN = 0.9999
"""of the speed."""
STEADY = 0.5
"""|q'|² that s'' and s''' are counted with at least: they would be anything where the path hardly moves."""


@dataclass(frozen=True, slots=True)
class Road:
    """What a law runs along, and what holds there."""

    path: SmoothPath
    bends: Bends
    """of each of the K pieces of the path"""
    speed: Array
    """(K,) m/s, greatest s' wanted there"""
    room: Array
    """(K,) share of the acceleration that the cables leave"""
    limits: MotionLimits


@dataclass(frozen=True, slots=True)
class Stretch:
    """Some pieces of a law."""

    pieces: slice
    """of the law"""
    s: tuple[float, float]
    """m, where they begin and end"""
    rate: tuple[float, float]
    """m/s, s' there; s'' is 0"""
    gained: float
    """s that may be gained there"""


@dataclass(frozen=True, slots=True)
class Row:
    """A row of N steps in place of some pieces of a law."""

    pieces: slice
    """of the law"""
    within: tuple[float, float]
    """m, first and last s"""
    time: float
    """s that the law takes"""
    gained: float
    """s of it that may be gained"""
    steps: Steps
    s: Array
    """(N+1,) m, nodes"""
    b: Array
    """(N+1,) m²/s², s'² of the law at them"""
    a: Array
    """(N+1,) m/s²"""

    def law(self) -> Pieces:
        """Its 2 N pieces."""
        motion = Motion.of(self.steps, self.b, self.a)
        first = np.stack((self.s[:-1], motion.v[0], motion.a[0], motion.j[0]))
        half = Pieces(first, motion.half, np.stack((self.s[:-1], self.s[1:])))
        changed = first[2] + motion.half * first[3]
        middle = first[0] + half.way(motion.half)
        second = np.stack((middle, half.rate(motion.half), changed, motion.j[1]))
        state = np.stack((first, second), axis=-1).reshape(4, -1)
        reached = np.stack((self.s[:-1], middle, middle, self.s[1:])).reshape(2, 2, -1)
        return Pieces(state, motion.half.repeat(2), reached.transpose(1, 2, 0).reshape(2, -1))


def row(law: TimeLaw, stretch: Stretch, road: Road) -> Row:
    """The nodes of a row, and the law as it is at them."""
    pieces, s = stretch.pieces, stretch.s
    end = law.duration if pieces.stop == len(law.t) else float(law.t[pieces.stop])
    t, places = _nodes(law, (float(law.t[pieces.start]), end), s, road.path)
    _, v, a = law.at(t)
    v = np.maximum(v, SLOWEST)
    v[[0, -1]], a[[0, -1]] = stretch.rate, 0.0
    edges = float(law.within[0, pieces.start]), float(law.within[1, pieces.stop - 1])
    return Row(pieces, edges, end - float(t[0]), stretch.gained, _steps(places, road), places, v**2, a)


def _nodes(
    law: TimeLaw, span: tuple[float, float], s: tuple[float, float], path: SmoothPath
) -> tuple[Array, Array]:
    """(N,) s and (N,) m: the path's borders, and instants between those that are far apart."""
    looks = np.linspace(*span, int((span[1] - span[0]) / LOOKS) + 2)
    borders = path.start[(path.start > s[0]) & (path.start < s[1])]
    passed = np.interp(borders, np.maximum.accumulate(law.at(looks)[0]), looks)
    kept = _apart(passed, span)
    passed, borders = passed[kept], borders[kept]
    marks = np.concatenate(([span[0]], passed, [span[1]]))
    gaps = np.diff(marks)
    count = np.ceil(gaps / BETWEEN).astype(np.intp)
    part = np.concatenate([np.arange(1, each) / each for each in count])
    when = np.repeat(marks[:-1], count - 1) + np.repeat(gaps, count - 1) * part
    t, places = np.concatenate((marks, when)), np.concatenate(([s[0]], borders, [s[1]], law.at(when)[0]))
    order = np.argsort(t)
    return t[order], places[order]


def _apart(instants: Array, span: tuple[float, float]) -> list[int]:
    """Which of ascending instants (N,) s are APART from the one before that is, and from both ends."""
    kept, last = [], span[0]
    for k, t in enumerate(instants.tolist()):
        if t - last > APART and span[1] - t > APART:
            kept.append(k)
            last = t
    return kept


def _steps(s: Array, road: Road) -> Steps:
    """Between nodes (N+1,) m."""
    path, limits, count = road.path, road.limits, len(s) - 1
    begin = np.searchsorted(path.start, s[:-1], side="right") - 1
    end = np.maximum(np.searchsorted(path.start, s[1:], side="left") - 1, begin)
    _, slope, bend, third = path.coefficients[:, :, np.stack((begin, end))]
    x = np.stack((s[:-1], s[1:])) - path.start[np.stack((begin, end))]
    q2 = bend + x * third
    q1 = slope + x * (bend + x * third / 2)
    rows = overlapped(path.start, s[:-1], s[1:])
    q3 = path.coefficients[3][:, _sharpest(path, (s[:-1] + s[1:]) / 2, rows)]
    pairs = (q1, q1), (q1, q2), (q2, q2), (q2, q3), (q1, q3), (q3, q3)
    turning = np.stack([(one * other).sum(axis=0) for one, other in pairs])
    turning[0] = np.maximum(turning[0], STEADY)
    lowest = (least(each, rows) for each in (road.speed, road.room))
    speed, acceleration, jerk = (np.tile(each, (2, 1)) for each in (*lowest, np.ones(count)))
    # What is given is not to be bounded.
    acceleration[0, 0] = acceleration[1, -1] = speed[0, 0] = speed[1, -1] = np.inf
    jerk[0, 0] = jerk[1, -1] = 1.0 / MARGIN[1]
    return Steps(
        np.arange(count),
        np.zeros(count, dtype=np.intp),
        np.diff(s),
        turning,
        SPEED_MARGIN * speed,
        MARGIN[0] * limits.acceleration * acceleration,
        MARGIN[1] * limits.jerk * jerk,
    )


def _sharpest(path: SmoothPath, middle: Array, rows: Ints) -> Ints:
    """(2, N) of the path's pieces that N steps meet before and after their middle, those with most |q'''|."""
    which, piece, heads = met(rows)
    sharp = (path.coefficients[3][:, piece] ** 2).sum(axis=0)
    ends = np.append(path.start[1:], path.end)
    on_side = path.start[piece] <= middle[which], ends[piece] >= middle[which]
    order = [np.lexsort((np.where(there, sharp, -1.0), which)) for there in on_side]
    return np.stack([piece[each][np.append(heads[1:], len(which)) - 1] for each in order])


def least(values: Array, rows: Ints) -> Array:
    """Least value over each pair of rows."""
    return np.asarray(np.minimum.reduceat(np.append(values, np.inf), rows)[::2])
