"""How far the rounding of each corner may reach along the straights beside it.

A corner needs little more than the way from its feed to rest. Where a straight is long enough, both its
corners have what they need; else they share it evenly, unless one of them is a gentle turn that has no use
for it. So a corner's room depends on no more of the path than twice that. A straight goes on over points that
are no corners. Where the feed changes on it nearer to a corner than what that can make use of, the corner
keeps to the lower of both feeds, up to the next change.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.values import Array, Flags, Ints

SWING = 1.6
"""Ways from the feed to rest that a corner can make use of: it slows down more gently where it swings out."""
SHARP = 0.25
"""Change of direction from which a corner needs a straight, about 14°."""
APART = 1 - 1e-6
"""Of each share, so that between two corners there is always a straight."""

BOUNDLESS = 1e6
"""m/s, a feed from which any straight is too short"""


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

    def runs(self) -> Ints:
        """(M,) number of the row of segments with one feed and one share that each is in."""
        changes = (np.diff(self.feed) != 0.0) | (np.diff(self.share) != 0.0)
        return np.concatenate(([0], np.cumsum(changes)))


@dataclass(frozen=True, slots=True)
class Paces:
    """What shapes of K corners keep to before and after them."""

    feed: Array
    """(2, K) m/s"""
    share: Array
    """(2, K) of acceleration and jerk"""
    even: Array
    """(2, K) m in which no feed is lower"""

    @classmethod
    def of(cls, drawn: Array, corner: Ints, allowed: Allowance) -> "Paces":
        """Of corners at points (K,) of a polyline."""
        run = allowed.runs()
        heads = np.flatnonzero(np.diff(run, prepend=-1))
        borders = np.concatenate(([-np.inf], drawn[heads[1:]], [np.inf]))
        own = np.stack((run[corner - 1], run[corner]))
        other = np.stack((np.maximum(own[0] - 1, 0), np.minimum(own[1] + 1, len(heads) - 1)))
        feed, share, at = allowed.feed[heads], allowed.share[heads], drawn[corner]

        def even(runs: Ints) -> Array:
            return np.stack((at - borders[runs[0]], borders[runs[1] + 1] - at))

        lower = np.minimum(feed[own], feed[other])
        over = way(lower, allowed.acceleration, allowed.jerk) > even(own)
        return cls(
            np.where(over, lower, feed[own]),
            np.where(over, np.minimum(share[own], share[other]), share[own]),
            np.where(over, even(other), even(own)),
        )

    def within(self, room: Array) -> "Paces":
        """Up to (2, K) m."""
        return Paces(self.feed, self.share, np.minimum(room, self.even))


@dataclass(frozen=True, slots=True)
class Beside:
    """What lies beside K corners of a polyline; rows of pairs are before and after."""

    at: Array
    """(K,) m of the polyline"""
    needed: Array
    """(2, K) m of straight that each can make use of"""
    room: Array
    """(2, K) m that each has"""
    pace: "Paces"
    shared: Flags
    """(2, K) whether the straight is too short for all that both its ends can make use of"""
    held: Flags
    """(2, K) whether it is, and what lies beyond it does not leave the nozzle free to change its speed"""
    ways: Array
    """(M,) m of straight that a corner can make use of on each segment"""
    least: float
    """m that each has at least where the straight is long enough"""

    def firm(self, row: Ints, edge: float, onward: float) -> float:
        """m of the polyline up to which no further drawing changes the path.

        The turns of the first N corners stay as they are, and up to ``edge`` m the path does not turn
        any more; the next corner can make use of ``onward`` m before it. None in a row is known before all
        are; ``row`` (N,) is the first in each one's. A corner that shares a straight with one that is not
        known is not known either, nor is one that might become a pair with it.
        """
        last = len(row) - 1
        if len(row) and edge - self.at[last] < self.needed[1, last] + onward:
            last = int(row[last])
            for _ in range(2):
                last -= int(last > 0 and self.shared[0, last])
            return float(self.at[last] - max(self.least, self.needed[0, last]))
        return edge - max(self.least, onward)


def beside(drawn: Array, corner: Ints, turn: Array, *, least: float, allowed: Allowance | None) -> Beside:
    """Of the corners at points ``corner`` (K,) of a polyline, that turn by (K,).

    ``drawn`` (M+1,) m is how far along each point is.
    """
    at, count = drawn[corner], len(drawn) - 1
    allowed = allowed or Allowance(np.full(count, BOUNDLESS), np.ones(count), 1.0, 1.0)
    ways = np.maximum(allowed.ways(), 2 * least)
    pace = Paces.of(drawn, corner, allowed)
    used = np.maximum(way(pace.feed, allowed.acceleration, allowed.jerk), 2 * least)
    needed = np.minimum(used, np.maximum(pace.even, 2 * least))
    between = np.diff(at, prepend=drawn[0], append=drawn[-1])
    both = np.concatenate((ways[:1], needed[1])), np.concatenate((needed[0], ways[-1:]))
    short = between < both[0] + both[1]
    less = _yielding(both, turn, pace.feed.max(axis=0), 2 * least, allowed)
    room, shared = _rooms(between, less, least), np.stack((short[:-1], short[1:]))
    yielded = np.stack((less[0] < both[0], less[1] < both[1]))
    held = shared & ~np.stack((yielded[0, :-1], yielded[1, 1:]))
    return Beside(at, needed, room, pace.within(room), shared, held, ways, least)


def _yielding(
    needed: tuple[Array, Array], turn: Array, feed: Array, least: float, allowed: Allowance
) -> tuple[Array, Array]:
    """What both ends of each straight need: a gentle turn leaves to a sharp corner what it has no use for."""
    kernel = np.maximum(np.sqrt(turn * feed**3 / allowed.jerk), turn * feed**2 / allowed.acceleration)
    gentle, sharp = (turn < SHARP) & (kernel <= least / 2), turn >= SHARP
    left, right = needed[0].copy(), needed[1].copy()
    before, after = np.flatnonzero(gentle[:-1] & sharp[1:]) + 1, np.flatnonzero(sharp[:-1] & gentle[1:]) + 1
    left[before] = np.minimum(left[before], least)
    right[after] = np.minimum(right[after], least)
    return left, right


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


def way(speed: Array, acceleration: float, jerk: float) -> Array:
    """(K,) m/s -> (K,) m that a corner can make use of at this feed."""
    hard, soft = speed / acceleration + acceleration / jerk, 2 * np.sqrt(speed / jerk)
    rest = speed * np.where(speed * jerk > acceleration**2, hard, soft) / 2
    return np.asarray(SWING * rest, dtype=np.float64)
