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

from cdhr_host.motion.mended import closed, nearer
from cdhr_host.motion.pair_shapes import ENDS, PIECES, Pairs, Shapes, angles, blended, dot, norm
from cdhr_host.values import Array, Ints

PARTS = 3
"""of each piece, on which it is looked at between its ends"""
RIGHT = 0.005
"""Cosine up to which an angle is a right one, and sine up to which a pair is flat."""
TOLERANCE = 0.05
"""that the table's shapes make use of, in its units"""
UNITS = (1.02, 1.01, 1.0, 0.993, 0.985, 0.975, 0.96, 0.93, 0.9, 0.84)
"""Units of time that are tried: the longer, the further off the nozzle may be."""
INSIDE = 5e-7
"""m below the first straight, where that is not allowed: the table's rounding"""
ALIKE = 0.01, 0.002, 0.02
"""rad between directions, and parts between lengths and between rooms, of pairs that get the same unit,"""
SPARE = 0.997
"""which is for so much of the tolerance, since they are not quite the same"""
MENDED = 2
"""times that a shape is taken nearer to what is drawn, to this part of the tolerance"""
TARGET = 0.99
TINY = np.finfo(float).tiny
LESS = 0.99, 0.97, 0.94
"""Of a kind's unit, what is tried for a pair that leaves the tolerance with it."""
TOGETHER = 256
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


def _soonest(pairs: Pairs) -> Ways:
    """Of pairs of one kind, that do not fall."""
    kinds, kind = _kinds(pairs)
    unit = np.concatenate([_unit(kinds.only(some)) for some in _batches(len(kinds.length))])[kind]
    found = [_way(pairs.only(some), unit[some]) for some in _batches(len(kind))]
    ways = found[0].joined(found[1:])
    for part in LESS:  # a pair is not quite of its kind
        missed = np.flatnonzero(~np.isfinite(ways.duration[0]))
        if len(missed):
            ways = ways.replaced(missed, _way(pairs.only(missed), part * unit[missed]))
    return ways


def _batches(count: int) -> list[Ints]:
    return np.split(np.arange(count), range(TOGETHER, count, TOGETHER))


def _way(pairs: Pairs, unit: Array) -> Ways:
    """With the shape that each unit (K,) s of the table gives."""
    shapes = closed(blended(pairs, unit), pairs)
    for _ in range(MENDED):
        shapes = nearer(shapes, pairs, *_farthest(shapes, pairs))
    return _measured(shapes, pairs)


def _farthest(shapes: Shapes, pairs: Pairs) -> tuple[Array, Array]:
    """Times (5, K) s, and by how much (5, 3, K) m the nozzle is too far off then.

    At both corners, and where it is farthest before, between and after them.
    """
    part = np.repeat(shapes.pieces / PARTS, PARTS, axis=0)
    place, _, _ = _run(np.repeat(shapes.jerk, PARTS, axis=0), part, shapes, pairs)
    time = np.concatenate((0 * part[:1], np.cumsum(part, axis=0)))
    first, second = (PARTS * each for each in ENDS)
    cuts = 1, first, first + 1, second, second + 1, len(part)
    _, before, one, between, two, after, _ = np.split(place, cuts)
    before, between, after = _away((before, between, after), pairs)
    away = before, one, between, two - pairs.length * pairs.direction[1], after
    far = [np.argmax(norm(each), axis=0) for each in away]
    at = np.stack([time[cut + k, range(len(k))] for cut, k in zip(cuts, far, strict=False)])
    off = np.stack([each[k, :, range(len(k))].T for each, k in zip(away, far, strict=True)])
    size = norm(off)
    return at, off * (np.maximum(1 - TARGET * pairs.off / np.maximum(size, TINY), 0.0))[:, None]


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
    best = np.argmin(np.where(np.isfinite(time), time, np.inf).reshape(count, -1), axis=1)
    return np.asarray(units[np.arange(count), best], dtype=np.float64)


def _measured(shapes: Shapes, pairs: Pairs) -> Ways:
    """Slowed down until all limits are kept; without a duration where tolerance, room or floor are not."""
    part = np.repeat(shapes.pieces / PARTS, PARTS, axis=0)
    place, speed, bend = _run(np.repeat(shapes.jerk, PARTS, axis=0), part, shapes, pairs)
    hull, fast = _hull(place, speed, bend, part)
    (a, j), straight = pairs.limits, np.repeat(np.arange(3), np.array(PIECES) * PARTS)
    peak = np.stack([norm(fast[:, straight == side]).max(axis=(0, 1)) for side in range(3)])
    hard = np.cbrt(norm(shapes.jerk).max(axis=0) / j), np.sqrt(norm(bend).max(axis=0) / a)
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
    t, before = part[:, None], pairs.direction[0]
    bend = _sums(0.0 * before, t * jerk)
    speed = _sums(shapes.speed * before, t * (bend[:-1] + t * jerk / 2))
    place = _sums(-shapes.reach * before, t * (speed[:-1] + t * (bend[:-1] / 2 + t * jerk / 6)))
    return place, speed, bend


def _sums(begin: Array, steps: Array) -> Array:
    """(3, K), (N, 3, K) -> (N + 1, 3, K)"""
    return np.cumsum(np.concatenate((begin[None], steps)), axis=0)


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
    first, second = (PARTS * each for each in ENDS)
    away = _away((hull[:, :first], hull[:, first:second], hull[:, second:]), pairs)
    points = [norm(place[first]), norm(place[second] - pairs.length * pairs.direction[1])]
    points.extend(norm(each).max(axis=(0, 1)) for each in away)
    return np.asarray(np.max(points, axis=0), dtype=np.float64)


def _away(places: tuple[Array, Array, Array], pairs: Pairs) -> tuple[Array, Array, Array]:
    """Places (..., 3, K) before, between and after both corners -> from what is drawn there to them."""
    (one, between, two), (before, up, after) = places, pairs.direction
    beyond = two - pairs.length * up
    along = np.minimum(dot(one, before), 0.0), np.clip(dot(between, up), 0.0, pairs.length)
    return (
        one - along[0][..., None, :] * before,
        between - along[1][..., None, :] * up,
        beyond - np.maximum(dot(beyond, after), 0.0)[..., None, :] * after,
    )
