"""The fastest motion through rows of steps: an interior-point method.

The sum of all durations is least while every share, with a slack s > 0 each, is 1. Slacks are kept from 0 by
-μ Σ ln s; μ falls towards nothing. Each round solves Newton's equations of that for nodes, slacks and
multipliers together (Nocedal and Wright, Numerical Optimization, 2nd ed., chapter 19), with second
derivatives that are never less than nothing, so they always have an answer; unknowns of one node meet those
of its neighbours only, so they are a band. Rows are solved at once, but each takes steps of its own.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, solveh_banded

from cdhr_host.motion.steps import VARIABLES, Motion, Slopes, Steps, curvature
from cdhr_host.values import Array, Flags, Ints

ROUNDS = 45
"""a row that takes more is given up,"""
STUCK = 1e-3
"""and one that takes no more than this of each of Newton's steps,"""
PATIENCE = 6
"""that many times in turn"""
GAP = 2e-3
"""part of a row's time by which it may be slower than the fastest"""
NEAR = 1e-4
"""of a limit's square, by which it may be exceeded"""
BEGIN = 0.05
"""part of a row's time that the barrier weighs at first"""
LEAST_SLACK = 0.05
"""at first"""
HELD = 0.95
"""of the way to where a slack or a multiplier would be nothing"""
TINY = 1e-10
"""Slacks are no less,"""
HUGE = 1e6
"""multipliers no more, nor less than one over it squared, so that rows without an answer stay numbers."""
HALVINGS = 10
"""of a step between whose nodes there is no motion"""
RIDGE = 1e-10
"""of what is on the band's diagonal: more than rounding"""
CLOSE = 0.1
"""of a limit's square: rows that exceed none by more may come nearer to what they want"""
WHOLE = 0.6
"""of a step taken is as good as all of it"""
FALLING = 0.2, 0.7
"""times the barrier's weight before, after a whole step and after less"""


@dataclass(frozen=True, slots=True)
class Found:
    """Rates at M nodes in R rows."""

    b: Array
    """(M,) m²/s², s'²"""
    a: Array
    """(M,) m/s², s''"""
    solved: Flags
    """(R,) rows that keep every limit, and are the fastest but for GAP"""


class _Rows:
    """Sums and extremes over rows of steps."""

    def __init__(self, steps: Steps) -> None:
        self.of = steps.row
        self.heads = np.flatnonzero(np.diff(steps.row, prepend=-1))
        self.count = np.diff(self.heads, append=len(steps.row))

    def sum(self, values: Array) -> Array:
        return np.asarray(np.add.reduceat(values, self.heads))

    def least(self, values: Array) -> Array:
        return np.asarray(np.minimum.reduceat(values, self.heads))

    def greatest(self, values: Array) -> Array:
        return np.asarray(np.maximum.reduceat(values, self.heads))


class _Search:
    """Where the search is: nodes, slacks, multipliers, and what follows from them."""

    def __init__(self, steps: Steps, b: Array, a: Array) -> None:
        self._look(steps, b, a)
        # Without changes at the nodes there is a motion between any two rates.
        lost = self._lost(self.motion)
        self._look(steps, b, np.where(lost[self.row], 0.0, a))
        self.mu = BEGIN * self.time / self.count
        self.slack = np.maximum(1.0 - self.shares, LEAST_SLACK)
        self.dual = self.mu[steps.row] / self.slack
        self.stuck = np.zeros(len(self.mu), dtype=np.intp)

    def _look(self, steps: Steps, b: Array, a: Array) -> None:
        """At these nodes."""
        self.steps, self.rows, self.b, self.a = steps, _Rows(steps), b, a
        self.row = np.zeros(len(b), dtype=np.intp)
        self.row[steps.node] = self.row[steps.node + 1] = steps.row
        self.motion = Motion.of(steps, b, a)
        self.shares = self.motion.shares(steps)
        self.count = self.shares.shape[0] * self.shares.shape[1] * self.rows.count

    def keep(self, rows: Flags) -> Ints:
        """Go on with some of the rows; (M,) which nodes are theirs."""
        steps, nodes, which = self.steps.only(rows)
        self._look(steps, self.b[nodes], self.a[nodes])
        self.mu, self.stuck = self.mu[rows], self.stuck[rows]
        self.slack, self.dual = self.slack[..., which], self.dual[..., which]
        return nodes

    @property
    def time(self) -> Array:
        """(R,) s"""
        return self.rows.sum(2 * self.motion.half)

    def step(self) -> Array:
        """One of Newton's steps; (R,) how much of it was taken."""
        rows, slopes, mu = self.rows, Slopes.of(self.steps, self.motion), self.mu[self.steps.row]
        over = self.shares + self.slack - 1.0
        db, da = self._newton(slopes, (mu + self.dual * over) / self.slack)
        moved = np.concatenate((self.steps.ends(db), self.steps.ends(da)))[[0, 2, 1, 3]]
        loosened = -over - np.einsum("psen,pn->sen", slopes.share, moved)
        pulled = (mu - self.dual * (self.slack + loosened)) / self.slack
        taken = np.minimum(_room(rows, self.slack, loosened), self._positive(db))
        taken = self._taken(taken, (db, da, loosened))
        dual = self.dual + _room(rows, self.dual, pulled)[self.steps.row] * pulled
        self.dual = np.clip(dual, HUGE**-2, HUGE)
        self.stuck = np.where(taken > STUCK, 0, self.stuck + 1)
        return taken

    def _newton(self, slopes: Slopes, pressed: Array) -> tuple[Array, Array]:
        """((M,), (M,)): Newton's step in b and a of the nodes."""
        gradient, weight = 2 * slopes.half, self.dual / self.slack
        bend = 2 * slopes.bend + curvature(self.steps, self.motion, slopes.jerk, self.dual)
        for p, one in enumerate(slopes.share):
            gradient[p] += np.einsum("sen,sen->n", pressed, one)
            weighed = weight * one
            for q in range(p, VARIABLES):
                bend[p, q] += np.einsum("sen,sen->n", weighed, slopes.share[q])
        return _solved(self.steps, self.rows, gradient, bend)

    def _positive(self, db: Array) -> Array:
        """(R,) how much of a change keeps the nozzle moving at every node but the ends'."""
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(db < 0.0, -HELD * self.b / db, 1.0)
        return np.minimum(self.rows.least(self.steps.ends(room).min(axis=0)), 1.0)

    def _lost(self, motion: Motion) -> Flags:
        """(R,) rows with steps between whose nodes there is no motion."""
        return np.asarray(~np.isfinite(self.rows.sum(motion.half + motion.j.sum(axis=0))))

    def _taken(self, taken: Array, direction: tuple[Array, Array, Array]) -> Array:
        """(R,) of a step in b, a and slacks, halved until there are such steps."""
        b, a, slack = self.b, self.a, self.slack
        for halved in range(HALVINGS + 1):
            part = taken[self.row]
            self.b, self.a = b + part * direction[0], a + part * direction[1]
            self.motion = Motion.of(self.steps, self.b, self.a)
            lost = self._lost(self.motion)
            if not lost.any():
                break
            taken = np.where(lost, taken / 2 if halved < HALVINGS - 1 else 0.0, taken)
        self.shares = self.motion.shares(self.steps)
        slack = slack + taken[self.steps.row] * direction[2]
        self.slack = np.maximum(np.maximum(slack, TINY), 1.0 - self.shares)
        return taken

    def state(self) -> tuple[Array, Array]:
        """(R,) by how much a share exceeds 1 at most; (R,) s by which a row may still be too slow."""
        missing = self.rows.greatest((self.shares + self.slack - 1.0).max(axis=(0, 1)))
        return missing, self.rows.sum((self.dual * self.slack).sum(axis=(0, 1)))

    def lower(self, taken: Array) -> None:
        """The barrier, of rows that are close to their limits."""
        missing, left = self.state()
        lower = np.minimum(self.mu, left / self.count) * np.where(taken > WHOLE, *FALLING)
        lower = np.maximum(lower, GAP / 2 * self.time / self.count)
        self.mu = np.where(missing < CLOSE, lower, self.mu)


def fastest(steps: Steps, b: Array, a: Array) -> Found:
    """From a law near the limits; b and a of each row's first and last node stay as they are."""
    found = Found(b.copy(), a.copy(), np.zeros(int(steps.row[-1]) + 1, dtype=np.bool_))
    search, rows, nodes = _Search(steps, b, a), np.arange(len(found.solved)), np.arange(len(b))
    for _ in range(ROUNDS):
        try:
            taken = search.step()
        except LinAlgError:  # of rows without an answer, by rounding
            break
        missing, left = search.state()
        solved = (missing < NEAR) & (left < 2 * GAP * search.time)
        theirs = solved[search.row]
        found.solved[rows[solved]] = True
        found.b[nodes[theirs]], found.a[nodes[theirs]] = search.b[theirs], search.a[theirs]
        search.lower(taken)
        going = ~solved & (search.stuck < PATIENCE)
        if not going.any():
            break
        if not going.all():
            nodes = nodes[search.keep(going)]
            rows = rows[going]
    return found


def _solved(steps: Steps, rows: _Rows, gradient: Array, bend: Array) -> tuple[Array, Array]:
    """((M,), (M,)) of b and a of the nodes, nothing at the ends of rows: bend times these is -gradient."""
    size = 2 * (int(steps.node[-1]) + 2)
    band, right, first = np.zeros((VARIABLES, size)), np.zeros(size), 2 * steps.node
    for p in range(VARIABLES):
        right[first + p] -= gradient[p]
        for q in range(p, VARIABLES):
            band[VARIABLES - 1 - (q - p), first + q] += bend[p, q]
    begin, end = steps.node[rows.heads], steps.node[rows.heads + rows.count - 1] + 1
    for fixed in (2 * begin, 2 * begin + 1, 2 * end, 2 * end + 1):
        right[fixed] = 0.0
        for off in range(VARIABLES):
            band[VARIABLES - 1 - off, fixed] = 0.0
            inside = fixed + off < size
            band[VARIABLES - 1 - off, fixed[inside] + off] = 0.0
        band[-1, fixed] = 1.0
    scale = 1.0 / np.sqrt(band[-1])
    for off in range(VARIABLES):
        band[VARIABLES - 1 - off, off:] *= scale[off:] * scale[: size - off]
    band[-1] += RIDGE
    found = scale * solveh_banded(band, right * scale, overwrite_ab=True, check_finite=False)
    return found[0::2], found[1::2]


def _room(rows: _Rows, values: Array, change: Array) -> Array:
    """(R,) how much of a change keeps all values of a row positive, at most 1."""
    with np.errstate(divide="ignore"):
        room = np.where(change < 0.0, -HELD * values / change, 1.0)
    return np.minimum(rows.least(room.min(axis=(0, 1))), 1.0)
