"""How far the rounding of each corner may reach along the straights beside it.

A corner needs little more than the way from its feed to rest. Where a straight is long enough, both its
corners have what they need; else they share it evenly. So a corner's room depends on no more of the path
than twice that. No shape reaches over a change of the feed. A straight
goes on over points that are no corners.
"""

import math
from dataclasses import dataclass

import numpy as np

from cdhr_host.values import Array, Flags, Ints

SWING = 1.6
"""Ways from the feed to rest that a corner can make use of: it slows down more gently where it swings out."""
APART = 1 - 1e-6
"""Of each share, so that between two corners there is always a straight."""


@dataclass(frozen=True, slots=True)
class Allowance:
    """How fast the corners of a path may be taken."""

    feed: Array
    """(M,) m/s on each segment"""
    share: Array
    """(M,) of acceleration and jerk that may be spent on changing speed there"""
    acceleration: float
    """m/s²"""
    jerk: float
    """m/s³"""

    def ways(self) -> Array:
        """(M,) m that a corner can make use of on each segment."""
        return way(self.feed, self.acceleration, self.jerk)

    def changes(self) -> Flags:
        """(M-1,) whether another feed or share begins at each inner point."""
        return np.asarray((np.diff(self.feed) != 0.0) | (np.diff(self.share) != 0.0), dtype=np.bool_)


@dataclass(frozen=True, slots=True)
class Beside:
    """What lies beside K corners of a polyline; rows of pairs are before and after."""

    at: Array
    """(K,) m of the polyline"""
    needed: Array
    """(2, K) m of straight that each can make use of"""
    room: Array
    """(2, K) m that each has"""
    even: Array
    """(2, K) m of that in which the feed stays"""
    shared: Flags
    """(2, K) whether the straight is too short for all that both its ends can make use of"""
    ways: Array
    """(M,) m of straight that a corner can make use of on each segment"""
    least: float
    """m that each has at least where the straight is long enough"""

    def firm(self, sure: int, edge: float, onward: float) -> float:
        """m of the polyline up to which no further drawing changes the path.

        The turns of the first ``sure`` corners stay as they are, and up to ``edge`` m the path does not turn
        any more; the next corner can make use of ``onward`` m before it. A corner that shares a straight with
        one that is not known is not known either.
        """
        last = sure - 1
        if sure and edge - self.at[last] < self.needed[1, last] + onward:
            last -= int(last > 0 and self.shared[0, last])
            return float(self.at[last] - max(self.least, self.needed[0, last]))
        return edge - max(self.least, onward)


def beside(drawn: Array, corner: Ints, *, least: float, allowed: Allowance | None) -> Beside:
    """Of the corners at points ``corner`` (K,) of a polyline; ``drawn`` (M+1,) m is how far along each is."""
    at, count = drawn[corner], len(drawn) - 1
    ways = np.full(count, math.inf) if allowed is None else np.maximum(allowed.ways(), 2 * least)
    changes = np.zeros(count - 1, dtype=np.bool_) if allowed is None else allowed.changes()
    even = _even(drawn, at, changes)
    needed = np.minimum(np.stack((ways[corner - 1], ways[corner])), np.maximum(even, 2 * least))
    between = np.diff(at, prepend=drawn[0], append=drawn[-1])
    both = np.concatenate((ways[:1], needed[1])), np.concatenate((needed[0], ways[-1:]))
    room, short = _rooms(between, both, least), between < both[0] + both[1]
    shared = np.stack((short[:-1], short[1:]))
    return Beside(at, needed, room, np.minimum(room, even), shared, ways, least)


def _rooms(between: Array, needed: tuple[Array, Array], least: float) -> Array:
    """(2, K) m before and after each corner.

    ``between`` (K+1,) m are the straights around them, ``needed`` what the corner or stop before each of
    these, and the one after it, can make use of.
    """
    (left, right), kept = needed, np.minimum(least, between / 2)
    half = np.maximum(between / 2, np.maximum(between - right, kept))
    part = np.minimum(half, np.minimum(left, between - kept))
    ample = between >= left + right
    after, before = np.where(ample, left, part), np.where(ample, right, between - part)
    return np.asarray(APART * np.stack((before[:-1], after[1:])), dtype=np.float64)


def _even(drawn: Array, at: Array, changes: Flags) -> Array:
    """(2, K) m before and after each corner in which the feed stays."""
    borders = np.concatenate(([-np.inf], drawn[1:-1][changes], [np.inf]))
    right, left = np.searchsorted(borders, at, "right"), np.searchsorted(borders, at, "left") - 1
    return np.asarray(np.stack((at - borders[left], borders[right] - at)), dtype=np.float64)


def way(speed: Array, acceleration: float, jerk: float) -> Array:
    """(K,) m/s -> (K,) m that a corner can make use of at this feed."""
    hard, soft = speed / acceleration + acceleration / jerk, 2 * np.sqrt(speed / jerk)
    rest = speed * np.where(speed * jerk > acceleration**2, hard, soft) / 2
    return np.asarray(SWING * rest, dtype=np.float64)
