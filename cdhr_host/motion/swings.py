"""Which shape each corner gets, and how it is run through.

At full speed a shape lasts as long as limits, tolerance, feeds and the room beside the corner
ask for. Of all shapes that one is taken with which the nozzle is soonest from the middle of one segment in the
middle of the next: of some of the table's first, then of what lies around and between them. Corners that are
much alike get the same; how fast it is run through each follows from that corner alone.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.shapes import FAR, WORTHS, Measured, Shapes, between, coarse, measured
from cdhr_host.values import Array, Ints

STEPS = (np.array([0.0, -1.0, 1.0, -2.0, 2.0]), np.array([0.0, -0.33, 0.33, -0.67, 0.67]), np.array([0.0, -0.15, 0.15]))
"""Speeds of the table that are tried around the best so far, on each side."""
ALIKE = 0.01, 0.02
"""rad between corners, and parts between rooms beside them, that get the same shape"""
TOGETHER = 128
"""Corners looked at together, so that memory stays small."""
HALVINGS = 12
"""Of an interval of speeds, to compare times."""
TIED = 1e-9
"""Of a time, less is no gain: which of two equal ways is taken must not depend on rounding."""
RADIANS, METRES = 9, 12
"""Decimals of what the choice is made by, for the same reason."""


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
    """(2, K) m/s² and m/s³"""
    width: Array
    """(K,) m, three times the distance by which each may be cut"""

    @property
    def angle(self) -> Array:
        """(K,) rad between the directions."""
        found: Array = 2 * np.arcsin(np.minimum(self.turn / 2, 1.0))
        return found

    def only(self, which: Ints) -> "Corners":
        """Some of them."""
        room, feed, limits = self.room[:, which], self.feed[:, which], self.limits[:, which]
        return Corners(self.turn[which], room, feed, limits, self.width[which])

    def rounded(self) -> "Corners":
        """Without the last digits, in which sums along the path differ with where they begin."""
        turn, room, width = self.turn.round(RADIANS), self.room.round(METRES), self.width.round(METRES)
        return Corners(turn, room, self.feed, self.limits, width)

    def kinds(self) -> tuple["Corners", Ints]:
        """One corner of each kind, and the kind (K,) of each."""
        turn = np.round(self.angle / ALIKE[0])
        room = np.round(np.log(self.room) / ALIKE[1])
        rows = np.vstack((turn, room, self.feed, self.limits, self.width))
        each, kind = np.unique(rows, axis=1, return_inverse=True)
        found = Corners(2 * np.sin(ALIKE[0] * each[0] / 2), np.exp(ALIKE[1] * each[1:3]), *np.split(each[3:7], 2), each[7])
        return found, kind


@dataclass(frozen=True, slots=True)
class Swings:
    """How K corners are run through by shapes; rows of pairs are before and after the middle."""

    duration: Array
    """(6, K) s of each piece; infinite where there is no shape"""
    jerk: Array
    """(2, 6, K) m/s³ along both straights"""
    speed: Array
    """(2, K) m/s at both ends"""
    peak: Array
    """(2, K) m/s, greatest in each half"""
    reach: Array
    """(2, K) m of each segment"""

    def only(self, which: Ints) -> "Swings":
        """Some of them."""
        pairs = (each[:, which] for each in (self.speed, self.peak, self.reach))
        return Swings(self.duration[:, which], self.jerk[:, :, which], *pairs)

    def replaced(self, which: Ints, others: "Swings") -> "Swings":
        """With others in the place of some."""
        rows = []
        for name in self.__slots__:
            row = getattr(self, name).copy()
            row[..., which] = getattr(others, name)
            rows.append(row)
        return Swings(*rows)


def swung(corners: Corners) -> Swings:
    """The soonest way through each of K corners."""
    around = corners.rounded()
    kinds, kind = around.kinds()
    level, worth = (each[:, kind, None] for each in _best(kinds))
    shapes = between(around.angle, level, worth).first
    found, jerk = measured(shapes, around.angle), around.limits[1]
    scale = _scale(found, around)
    lasting = np.where((found.off < FAR)[:, None], shapes.duration * scale[:, None], np.inf)
    return Swings(
        lasting.T,
        np.stack((shapes.before.T, shapes.after.T)) * (jerk / found.jerk),
        jerk * scale**2 * found.speed,
        jerk * scale**2 * found.peak,
        jerk * scale**3 * found.reach,
    )


def _scale(found: Measured, around: Corners) -> Array:
    """(K,) or (K, S) s for each unit of time: the fastest that keeps limits, tolerance, room and feeds."""
    more = (1,) * (found.off.ndim - 1)
    a, j = around.limits.reshape(2, -1, *more)
    feed, room = (each.reshape(2, -1, *more) for each in (around.feed, around.room))
    bounds = (
        np.cbrt(around.width.reshape(-1, *more) / 3 / (j * found.off)),
        a / (j * found.acceleration),
        np.sqrt(feed / (j * found.peak)).min(axis=0),
        np.cbrt(room / (j * found.reach)).min(axis=0),
    )
    return np.minimum.reduce(bounds)


def _soonest(found: Measured, around: Corners) -> Ints:
    """(K,) the first of S shapes that are soonest from the middle of one segment in the middle of the next.

    What is left of the segments is passed at the speeds of the shape's ends.
    """
    scale, jerk = _scale(found, around), around.limits[1][:, None]
    left = around.room[:, :, None] - jerk * scale**3 * found.reach
    time = scale * found.duration + (left / (jerk * scale**2 * found.speed)).sum(axis=0)
    best: Ints = np.argmax(time <= time.min(axis=1, keepdims=True) * (1 + TIED), axis=1)
    return best


def _best(around: Corners) -> tuple[Array, Ints]:
    """(2, K) speeds of the table, and (2, K) worths, on both sides of each of K corners."""
    parts = [around.only(each) for each in np.array_split(np.arange(len(around.turn)), _parts(len(around.turn)))]
    found = [_best_together(part) for part in parts]
    level, worth = (np.concatenate(rows, axis=1) for rows in zip(*found, strict=True))
    return level, worth


def _parts(count: int) -> int:
    return max(-(-count // TOGETHER), 1)


def _best_together(around: Corners) -> tuple[Array, Ints]:
    """The same of few enough corners for the memory."""
    (levels, worths), found = coarse(around.angle)
    best = _soonest(found, around)
    level, worth, row = levels[:, best], worths[:, best], np.arange(len(best))
    other = _pairs(np.arange(WORTHS)).astype(np.intp)
    for step in STEPS:
        tried = level[:, :, None] + _pairs(step), np.broadcast_to(worth[:, :, None], (2, len(row), len(step) ** 2))
        best = _soonest(measured(between(around.angle, *tried), around.angle[:, None]), around)
        level = tried[0][:, row, best]
        flat = np.broadcast_to(level[:, :, None], (2, len(row), other.shape[2]))
        both = np.broadcast_to(other, flat.shape)
        best = _soonest(measured(between(around.angle, flat, both), around.angle[:, None]), around)
        worth = both[:, row, best]
    return level, worth


def _pairs(values: Array) -> Array:
    """(N,) -> (2, 1, N²)"""
    found: Array = np.stack(np.meshgrid(values, values, indexing="ij")).reshape(2, 1, -1)
    return found


def time_around(around: Corners, duration: Array, speed: Array, reach: Array) -> Array:
    """(K,) s: from the middle of one segment to the middle of the next, s'' = 0 in both.

    The corner lasts (K,) s, begins and ends at (2, K) m/s, and takes (2, K) m of the segments.
    """
    limits, left = around.limits[:, None], around.room - reach
    low, high = speed, np.maximum(around.feed, speed)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        fits = (speed + middle) / 2 * _change(middle - speed, limits) <= left
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    change = _change(low - speed, limits)
    cruise = np.maximum(left - (speed + low) / 2 * change, 0.0) / low
    return np.asarray(duration + (change + cruise).sum(axis=0), dtype=np.float64)


def _change(difference: Array, limits: Array) -> Array:
    """m/s, (m/s², m/s³) -> s, for a change of speed with s'' = 0 at both ends."""
    a, j = limits
    peak = np.maximum(np.minimum(a, np.sqrt(j * np.maximum(difference, 0.0))), np.finfo(float).tiny)
    return np.asarray(np.where(difference > 0.0, difference / peak + peak / j, 0.0), dtype=np.float64)
