"""Which shape each corner gets, and how it is run through.

At full speed a shape lasts as long as limits, tolerance, feeds and the room beside the corner
ask for. Of all shapes that one is taken with which the nozzle is soonest from the middle of one segment in
the middle of the next: of some of the table's first, then of what lies around and between them. Corners
that are much alike get the same; how fast it is run through each follows from that corner alone.
"""

from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.motion.shapes import FAR, WORTHS, Measured, between, held, measured, states, table
from cdhr_host.values import Array, Flags, Ints

STEPS = (
    np.array([0.0, -1.0, 1.0]),
    np.array([0.0, -0.33, 0.33, -0.67, 0.67]),
    np.array([0.0, -0.15, 0.15]),
    np.array([0.0, -0.07, 0.07]),
)
"""Speeds of the table that are tried around the best so far, on each side."""
ALIKE = 0.01, 0.02
"""rad between corners, and parts between rooms beside them, that get the same shape"""
TOGETHER = 128
"""Corners looked at together, so that memory stays small."""
MOST_KNOWN = 10_000
"""Kinds of corners that are kept, for what is planned again."""
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
    met: Array
    """(2, K) m/s, greatest at both ends"""
    limits: Array
    """(2, K) m/s² and m/s³"""
    width: Array
    """(K,) m, three times the distance by which each may be left"""
    swings: Flags
    """(K,) whether the nozzle may swing out"""
    shared: Flags
    """(2, K) whether the straight is too short for all that the corners at both its ends can make use of"""

    @property
    def angle(self) -> Array:
        """(K,) rad between the directions."""
        found: Array = 2 * np.arcsin(np.minimum(self.turn / 2, 1.0))
        return found

    @property
    def even(self) -> Flags:
        """(K,) whether it is the same before as after, where neighbours may be alike."""
        same = [each[0] == each[1] for each in (self.room, self.feed, self.met)]
        return np.asarray(np.all(same, axis=0) & self.shared.all(axis=0), dtype=np.bool_)

    def only(self, which: Ints) -> "Corners":
        """Some of them."""
        return Corners(*(getattr(self, name)[..., which] for name in self.__slots__))

    def rounded(self) -> "Corners":
        """Without the last digits, in which sums along the path differ with where they begin."""
        turn, room, width = self.turn.round(RADIANS), self.room.round(METRES), self.width.round(METRES)
        return replace(self, turn=turn, room=room, width=width)

    def kinds(self) -> tuple["Corners", Ints]:
        """One corner of each kind, and the kind (K,) of each."""
        turn, room = np.round(self.angle / ALIKE[0]), np.round(np.log(self.room) / ALIKE[1])
        alike = replace(self, turn=2 * np.sin(ALIKE[0] * turn / 2), room=np.exp(ALIKE[1] * room))
        _, first, kind = np.unique(alike.rows(), axis=1, return_index=True, return_inverse=True)
        return alike.only(first), kind

    def rows(self) -> Array:
        """(14, K) all that is known of each."""
        pairs = self.room, self.feed, self.met, self.limits, self.shared
        return np.vstack((self.turn, *pairs, self.width, self.swings))


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


UNKNOWN = [np.nan] * 4
"""instead of two speeds of the table and two worths"""
_KNOWN: dict[bytes, list[float]] = {}
"""Kinds of corners, and their speeds of the table and worths"""


def swung(corners: Corners) -> Swings:
    """The soonest way through each of K corners."""
    around = corners.rounded()
    kinds, kind = around.kinds()
    level, worth = _best(kinds)
    shapes = between(around.angle, around.swings, level[:, kind, None], worth[:, kind, None]).first
    found, jerk = measured(shapes, around.angle, around.swings), around.limits[1]
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
    feed, met, room = (each.reshape(2, -1, *more) for each in (around.feed, around.met, around.room))
    bounds = (
        np.cbrt(around.width.reshape(-1, *more) / 3 / (j * found.off)),
        a / (j * found.acceleration),
        np.sqrt(feed / (j * found.peak)).min(axis=0),
        np.sqrt(met / (j * found.speed)).min(axis=0),
        np.cbrt(room / (j * found.reach)).min(axis=0),
    )
    scale: Array = np.minimum.reduce(bounds)
    return scale


def _soonest(found: Measured, around: Corners, lopsided: Flags) -> Ints:
    """(K,) the first of S shapes that are soonest from the middle of one segment in the middle of the next.

    What is left of the segments is passed at the speeds of the shape's ends; where there is room for it,
    the nozzle gains the feed there. What begins otherwise than it ends, ``lopsided`` (1 or K, S), does not go
    together with neighbours that are alike.
    """
    scale, jerk = _scale(found, around), around.limits[1][:, None]
    left = around.room[:, :, None] - jerk * scale**3 * found.reach
    speed, feed = jerk * scale**2 * found.speed, around.feed[:, :, None]
    change = _change(feed - speed, around.limits[:, None, :, None])
    cruise = left - (speed + feed) / 2 * change
    gains = (cruise > 0.0) & ~around.shared[:, :, None]
    time = scale * found.duration + np.where(gains, change + cruise / feed, left / speed).sum(axis=0)
    time = np.where(around.even[:, None] & lopsided, np.inf, time)
    best: Ints = np.argmax(time <= time.min(axis=1, keepdims=True) * (1 + TIED), axis=1)
    return best


def _lopsided(level: Array, worth: Ints) -> Flags:
    """(2, ..., S) speeds of the table and worths -> (..., S)"""
    return np.asarray((level[0] != level[1]) | (worth[0] != worth[1]), dtype=np.bool_)


def _best(around: Corners) -> tuple[Array, Ints]:
    """(2, K) speeds of the table, and (2, K) worths, on both sides of each of K corners."""
    keys = [row.tobytes() for row in np.ascontiguousarray(around.rows().T)]
    # Looked up once: another thread that plans may forget them meanwhile.
    found = np.array([_KNOWN.get(key, UNKNOWN) for key in keys]).reshape(-1, 4)
    new = np.flatnonzero(np.isnan(found[:, 0]))
    for first in range(0, len(new), TOGETHER):
        some = new[first : first + TOGETHER]
        found[some] = np.vstack(_searched(around.only(some))).T
    if len(_KNOWN) > MOST_KNOWN:
        _KNOWN.clear()
    _KNOWN.update((keys[k], found[k].tolist()) for k in new.tolist())
    level, worth = found.reshape(-1, 2, 2).transpose(1, 2, 0)
    return level, worth.astype(np.intp)


def _searched(around: Corners) -> tuple[Array, Ints]:
    """The same of few enough corners for the memory."""
    (level, worth), best = states(), np.empty(len(around.turn), dtype=np.intp)
    lopsided = _lopsided(level, worth)
    nearest = np.abs(around.angle[:, None] - table().angle).argmin(axis=1)
    for angle, swings in set(zip(nearest.tolist(), around.swings.tolist(), strict=True)):
        some = np.flatnonzero((nearest == angle) & (around.swings == swings))
        best[some] = _soonest(held(angle, swings), around.only(some), lopsided)
    level, worth = level[:, best], worth[:, best]
    worths = _pairs(np.arange(WORTHS, dtype=np.float64)).astype(np.intp)
    for step in STEPS:
        level, worth = _chosen(around, level[:, :, None] + _pairs(step), worth[:, :, None])
        level, worth = _chosen(around, level[:, :, None], worths)
    return level, worth


def _chosen(around: Corners, level: Array, worth: Ints) -> tuple[Array, Ints]:
    """(2, K) of S speeds and worths (2, K, S) the best."""
    shape = np.broadcast_shapes(level.shape, worth.shape)
    level, worth = np.broadcast_to(level, shape), np.broadcast_to(worth, shape)
    shapes = between(around.angle, around.swings, level, worth)
    found = measured(shapes, around.angle[:, None], around.swings[:, None])
    best = _soonest(found, around, _lopsided(level, worth))
    row = np.arange(len(best))
    return level[:, row, best], worth[:, row, best]


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
