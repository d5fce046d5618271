"""Shapes of two right angles in a row, between those that the package comes with.

Pieces of constant jerk lead from a first straight over a second to a third, which make right angles with
it. The table (``benchmarks/pair_shapes.py``) holds the fastest for some angles between the first and the
third, some lengths between them and some speeds; one kind keeps the nozzle from going below the first
straight, the other is flat. Its units are those in which acceleration and jerk are 1. What lies between the
table's own is blended.
"""

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import product

import numpy as np

from cdhr_host.values import Array, Flags, Ints

TABLE = files(__package__) / "pair_shapes.npz"
"""comes with the package, as its code does"""
PIECES = 8, 12, 8
"""before the first corner, between both, and after the second"""
ENDS = PIECES[0], PIECES[0] + PIECES[1]
"""of which pieces the corners are"""
FOLLOWS = np.concatenate((np.zeros(PIECES[0]), (np.arange(PIECES[1]) + 0.5) / PIECES[1], np.ones(PIECES[2])))
"""Of a turn of the third straight, by how much each piece turns."""
DIGITS = 9
"""Decimals of an angle that matter."""


@dataclass(frozen=True, slots=True)
class Pairs:
    """K pairs of right angles; rows of triples are the straights before, between and after both corners."""

    direction: Array
    """(3, 3, K) of each straight, by axes"""
    length: Array
    """(K,) m between the corners"""
    room: Array
    """(2, K) m, of the straights before and after"""
    feed: Array
    """(3, K) m/s"""
    limits: Array
    """(2, K) m/s² and m/s³"""
    off: Array
    """(K,) m by which the drawn moves may be left"""
    rises: Flags
    """(K,) whether nothing may be below the first straight;"""
    falls: Flags
    """(K,) or below the third"""

    def only(self, which: Ints | Flags) -> "Pairs":
        """Some of them."""
        return Pairs(*(getattr(self, name)[..., which] for name in self.__slots__))

    def backwards(self) -> "Pairs":
        """The same, driven the other way."""
        room, feed, turned = self.room[::-1], self.feed[::-1], -self.direction[::-1]
        return Pairs(turned, self.length, room, feed, self.limits, self.off, self.falls, self.rises)


@dataclass(frozen=True, slots=True)
class Table:
    """Shapes by angle, length between the corners, and speeds before and after them."""

    angle: Array
    """(A,) rad, of those above a floor; those that are flat have 0 and half a turn"""
    length: Array
    """(L,)"""
    speed: Array
    """(V,)"""
    floor: Array
    """(A, L, V, V, 88) durations before, between and after, reach before, and jerks along the first straight,
    across it and along the second; NaN where there is none"""
    flat: Array
    """(2, L, V, V, 88)"""


@cache
def table() -> Table:
    """The shapes that the package comes with."""
    with TABLE.open("rb") as content, np.load(content) as held:
        return Table(*(held[name].astype(np.float64) for name in Table.__slots__))


def dot(a: Array, b: Array) -> Array:
    """(..., 3, K), (..., 3, K) -> (..., K)"""
    return np.asarray((a * b).sum(axis=-2), dtype=np.float64)


def norm(vectors: Array) -> Array:
    """(..., 3, K) -> (..., K)"""
    return np.asarray(np.sqrt(dot(vectors, vectors)), dtype=np.float64)


def angles(pairs: Pairs) -> Array:
    """(K,) rad between the first straight and the third."""
    return np.asarray(np.arccos(np.clip(dot(pairs.direction[0], pairs.direction[2]), -1.0, 1.0)))


@dataclass(frozen=True, slots=True)
class Shapes:
    """Shapes of K pairs."""

    duration: Array
    """(3, K) s before, between and after both corners"""
    jerk: Array
    """(28, 3, K) m/s³"""
    speed: Array
    """(K,) m/s at the begin"""
    reach: Array
    """(K,) m of the first straight"""

    @property
    def pieces(self) -> Array:
        """(28, K) s"""
        return np.repeat(self.duration / np.array(PIECES)[:, None], PIECES, axis=0)


def blended(pairs: Pairs, unit: Array) -> Shapes:
    """By linear interpolation, for pairs of one kind; ``unit`` (K,) s is the table's unit of time."""
    held, (_, j) = table(), pairs.limits
    rows, turns = (held.floor, held.angle) if pairs.rises[0] else (held.flat, np.array([0.0, np.pi]))
    angle = angles(pairs).round(DIGITS)
    angle = angle if pairs.rises[0] else np.where(angle < np.pi / 2, 0.0, np.pi)
    length, speed = pairs.length / (j * unit**3), pairs.feed[[0, 2]] / (j * unit**2)
    nodes = turns, held.length, held.speed, held.speed
    axes = [_between(*each) for each in zip(nodes, (angle, length, *speed), strict=True)]
    mixed = np.zeros((len(unit), rows.shape[-1]))
    for corner in product((0, 1), repeat=len(axes)):
        sides = list(zip(corner, axes, strict=True))
        weight = np.prod([part if up else 1 - part for up, (_, part) in sides], axis=0)
        at = tuple(below + up for up, (below, _) in sides)
        mixed += weight[:, None] * _swivelled(rows[at], angle - turns[at[0]])
    mixed[(length < held.length[0]) | (length > held.length[-1])] = np.nan
    jerk = mixed[:, 4:].T.reshape(sum(PIECES), 3, -1) * j
    begun = np.clip(speed[0], held.speed[0], held.speed[-1]) * j * unit**2
    return Shapes(mixed[:, :3].T * unit, _turned(jerk, pairs), begun, mixed[:, 3] * j * unit**3)


def _swivelled(rows: Array, angle: Array) -> Array:
    """(K, 88) for a third straight turned by (K,) rad: the pieces on it as far, those between by parts."""
    turn = np.outer(angle, FOLLOWS)
    cosine, sine = np.cos(turn), np.sin(turn)
    along, side, up = np.moveaxis(rows[:, 4:].reshape(len(rows), -1, 3), 2, 0)
    jerk = np.stack((cosine * along - sine * side, sine * along + cosine * side, up), axis=2)
    return np.concatenate((rows[:, :4], jerk.reshape(len(rows), -1)), axis=1)


def _between(nodes: Array, values: Array) -> tuple[Ints, Array]:
    """(N,), (K,) -> (K,) the node below each value, and its part of the way to the next."""
    below = np.clip(np.searchsorted(nodes, values, side="right") - 1, 0, len(nodes) - 2)
    return below, np.clip((values - nodes[below]) / np.diff(nodes)[below], 0.0, 1.0)


def _turned(jerk: Array, pairs: Pairs) -> Array:
    """(28, 3, K) along the first straight, across it and along the second -> by axes."""
    before, up, after = pairs.direction
    along = before - dot(before, up) * up
    along = along / norm(along)
    left = np.cross(up, along, axis=0)
    side = np.where(dot(left, after) < 0.0, -left, left)
    return np.asarray(jerk[:, [0]] * along + jerk[:, [1]] * side + jerk[:, [2]] * up, dtype=np.float64)
