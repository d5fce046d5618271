"""A motion along given path as steps between nodes, each of two halves with constant jerk.

At node i the path is run at rate s' = sqrt(b) with change s'' = a. Between two nodes, h apart, s''' is
j0 for a time d and then j1 for as long, which is the only such step that has the nodes' rates and
changes at its ends:

    h  = (v0 + v1) d - (a1 - a0) d²/3
    j0 = (v1 - v0)/d² - (3 a0 + a1)/2d
    j1 = (v0 - v1)/d² + (a0 + 3 a1)/2d

so the laws through N nodes are the points of a space of 2 N dimensions, starts from rest included. In b and a
the steps are nearly linear (b' = 2 a), in s' and s'' they are not. The nozzle's speed, acceleration and jerk
are held to their limits at both ends of every step, the jerk with that of either half. Each is there a square

    |q'' b + q' a|²,   |q''' v³ + 3 q'' v a + q' j|²

of which derivatives need the products of q', q'' and q''' alone.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.values import Array, Flags, Ints

VARIABLES = 4
"""b and a of the node where a step begins, b and a of that where it ends"""
SHARES = 4
"""at each end of a step: of speed, of acceleration, and of the jerk of its first and second half"""


@dataclass(frozen=True, slots=True)
class Steps:
    """N steps, in rows one after the other; between rows nothing is tied."""

    node: Ints
    """(N,) at which each begins; it ends at the next"""
    row: Ints
    """(N,) number of its row, from 0"""
    length: Array
    """(N,) m in s"""
    turning: Array
    """(6, 2, N) products of q' q', q' q'', q'' q'', q'' q''', q' q''', q''' q''' at both ends"""
    speed: Array
    """(2, N) m/s, greatest s' at both ends"""
    acceleration: Array
    """(2, N) m/s², greatest of the nozzle"""
    jerk: Array
    """(2, N) m/s³, greatest of the nozzle"""

    def only(self, rows: Flags) -> "tuple[Steps, Ints, Ints]":
        """Some of R rows; which of the nodes are theirs, and which of the steps."""
        which = np.flatnonzero(rows[self.row])
        nodes = np.unique(np.concatenate((self.node[which], self.node[which] + 1)))
        some = Steps(
            np.searchsorted(nodes, self.node[which]),
            (np.cumsum(rows) - 1)[self.row[which]],
            self.length[which],
            self.turning[..., which],
            self.speed[:, which],
            self.acceleration[:, which],
            self.jerk[:, which],
        )
        return some, nodes, which

    def ends(self, values: Array) -> Array:
        """(M,) at the nodes -> (2, N) at both ends of each step."""
        return np.stack((values[self.node], values[self.node + 1]))


@dataclass(frozen=True, slots=True)
class Motion:
    """What N steps are between given nodes; not a number where there is no such step."""

    b: Array
    """(2, N) m²/s², s'² at both ends"""
    v: Array
    """(2, N) m/s"""
    a: Array
    """(2, N) m/s²"""
    half: Array
    """(N,) s, half of its duration"""
    j: Array
    """(2, N) m/s³, s''' of both halves"""

    @classmethod
    def of(cls, steps: Steps, b: Array, a: Array) -> "Motion":
        """Of nodes with s'² = ``b`` (M,) m²/s² and s'' = ``a`` (M,) m/s²."""
        with np.errstate(invalid="ignore", divide="ignore"):
            both, a = steps.ends(b), steps.ends(a)
            v = np.sqrt(both)
            gained, rate, h = a[1] - a[0], v[0] + v[1], steps.length
            half = 2.0 * h / (rate + np.sqrt(rate**2 - 4.0 / 3.0 * gained * h))
            pull = (v[1] - v[0]) / half**2
            j = np.stack((pull - (1.5 * a[0] + 0.5 * a[1]) / half, (0.5 * a[0] + 1.5 * a[1]) / half - pull))
        return cls(both, v, a, half, j)

    def shares(self, steps: Steps) -> Array:
        """(SHARES, 2, N) squares of what is used of each limit at both ends."""
        b, v, a = self.b, self.v, self.a
        q11, q12, q22, q23, q13, q33 = steps.turning
        found = np.empty((SHARES, *b.shape))
        found[0] = b / steps.speed**2
        found[1] = (q22 * b**2 + 2 * q12 * b * a + q11 * a**2) / steps.acceleration**2
        whole = b * (q33 * b**2 + 9 * q22 * a**2 + 6 * q23 * b * a)
        drawn = 2 * v * (q13 * b + 3 * q12 * a)
        for half, j in enumerate(self.j):
            found[2 + half] = (whole + drawn * j + q11 * j**2) / steps.jerk**2
        return found


@dataclass(frozen=True, slots=True)
class Slopes:
    """Derivatives of N steps by their VARIABLES."""

    half: Array
    """(4, N) of the half's duration"""
    bend: Array
    """(4, 4, N) second ones of that, where a = 0 throughout: never less than nothing"""
    jerk: Array
    """(2, 4, N) of s''' of both halves"""
    share: Array
    """(4, SHARES, 2, N) of the shares"""

    @classmethod
    def of(cls, steps: Steps, motion: Motion) -> "Slopes":
        """Nodes at rest have none by b."""
        v, a, d = motion.v, motion.a, motion.half
        gained, rate, faster = a[1] - a[0], v[0] + v[1], v[1] - v[0]
        with np.errstate(divide="ignore"):
            by_b = np.where(v > 0.0, 0.5 / v, 0.0)
        column = np.stack((by_b[0], np.ones_like(d), by_b[1], np.ones_like(d)))
        lean = rate - 2.0 / 3.0 * gained * d
        half = np.stack((-d, -(d**2) / 3, -d, d**2 / 3)) / lean
        pull = -2 * faster / d**3
        first = (pull + (1.5 * a[0] + 0.5 * a[1]) / d**2) * half
        second = (-pull - (0.5 * a[0] + 1.5 * a[1]) / d**2) * half
        direct = np.stack((-1 / d**2, -1.5 / d, 1 / d**2, -0.5 / d))
        jerk = np.stack((first + direct, second + np.stack((1 / d**2, 0.5 / d, -1 / d**2, 1.5 / d)))) * column
        half *= column
        return cls(half, _bend(steps, rate, by_b), jerk, _share_slopes(steps, motion, jerk))


def _bend(steps: Steps, rate: Array, by_b: Array) -> Array:
    """(4, 4, N) second derivatives of h/(v0 + v1) by b and a of both ends."""
    found = np.zeros((VARIABLES, VARIABLES, len(rate)))
    both = 2 * steps.length / rate**3
    for one in range(2):
        for other in range(2):
            found[2 * one, 2 * other] = both * by_b[one] * by_b[other]
        found[2 * one, 2 * one] += steps.length / rate**2 * 2 * by_b[one] ** 3
    return found


def _share_slopes(steps: Steps, motion: Motion, jerk: Array) -> Array:
    b, v, a = motion.b, motion.v, motion.a
    q11, q12, q22, q23, q13, q33 = steps.turning
    per_v = _over(a, v)
    found = np.zeros((VARIABLES, SHARES, 2, b.shape[1]))
    for half, j in enumerate(motion.j):
        by_j = q13 * b * v + 3 * q12 * v * a + q11 * j
        by_b = 1.5 * (q33 * b**2 + 4 * q23 * a * b + q13 * v * j + 3 * q22 * a**2 + q12 * per_v * j)
        by_a = 3 * (q23 * b**2 + 3 * q22 * b * a + q12 * v * j)
        for end in range(2):
            found[:, 2 + half, end] = by_j[end] * jerk[half]
            found[2 * end, 2 + half, end] += by_b[end]
            found[2 * end + 1, 2 + half, end] += by_a[end]
    for end in range(2):
        found[2 * end, 0, end] = 1.0 / steps.speed[end] ** 2
        found[2 * end, 1, end] = 2 * (q22 * b + q12 * a)[end] / steps.acceleration[end] ** 2
        found[2 * end + 1, 1, end] = 2 * (q12 * b + q11 * a)[end] / steps.acceleration[end] ** 2
    found[:, 2:] *= 2.0 / steps.jerk**2
    return found


def curvature(steps: Steps, motion: Motion, jerk: Array, weight: Array) -> Array:
    """(4, 4, N): second derivatives of the shares times ``weight`` (SHARES, 2, N), squares only.

    With r the vector whose square a share is, these are 2 Σ dr dr: what is left out is r d²r.
    ``jerk`` (2, 4, N) are the slopes of s'''.
    """
    b, v, a = motion.b, motion.v, motion.a
    q11, q12, q22, q23, q13, q33 = steps.turning
    per_v = _over(a, v)
    found = np.zeros((VARIABLES, VARIABLES, b.shape[1]))
    for half in range(2):
        w = 2.0 * weight[2 + half] / steps.jerk**2
        drawn = np.empty((VARIABLES, b.shape[1]))
        drawn[0::2] = w * 1.5 * (q13 * v + q12 * per_v)
        drawn[1::2] = w * 3 * q12 * v
        found += (w * q11).sum(axis=0) * jerk[half][:, None] * jerk[half]
        crossed = drawn[:, None] * jerk[half]
        found += crossed + crossed.transpose(1, 0, 2)
    turned = 2.0 * (weight[2] + weight[3]) / steps.jerk**2
    held = 2.0 * weight[1] / steps.acceleration**2
    bb = turned * 2.25 * (q33 * b + 2 * q23 * a + q22 * per_v**2) + held * q22
    ba = turned * 4.5 * (q23 * b + q22 * a) + held * q12
    aa = turned * 9 * q22 * b + held * q11
    for end in range(2):
        k = 2 * end
        found[k, k] += bb[end]
        found[k, k + 1] += ba[end]
        found[k + 1, k] += ba[end]
        found[k + 1, k + 1] += aa[end]
    return found


def _over(a: Array, v: Array) -> Array:
    """a/v, and nothing at rest."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(v > 0.0, a / v, 0.0)
