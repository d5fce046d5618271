"""Which corners are run through in pairs, and what these are as a path.

Two right angles that share a straight too short for changing speed become one shape (``motion.pairs``) where
that is sooner than one for each, and where neither shares another straight with a corner that may take a
shape. As parts of the path both touch in the middle between them.
"""

from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.motion.pair_shapes import ENDS, Pairs
from cdhr_host.motion.pairs import Ways, passed
from cdhr_host.motion.rounding import Rounding, Spatial
from cdhr_host.motion.swings import TIED, Corners, time_around
from cdhr_host.values import Array, Flags, Ints


@dataclass(frozen=True, slots=True)
class Near:
    """P pairs of neighbours among some corners."""

    first: Ints
    """(P,) the first of each, which the second follows"""
    direction: Array
    """(3, 3, P) before, between and after them, by axes"""
    length: Array
    """(P,) m between them"""

    def only(self, which: Ints) -> "Near":
        """Some of them."""
        return Near(self.first[which], self.direction[..., which], self.length[which])


def candidates(which: Ints, around: Corners, even: Flags) -> Ints:
    """(P,) of corners ``which`` (N,), the first of each pair that has its straight for itself.

    ``even`` (N,) tells whether the feed stays the same up to the next corner.
    """
    near = (np.diff(which) == 1) & around.shared[1, :-1]
    linked = np.concatenate(([False], near, [False]))
    swings = around.swings[:-1] | around.swings[1:]
    return np.flatnonzero(near & even[:-1] & swings & ~linked[:-2] & ~linked[2:])


def taken(around: Corners, near: Near, alone: Array) -> tuple[Near, Ways]:
    """Of pairs of N corners those that are sooner as one, and how.

    ``alone`` (N,) s is what each corner takes by itself, from the middle of one segment to that of the next.
    """
    one, two = around.only(near.first), around.only(near.first + 1)
    outer = replace(
        one,
        room=np.stack((one.room[0], two.room[1])),
        feed=np.stack((one.feed[0], two.feed[1])),
        limits=np.minimum(one.limits, two.limits),
        width=np.minimum(one.width, two.width),
    )
    feed = np.stack((outer.feed[0], np.minimum(one.feed[1], two.feed[0]), outer.feed[1]))
    floor = ~one.swings, ~two.swings
    ways = passed(Pairs(near.direction, near.length, outer.room, feed, outer.limits, outer.width / 3, *floor))
    whole = time_around(outer, ways.duration.sum(axis=0), ways.speed, ways.reach)
    sooner = np.flatnonzero(whole < (alone[near.first] + alone[near.first + 1]) * (1 - TIED))
    return near.only(sooner), ways.only(sooner)


def put(found: Rounding, corner: Ints, length: Array, ways: Ways) -> Rounding:
    """With shapes in the place of corners ``corner`` (P,) and those after them, ``length`` (P,) m away."""
    speed, both = ways.peak.max(axis=0), np.stack((corner, corner + 1))
    before, between, after = ways.duration * speed
    found.half[:, both] = _sides((before, between / 2), (between / 2, after))
    found.saved[:, both] = found.half[:, both] - _sides(
        (ways.reach[0], length / 2), (length / 2, ways.reach[1])
    )
    first, last = ways.speed / speed
    found.gear[:, both] = _sides((first, first), (last, last))
    one, two, three = ways.peak / speed
    found.steep[:, both] = _sides((one, two), (two, three))
    found.step[:, :, both] = 0.0
    found.shaped[both], found.follows[corner + 1] = True, True
    return replace(found, spatial=_kinks(corner, ways, speed))


def _sides(before: tuple[Array, Array], after: tuple[Array, Array]) -> Array:
    """(2, 2, P): before and after the middles, of the first corners and of the second."""
    return np.stack((np.stack(before), np.stack(after)))


def _kinks(corner: Ints, ways: Ways, speed: Array) -> Spatial:
    """Places at which q''' changes, those of the second half by the second corner."""
    step = np.diff(ways.jerk / speed**3, axis=0, prepend=0.0, append=0.0)
    at = np.cumsum(np.concatenate((0.0 * speed[None], ways.pieces * speed)), axis=0)
    later = np.arange(len(at)) > sum(ENDS) / 2
    at = np.where(later[:, None], at - at[ENDS[1]], at - at[ENDS[0]])
    at[0], at[-1] = -ways.duration[0] * speed, ways.duration[2] * speed
    own = corner + later[:, None]
    return Spatial(own.ravel(), at.ravel(), step.swapaxes(1, 2).reshape(-1, 3))
