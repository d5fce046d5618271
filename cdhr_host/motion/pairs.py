"""Two right angles in a row, run through as one: hops of the nozzle, and the ends of lines of infill.

Between two corners near each other the nozzle has not the time to run as on a straight: while it speeds up
and slows down between them it still leaves the first straight, and begins the third. So a pair gets a
shape of its own (``motion.pair_shapes``). It is measured, in control points as those of single corners are,
and slowed down until it keeps every limit. What leaves the tolerance, or needs more room than there is, is
not taken: a table that is not quite the best costs time, never a limit. Pairs that are much alike are tried
once.
"""

from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.motion.pair_shapes import ENDS, PIECES, Pairs, Shapes, angles, blended, closed, dot
from cdhr_host.values import Array, Ints

PARTS = 3
"""of each piece, on which it is looked at between its ends"""
RIGHT = 0.005
"""Cosine up to which an angle is a right one, and sine up to which a pair is flat."""
TOLERANCE = 0.05
"""that the table's shapes make use of, in its units"""
UNITS = (1.01, 1.0, 0.985, 0.96, 0.93, 0.88, 0.8)
"""Units of time that are tried: the longer, the further off the nozzle may be."""
INSIDE = 5e-7
"""m below the first straight, where that is not allowed: the table's rounding"""
ALIKE = 0.01, 0.002, 0.02
"""rad between directions, and parts between lengths and between rooms, of pairs that get the same unit,"""
SPARE = 0.995
"""which is for so much of the tolerance, since they are not quite the same"""
TOGETHER = 64
"""Pairs looked at together, so that memory stays small."""


@dataclass(frozen=True, slots=True)
class Ways:
    """How K pairs are run through."""

    duration: Array
    """(3, K) s before, between and after both corners; infinite where there is no shape"""
    jerk: Array
    """(28, 3, K) m/s³, by axes"""
    speed: Array
    """(2, K) m/s at both ends"""
    peak: Array
    """(3, K) m/s, greatest on each straight"""
    reach: Array
    """(2, K) m of the first straight and the third"""

    @property
    def pieces(self) -> Array:
        """(28, K) s"""
        return np.repeat(self.duration / np.array(PIECES)[:, None], PIECES, axis=0)

    def backwards(self) -> "Ways":
        """The same, driven the other way: jerk changes its sign, and its place."""
        return Ways(
            self.duration[::-1], -self.jerk[::-1], *(e[::-1] for e in (self.speed, self.peak, self.reach))
        )

    def only(self, which: Ints) -> "Ways":
        """Some of them."""
        return Ways(*(getattr(self, name)[..., which] for name in self.__slots__))

    def replaced(self, which: Ints, others: "Ways") -> "Ways":
        """With others in the place of some."""
        rows = []
        for name in self.__slots__:
            row = getattr(self, name).copy()
            row[..., which] = getattr(others, name)
            rows.append(row)
        return Ways(*rows)

    def joined(self, others: list["Ways"]) -> "Ways":
        """These, and others after them."""
        every = (self, *others)
        return Ways(*(np.concatenate([getattr(e, name) for e in every], axis=-1) for name in self.__slots__))

    @classmethod
    def none(cls, count: int) -> "Ways":
        """No shapes for so many pairs."""
        speeds, still = (np.ones((2, count)), np.ones((3, count))), np.zeros((sum(PIECES), 3, count))
        return cls(np.full((3, count), np.inf), still, *speeds, np.zeros((2, count)))


def passed(pairs: Pairs) -> Ways:
    """The soonest way of each pair; infinite durations where the table has none."""
    ways, before = Ways.none(len(pairs.length)), dot(*pairs.direction[:2])
    square = (np.abs(before) <= RIGHT) & (np.abs(dot(*pairs.direction[1:])) <= RIGHT)
    flat = ~pairs.rises & ~pairs.falls & (np.abs(np.sin(angles(pairs))) <= RIGHT)
    upright = np.hypot(*pairs.direction[1, :2]) <= RIGHT
    for kind in (flat, pairs.rises & ~pairs.falls & upright, pairs.falls & ~pairs.rises & upright):
        which = np.flatnonzero(kind & square)
        if len(which):
            ways = ways.replaced(which, _either_way(pairs.only(which)))
    return ways


def _either_way(pairs: Pairs) -> Ways:
    """Of pairs of one kind; those that fall are the others backwards."""
    if pairs.falls[0]:
        return _soonest(pairs.backwards()).backwards()
    return _soonest(pairs)


def _norm(vectors: Array) -> Array:
    """(..., 3, K) -> (..., K)"""
    return np.asarray(np.sqrt(dot(vectors, vectors)), dtype=np.float64)


def _soonest(pairs: Pairs) -> Ways:
    """Of pairs of one kind, that do not fall."""
    kinds, kind = _kinds(pairs)
    unit = np.concatenate([_unit(kinds.only(some)) for some in _batches(len(kinds.length))])
    found = [_way(pairs.only(some), unit[kind[some]]) for some in _batches(len(kind))]
    return found[0].joined(found[1:])


def _batches(count: int) -> list[Ints]:
    return np.split(np.arange(count), range(TOGETHER, count, TOGETHER))


def _way(pairs: Pairs, unit: Array) -> Ways:
    return _measured(closed(blended(pairs, unit), pairs), pairs)


def _kinds(pairs: Pairs) -> tuple[Pairs, Ints]:
    """One pair of each kind, and the kind (K,) of each."""
    angle, length = np.round(angles(pairs) / ALIKE[0]), np.round(np.log(pairs.length) / ALIKE[1])
    off, room = np.round(np.log(pairs.off) / ALIKE[1]), np.round(np.log(pairs.room) / ALIKE[2])
    rows = np.vstack((angle, length, off, room, pairs.feed, pairs.limits))
    _, first, kind = np.unique(rows, axis=1, return_index=True, return_inverse=True)
    one, none, angle = np.ones(len(first)), np.zeros(len(first)), angle[first] * ALIKE[0]
    direction = np.array([[one, none, none], [none, none, one], [np.cos(angle), np.sin(angle), none]])
    length, off = (np.exp(each[first] * ALIKE[1]) for each in (length, off))
    room = np.exp(room[:, first] * ALIKE[2])
    alike = replace(pairs.only(first), direction=direction, length=length, room=room, off=SPARE * off)
    return alike, kind


def _unit(pairs: Pairs) -> Array:
    """(K,) s: the table's unit of time with which each of K pairs is passed soonest."""
    (a, j), count = pairs.limits, len(pairs.length)
    units = np.minimum(a / j, np.cbrt(pairs.off / (TOLERANCE * j)))[:, None] * np.array(UNITS)
    tried, outer = pairs.only(np.repeat(np.arange(count), len(UNITS))), [0, 2]
    ways, feed = _way(tried, units.ravel()), tried.feed[outer]
    left = np.maximum(tried.room - ways.reach, 0.0) + (feed - ways.speed) ** 2 / tried.limits[0] / 2
    time = ways.duration.sum(axis=0) + (left / feed).sum(axis=0)
    best = np.argmin(time.reshape(count, -1), axis=1)
    return np.asarray(units[np.arange(count), best], dtype=np.float64)


def _measured(shapes: Shapes, pairs: Pairs) -> Ways:
    """Slowed down until all limits are kept; without a duration where tolerance, room or floor are not."""
    part = np.repeat(shapes.pieces / PARTS, PARTS, axis=0)
    place, speed, bend = _run(np.repeat(shapes.jerk, PARTS, axis=0), part, shapes, pairs)
    hull, fast = _hull(place, speed, bend, part)
    (a, j), straight = pairs.limits, np.repeat(np.arange(3), np.array(PIECES) * PARTS)
    peak = np.stack([_norm(fast[:, straight == side]).max(axis=(0, 1)) for side in range(3)])
    hard = np.cbrt(_norm(shapes.jerk).max(axis=0) / j), np.sqrt(_norm(bend).max(axis=0) / a)
    slower = np.max((*hard, *(peak / pairs.feed)), axis=0)
    after = pairs.direction[2]
    end = np.stack((shapes.speed, dot(speed[-1], after)))
    reach = np.stack((shapes.reach, dot(place[-1], after) - pairs.length * dot(pairs.direction[1], after)))
    fits = (_off(hull, place, pairs) <= pairs.off) & (end > 0.0).all(axis=0)
    fits &= ((reach > 0.0) & (reach <= pairs.room)).all(axis=0)
    fits &= ~pairs.rises | (dot(hull, pairs.direction[1]).min(axis=(0, 1)) >= -INSIDE)
    duration = np.where(fits, shapes.duration * slower, np.inf)
    return Ways(duration, shapes.jerk / slower**3, end / slower, peak / slower, reach)


def _run(jerk: Array, part: Array, shapes: Shapes, pairs: Pairs) -> tuple[Array, Array, Array]:
    """(N + 1, 3, K) places, speeds and accelerations at the ends of N parts; the first corner is at 0."""
    place, speed, bend = (np.zeros((len(part) + 1, *jerk.shape[1:])) for _ in range(3))
    place[0], speed[0] = -shapes.reach * pairs.direction[0], shapes.speed * pairs.direction[0]
    for k, (j, t) in enumerate(zip(jerk, part, strict=True)):
        bend[k + 1] = bend[k] + t * j
        speed[k + 1] = speed[k] + t * (bend[k] + t * j / 2)
        place[k + 1] = place[k] + t * (speed[k] + t * (bend[k] / 2 + t * j / 6))
    return place, speed, bend


def _hull(place: Array, speed: Array, bend: Array, part: Array) -> tuple[Array, Array]:
    """(4, N, 3, K), (3, N, 3, K): control points of places and speeds on each part (Bernstein's form)."""
    t = part[:, None]
    x, v, a = place[:-1], speed[:-1], bend[:-1]
    return (
        np.stack((x, x + v * t / 3, x + 2 * v * t / 3 + a * t**2 / 6, place[1:])),
        np.stack((v, v + a * t / 2, speed[1:])),
    )


def _off(hull: Array, place: Array, pairs: Pairs) -> Array:
    """(K,) m: greatest distance from the straight each part belongs to, and of corners from their points."""
    before, up, after = pairs.direction
    first, second = (PARTS * each for each in ENDS)
    corner = pairs.length * up
    along = np.minimum(dot(hull[:, :first], before), 0.0)
    way = hull[:, :first] - along[:, :, None] * before
    along = np.clip(dot(hull[:, first:second], up), 0.0, pairs.length)
    over = hull[:, first:second] - along[:, :, None] * up
    away = hull[:, second:] - corner
    away = away - np.maximum(dot(away, after), 0.0)[:, :, None] * after
    points = [_norm(place[first]), _norm(place[second] - corner)]
    points.extend(_norm(each).max(axis=(0, 1)) for each in (way, over, away))
    return np.asarray(np.max(points, axis=0), dtype=np.float64)
