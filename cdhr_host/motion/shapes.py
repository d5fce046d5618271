"""Shapes of corners: ways from one straight to another in six pieces of constant jerk.

Three pieces lead to the corner's middle, three away from it. On each the jerk is b d0 + a d1, with d0 and
d1 the directions before and after the corner. The motion along d0 ends at the corner, where that along d1
begins from rest. So with the sums of b t and of a t zero, which ``Shapes.of`` sees to, the acceleration is
zero at both ends, and speeds and ways along both straights follow. Such a motion slows down and speeds up on
its way, and swings out by the tolerance before it cuts the corner. Where that would lead below what is
drawn, another kind stays on the inside: along the other straight it never moves backwards.

The table, made by ``benchmarks/corner_shapes.py``, holds the fastest for some angles and some speeds on
both straights, each where a way along them is worth much and where it is worth little. Units are those in
which the greatest jerk is 1. How near a shape keeps to the drawn corner is measured here for the very
angle it is used at, so a table that is not quite the best costs time, never a limit.
"""

import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import product

import numpy as np

from cdhr_host.values import Array, Flags, Ints

TABLE = files(__package__) / "corner_shapes.npz"
"""comes with the package, as its code does"""
PIECES = 6
PARTS = 4
"""of each piece, on which it is looked at between its ends"""
INSIDE = 1e-9
"""beyond the corner along one of its straights, where that is not allowed: rounding"""
FAR = 1e6
"""instead of a distance, for what does not lead from one straight to the other"""
WORTHS = 2
"""what a way is worth, for each speed of the table"""


@dataclass(frozen=True, slots=True)
class Shapes:
    """Shapes (..., 6): durations, and jerks along d0 and d1, of each piece."""

    duration: Array
    before: Array
    after: Array

    @classmethod
    def of(cls, rows: Array) -> "Shapes":
        """Of rows (..., 18) of durations and jerks, without acceleration at both ends."""
        duration, *jerks = np.split(rows.copy(), 3, axis=-1)
        # Corrected along the straight that is left or reached, so that the way into the other stays as it is.
        for jerk, own in zip(jerks, (slice(0, PIECES // 2), slice(PIECES // 2, PIECES)), strict=True):
            lasting = duration[..., own].sum(axis=-1, keepdims=True)
            jerk[..., own] -= (jerk * duration).sum(axis=-1, keepdims=True) / lasting
        return cls(duration, *jerks)

    @property
    def first(self) -> "Shapes":
        """Of (K, S, 6) the first of each row."""
        return Shapes(self.duration[:, 0], self.before[:, 0], self.after[:, 0])


@dataclass(frozen=True, slots=True)
class Measured:
    """Of shapes (...) at corners of known angles, in units of a jerk of 1 and of their own time."""

    jerk: Array
    """greatest, of the shape as it is; all others are for one by so much less"""
    duration: Array
    speed: Array
    """(2, ...) at both ends"""
    peak: Array
    """(2, ...) greatest before the middle and after it"""
    reach: Array
    """(2, ...) way along both straights"""
    acceleration: Array
    """greatest"""
    off: Array
    """greatest distance from the drawn corner; FAR for what leads nowhere, or out where it must not"""


def measured(shapes: Shapes, turn: Array, swings: Flags) -> Measured:
    """Shapes (..., 6) at corners of ``turn`` rad, and whether they may swing out; both go with (...)."""
    cosine, sine = np.cos(turn), np.sin(turn)
    before, after = (np.moveaxis(each, -1, 0) for each in (shapes.before, shapes.after))
    jerk = _length(before, after, cosine).max(axis=0)
    first = _integrated(before / jerk, np.moveaxis(shapes.duration, -1, 0))
    last = _integrated(after / jerk, np.moveaxis(shapes.duration, -1, 0))
    total = shapes.duration.sum(axis=-1)
    speed = np.stack((-first[1, -1], last[1, -1]))
    way = first[0, -1] + speed[0] * total
    begun = np.concatenate((np.zeros((1, *total.shape)), np.cumsum(_parts(shapes.duration), axis=0)))
    first[0] += speed[0] * begun - way
    first[1] += speed[0]
    hull = (_hull(first, _parts(shapes.duration)), _hull(last, _parts(shapes.duration)))
    speeds = (_rise(first, _parts(shapes.duration)), _rise(last, _parts(shapes.duration)))
    half = PARTS * PIECES // 2
    fast, reach = _length(*speeds, cosine), np.stack((way, last[0, -1]))
    onwards = (speed > 0.0).all(axis=0) & (reach > 0.0).all(axis=0)
    onwards &= swings | (np.maximum(hull[0].max(axis=(0, 1)), -hull[1].min(axis=(0, 1))) <= INSIDE)
    return Measured(
        jerk,
        total,
        np.where(onwards, speed, 1.0),
        np.stack((fast[:, :half].max(axis=(0, 1)), fast[:, half:].max(axis=(0, 1)))),
        np.where(onwards, reach, 1.0),
        _length(first[2], last[2], cosine).max(axis=0),
        np.where(onwards, _off(hull, cosine, sine), FAR),
    )


def _off(hull: tuple[Array, Array], cosine: Array, sine: Array) -> Array:
    """Distance of points (4, N, ...) from the straight before (first half of N) and after the corner."""
    half = PARTS * PIECES // 2
    own = np.concatenate((hull[0][:, :half], -hull[1][:, half:]), axis=1)
    other = np.concatenate((hull[1][:, :half], -hull[0][:, half:]), axis=1)
    beyond = np.maximum(own + other * cosine, 0.0)
    middle = _length(hull[0][0, half], hull[1][0, half], cosine)
    return np.asarray(np.maximum(np.hypot(other * sine, beyond).max(axis=(0, 1)), middle), dtype=np.float64)


def _length(before: Array, after: Array, cosine: Array) -> Array:
    """Of vectors with these parts along d0 and d1."""
    square = before**2 + after**2 + 2 * before * after * cosine
    return np.asarray(np.sqrt(np.maximum(square, 0.0)), dtype=np.float64)


def _parts(duration: Array) -> Array:
    """(..., 6) -> (6 PARTS, ...)"""
    return np.repeat(np.moveaxis(duration, -1, 0) / PARTS, PARTS, axis=0)


def _integrated(jerk: Array, duration: Array) -> Array:
    """(6, ...) -> (3, 6 PARTS + 1, ...): place, speed, acceleration at the ends of parts, from rest at 0."""
    state = np.zeros((3, PARTS * PIECES + 1, *jerk.shape[1:]))
    parts = (np.repeat(each, PARTS, axis=0) for each in (jerk, duration / PARTS))
    for k, (j, t) in enumerate(zip(*parts, strict=True)):
        x, v, a = state[:, k]
        state[0, k + 1] = x + t * (v + t * (a / 2 + t * j / 6))
        state[1, k + 1] = v + t * (a + t * j / 2)
        state[2, k + 1] = a + t * j
    return state


def _hull(state: Array, part: Array) -> Array:
    """(4, 6 PARTS, ...): control points of the cubic that each part is (Bernstein's form)."""
    x, v, a = state[:, :-1]
    return np.stack((x, x + v * part / 3, x + 2 * v * part / 3 + a * part**2 / 6, state[0, 1:]))


def _rise(state: Array, part: Array) -> Array:
    """(3, 6 PARTS, ...): the same of the speed."""
    _, v, a = state[:, :-1]
    return np.stack((v, v + a * part / 2, state[1, 1:]))


@dataclass(frozen=True, slots=True)
class Table:
    """N angles, and for each the shapes of V speeds and W worths before and as many after."""

    angle: Array
    """(N,) rad"""
    rows: Array
    """(2, N, V W, V W, 18) durations and jerks of those that stay inside, and of those that swing out"""

    @property
    def speeds(self) -> int:
        """V"""
        return int(self.rows.shape[2]) // WORTHS


@cache
def table() -> Table:
    """The shapes that the package comes with."""
    with TABLE.open("rb") as content, np.load(content) as held:
        angle, half = held["angle"], held["rows"].astype(np.float64)
    states, kinds = math.isqrt(2 * half.shape[2]), half.shape[:2]
    rows = np.empty((*kinds, states, states, 3 * PIECES))
    first, last = np.triu_indices(states)
    # Driven backwards, the jerk and both directions change their signs, and the straights their places.
    backwards = half.reshape(*kinds, -1, 3, PIECES)[..., [0, 2, 1], ::-1]
    rows[:, :, last, first] = backwards.reshape(half.shape)
    rows[:, :, first, last] = half
    # What stays inside does so from its first piece to its last, which rounding must not turn around.
    for piece in (2 * PIECES - 1, 2 * PIECES):
        np.maximum(rows[0, ..., piece], 0.0, out=rows[0, ..., piece])
    return Table(angle, rows)


def states() -> tuple[Array, Ints]:
    """Speeds of the table and worths (2, S) on both sides of all its shapes of one angle and kind."""
    pair: Ints = np.indices((WORTHS * table().speeds,) * 2, dtype=np.intp).reshape(2, -1)
    return (pair // WORTHS).astype(np.float64), pair % WORTHS


@cache
def held(angle: int, swings: bool) -> Measured:
    """The shapes (1, S) of one of the table's angles and kinds, in the order of ``states``."""
    rows = table().rows[int(swings), angle].reshape(1, -1, 3 * PIECES)
    return measured(Shapes.of(rows), table().angle[[angle], None], np.full((1, 1), swings))


def between(angle: Array, swings: Flags, level: Array, worth: Ints) -> Shapes:
    """Shapes (K, S, 6) between the table's own, at corners of (K,) rad that may swing out or not.

    By (2, K, S) speeds of the table, and worths, on both sides.
    """
    held, out = table(), swings.astype(np.intp)[:, None]
    level = np.clip(level, 0.0, held.speeds - 1)
    below = np.minimum(level.astype(np.intp), held.speeds - 2)
    turned = np.clip(np.searchsorted(held.angle, angle) - 1, 0, len(held.angle) - 2)
    part = np.clip((angle - held.angle[turned]) / np.diff(held.angle)[turned], 0.0, 1.0)
    mixed: Array = np.zeros((*level.shape[1:], 3 * PIECES))
    weights = [(1 - each, each) for each in (part[:, None] + 0 * level[0], *(level - below))]
    for i, j, k in product((0, 1), repeat=3):
        weight = weights[0][i] * weights[1][j] * weights[2][k]
        before, after = WORTHS * (below[0] + j) + worth[0], WORTHS * (below[1] + k) + worth[1]
        mixed += weight[..., None] * held.rows[out, (turned + i)[:, None], before, after]
    return Shapes.of(mixed)
