"""How far the rounding of each corner may reach along the straights beside it.

Neighbours share the straight between them: the sharper a corner, the more of it. A
straight goes on over points that are no corners. What is braked ends where the feed changes.
"""

import numpy as np

from cdhr_host.values import Array, Flags, Ints

APART = 1 - 1e-6
"""Of each share, so that between two corners there is always a straight."""
STOP = 1.2
"""Root of the turn that a stop counts as."""
GENTLE = 0.1
"""Root of the least turn that counts."""


def rooms(drawn: Array, corner: Ints, turn: Array, *, least: float, most: Array) -> Array:
    """(2, K) m before and after each corner at points ``corner`` (K,) of a polyline.

    ``drawn`` (M+1,) m is how far along each point is, ``turn`` (K,) the change of direction; none
    needs more than ``most`` (K,) m. Where a straight is long enough, both corners have at least ``least`` m.
    """
    between = np.diff(drawn[corner], prepend=drawn[0], append=drawn[-1])
    weight = np.concatenate(([STOP], np.maximum(np.sqrt(turn), GENTLE), [STOP]))
    kept = np.minimum(least, between / 2)
    after = np.clip(between * weight[:-1] / (weight[:-1] + weight[1:]), kept, between - kept)
    found = np.stack(((between - after)[:-1], after[1:]))
    return np.asarray(APART * np.minimum(found, np.maximum(most, 2 * least)), dtype=np.float64)


def same_feed(drawn: Array, corner: Ints, changes: Flags) -> Array:
    """(2, K) m before and after each corner in which the feed stays; ``changes`` (M+1,) tells where not."""
    at = drawn[corner]
    borders = np.concatenate(([-np.inf], drawn[changes], [np.inf]))
    right, left = np.searchsorted(borders, at, "right"), np.searchsorted(borders, at, "left") - 1
    return np.asarray(np.stack((at - borders[left], borders[right] - at)), dtype=np.float64)


def way(speed: Array, acceleration: float, jerk: float) -> Array:
    """(K,) m/s -> (K,) m from there to rest: no corner needs more."""
    hard, soft = speed / acceleration + acceleration / jerk, 2 * np.sqrt(speed / jerk)
    return np.asarray(speed * np.maximum(hard, soft) / 2, dtype=np.float64)


def norms(vectors: Array) -> Array:
    """(N, 3) -> (N,): lengths of vectors."""
    return np.asarray(np.sqrt(np.einsum("nk,nk->n", vectors, vectors)), dtype=np.float64)
