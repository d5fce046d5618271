"""The jerk-limited reference: a whole run optimised at once, by an interior-point method.

Unknowns are the rate s' and its change s'' at N nodes along the path, and duration and jerk
s''' of the step between each two. Steps of constant s''' tie them together exactly, so a start
from rest is no singularity. At both ends of every step the nozzle obeys, with q(s) the run's
curve,

    |q'| s' <= F,   |q'' s'² + q' s''| <= A,   |q''' s'³ + 3 q'' s' s'' + q' s'''| <= J.

and the sum of the durations is least. Where |q'| jumps, at the ends of corners with gears, s' and s''
jump the other way, so that speed and acceleration are continuous. What comes out is sampled as a motion
in time and held to the limits by finite differences; time is then stretched by what is missing, so that the
reference is a motion that keeps every limit. Not convex: the result is a local optimum, the best
of those reached from the plan itself and from the plan slowed down.
"""

import math
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
from paths import Run

from cdhr_host.motion.limits import MotionLimits
from cdhr_host.values import Array

BEND_STEPS = 12
"""Steps of a bend for each half-width of the smoothing kernel"""
TIME_STEP = 0.008
"""s of the plan, steps of equal duration which refine starts, stops and long pieces"""
END_STEPS = 64
"""Steps of the first and last stretch of a run whose path is at rest in s there"""
CALM = 4
"""Steps there during which s' is constant: the path itself moves slowly"""
NARROW = 1e-7
"""m, nodes nearer than this are one"""
SAMPLE_S = 2e-4
"""s, spacing of the finite differences"""
SLOWER = (1.0, 1.3)
"""Time scales of the plan from which the optimisation starts"""
JUMP = 1e-6
"""of |q'|, less is rounding"""
UNIT_TIME = 0.01
"""s, the unit of durations inside the optimisation"""


@dataclass(frozen=True, slots=True)
class Reference:
    """The best motion found."""

    duration: float
    """s, after stretching"""
    stretched: float
    """factor by which time was stretched to keep every limit"""
    s: Array
    """(N,) m, nodes"""
    t: Array
    """(N,) s, when the reference is at each"""
    converged: bool


def reference(run: Run, limits: MotionLimits) -> Reference:
    """The fastest motion along the run's own curve under all three limits."""
    nodes = _nodes(run, limits)
    found = [_solved(run, limits, nodes, slower) for slower in SLOWER]
    return min(found, key=lambda each: each.duration)


def _nodes(run: Run, limits: MotionLimits) -> Array:
    """(N,) m: borders of pieces, steps inside bends, and equal steps of the plan's time."""
    lengths = np.diff(run.s)
    count = np.where(run.bent, np.ceil(lengths / limits.half_width * BEND_STEPS), 1).astype(int)
    part = np.concatenate([np.arange(1, each) / each for each in count])
    inside = np.repeat(run.s[:-1], count - 1) + np.repeat(lengths, count - 1) * part
    count = math.ceil(run.planned / TIME_STEP)
    timed, _, _ = run.plan_at(np.linspace(0.0, run.planned, count + 1)[1:-1])
    near = 2 * limits.half_width * np.arange(1, END_STEPS + 1) / END_STEPS
    extra = np.sort(np.concatenate((inside, timed, near, run.s[-1] - near)))
    extra = extra[(extra > 0.0) & (extra < run.s[-1])]
    border = run.s[np.clip(np.searchsorted(run.s, extra), 1, len(run.s) - 1)]
    before = run.s[np.searchsorted(run.s, extra) - 1]
    clear = (border - extra > NARROW) & (extra - before > NARROW)
    clear &= np.diff(extra, prepend=-1.0) > NARROW
    return np.sort(np.concatenate((run.s, extra[clear])))


def _solved(run: Run, limits: MotionLimits, s: Array, slower: float) -> Reference:
    """The optimum near the plan slowed down by a factor."""
    problem, guess = _Problem.of(run, limits, s), _guess(run, limits, s, slower)
    solver = casadi.nlpsol("reference", "ipopt", problem.nlp, _OPTIONS)
    answer = solver(x0=guess, lbx=problem.lower, ubx=problem.upper, lbg=problem.least, ubg=problem.most)
    n = len(s)
    x = np.array(answer["x"]).ravel()
    rate, change, jerk = x[:n] * limits.speed, x[n : 2 * n] * limits.acceleration, x[2 * n : 3 * n - 1]
    step = x[3 * n - 1 :] * UNIT_TIME
    stretched = _excess(run, limits, (s, rate, change, jerk * limits.jerk), step)
    t = stretched * np.concatenate(([0.0], np.cumsum(step)))
    return Reference(float(t[-1]), stretched, s, t, bool(solver.stats()["success"]))


_OPTIONS = {
    "print_time": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "max_iter": 600,
        "tol": 1e-8,
        "constr_viol_tol": 1e-11,
        "mu_strategy": "adaptive",
    },
}


def _ratios(run: Run, s: Array) -> Array:
    """(N,) s' before each node for s' after it: where |q'| jumps, s' jumps the other way."""
    before, after = (np.sqrt((run.at(s, before=side)[1] ** 2).sum(axis=1)) for side in (True, False))
    jumps = np.abs(before - after) > JUMP
    return np.where(jumps, after / np.maximum(before, JUMP), 1.0)


def _guess(run: Run, limits: MotionLimits, s: Array, slower: float) -> Array:
    """The unknowns as the plan has them, in the optimisation's units."""
    t = np.arange(0.0, run.planned, SAMPLE_S / 4)
    where, rate, change = run.plan_at(t)
    when = np.interp(s, np.maximum.accumulate(where), t)
    after = when + SAMPLE_S / 4
    rate, change = np.interp(after, t, rate) / slower, np.interp(after, t, change) / slower**2
    step = np.maximum(np.diff(when), 1e-5) * slower
    arriving = (change * _ratios(run, s))[1:]
    jerk = np.clip((arriving - change[:-1]) / step / limits.jerk, -1.0, 1.0)
    scaled = rate / limits.speed, change / limits.acceleration, jerk, step / UNIT_TIME
    return np.concatenate(scaled)


@dataclass(frozen=True, slots=True)
class _Problem:
    """The nonlinear program, with its bounds."""

    nlp: dict[str, Any]
    lower: Array
    upper: Array
    least: Array
    most: Array

    @classmethod
    def of(cls, run: Run, limits: MotionLimits, s: Array) -> "_Problem":
        n = len(s)
        unknown = casadi.SX.sym("x", 4 * n - 2)
        rate, change = unknown[:n] * limits.speed, unknown[n : 2 * n] * limits.acceleration
        jerk, step = unknown[2 * n : 3 * n - 1] * limits.jerk, unknown[3 * n - 1 :] * UNIT_TIME
        ratio = casadi.DM(_ratios(run, s))
        nodes = (rate, change), (rate * ratio, change * ratio)
        ties = _ties(limits, np.diff(s), nodes, jerk, step)
        between = rate[:-1] + step * (change[:-1] / 2 + step * jerk / 8)
        kept = _kept(run, limits, s, (nodes, between, jerk))
        nlp = {"x": unknown, "f": casadi.sum1(step), "g": casadi.vertcat(ties, kept)}
        zeros, ones = np.zeros(ties.shape[0]), np.ones(kept.shape[0])
        lower, upper = _bounds(run, s)
        return cls(nlp, lower, upper, np.concatenate((zeros, -np.inf * ones)), np.concatenate((zeros, ones)))


def _bounds(run: Run, s: Array) -> tuple[Array, Array]:
    """Of the unknowns: rates and durations are positive, and it starts and ends at rest."""
    n = len(s)
    upper = np.full(4 * n - 2, np.inf)
    lower = np.concatenate((np.zeros(n), np.full(2 * n - 1, -np.inf), np.full(n - 1, 1e-6)))
    slope = np.sqrt((run.at(s)[1] ** 2).sum(axis=1))
    for end, steps in ((0, slice(2 * n, 2 * n + CALM)), (n - 1, slice(3 * n - 1 - CALM, 3 * n - 1))):
        if slope[end] > 0.5:
            upper[end] = lower[n + end] = upper[n + end] = 0.0
        else:
            lower[steps] = upper[steps] = lower[n + end] = upper[n + end] = 0.0
    return lower, upper


def _ties(limits: MotionLimits, ds: Array, nodes: Any, jerk: Any, step: Any) -> Any:
    """What constant s''' means for the nodes on either side of each step; 0 when kept.

    ``nodes`` are s' and s'' after them, and before them.
    """
    (rate, change), (arriving, changing) = nodes
    v, a = rate[:-1], change[:-1]
    moved = step * (v + step * (a / 2 + step * jerk / 6)) - ds
    faster = v + step * (a + step * jerk / 2) - arriving[1:]
    harder = a + step * jerk - changing[1:]
    scale = limits.speed * UNIT_TIME
    return casadi.vertcat(moved / scale, faster / limits.speed, harder / limits.acceleration)


def _kept(run: Run, limits: MotionLimits, s: Array, motion: tuple[Any, Any, Any]) -> Any:
    """Squared speed, acceleration and jerk at both ends of each step, as shares of the limits.

    ``motion`` is s' and s'' after and before the nodes, s' half-way in time between them, and jerk.
    """
    nodes, between, jerk = motion
    middle = (s[1:] + s[:-1]) / 2
    piece = np.clip(np.searchsorted(run.s, middle, side="right") - 1, 0, len(run.feed) - 1)
    third, feed = run.curve[3, piece], run.feed[piece]
    fast, shares = [], []
    for end, (rate, change), before in zip((slice(0, -1), slice(1, None)), nodes, (False, True), strict=True):
        _, slope, bend, _ = run.at(s, before=before)
        fast.append((slope**2).sum(axis=1)[end])
        shares.append(_squared([slope, bend], [change, rate**2]) / limits.acceleration**2)
        shares.append(fast[-1] * rate[end] ** 2 / feed**2)
        terms = [third, 3 * bend[end], slope[end]]
        factors = [rate[end] ** 3, rate[end] * change[end], jerk]
        shares.append(_squared(terms, factors) / limits.jerk**2)
    return casadi.vertcat(*shares, np.minimum(*fast) * between**2 / feed**2)


def _squared(vectors: list[Array], factors: list[Any]) -> Any:
    """Squared length of a sum of vectors (N, 3), each with a factor (N,)."""
    total: Any = 0
    for axis in range(3):
        part: Any = 0
        for vector, factor in zip(vectors, factors, strict=True):
            part = part + casadi.DM(vector[:, axis]) * factor
        total = total + part**2
    return total


def _driven(motion: tuple[Array, Array, Array, Array], step: Array) -> Array:
    """(N,) m: s every SAMPLE_S, from s, s' and s'' after each node and each step's jerk.

    Where |q'| jumps a step must not reach beyond its nodes, not even by rounding.
    """
    nodes, rate, change, jerk = motion
    begin = _running(0.0, step)
    t = np.arange(0.0, begin[-1], SAMPLE_S)
    k = np.clip(np.searchsorted(begin, t, side="right") - 1, 0, len(step) - 1)
    x = t - begin[k]
    s = nodes[k] + x * (rate[k] + x * (change[k] / 2 + x * (jerk[k] / 6)))
    return np.clip(s, nodes[k], nodes[k + 1])


def _running(start: float, increments: Array) -> Array:
    """(N,) -> (N+1,): running sum from a start."""
    return np.cumsum(np.concatenate(([start], increments)))


def _excess(run: Run, limits: MotionLimits, motion: tuple[Array, Array, Array, Array], step: Array) -> float:
    """By how much time must be stretched for finite differences of the motion to keep the limits."""
    s = _driven(motion, step)
    position = run.at(s)[0]
    feed = run.feed[np.clip(np.searchsorted(run.s, s[:-1], side="right") - 1, 0, len(run.feed) - 1)]
    feed = np.maximum(feed, np.append(feed[1:], feed[-1]))
    return max(
        1.0,
        float((_length(np.diff(position, axis=0)) / SAMPLE_S / feed).max()),
        math.sqrt(_length(np.diff(position, n=2, axis=0)).max() / SAMPLE_S**2 / limits.acceleration),
        math.cbrt(_length(np.diff(position, n=3, axis=0)).max() / SAMPLE_S**3 / limits.jerk),
    )


def _length(vectors: Array) -> Array:
    return np.sqrt(np.einsum("nk,nk->n", vectors, vectors))
