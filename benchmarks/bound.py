"""The lower bound: the fastest a run could be on its own geometry if jerk cost nothing.

By arc length l the nozzle has, with v = dl/dt and curvature k, |acceleration|² = (k v²)² + v'²,
so x = v² obeys x <= F², k x <= A and |dx/dl| <= 2 sqrt(A² - k² x²). Any smaller x is allowed too,
so one pass forwards and one backwards from rest give the greatest x everywhere. On a step of
constant k, x = (A/k) sin(2 k l + phase). Taking the lesser curvature of each step's two ends
keeps the result a bound.
"""

from dataclasses import dataclass
from math import asin, pi, sin

import numpy as np
from paths import Run

from cdhr_host.motion.limits import MotionLimits
from cdhr_host.values import Array

STEPS = 16
"""Steps of each bent piece; straight pieces need one"""


@dataclass(frozen=True, slots=True)
class Grid:
    """N nodes along a run."""

    s: Array
    """(N,) m"""
    arc: Array
    """(N-1,) m, arc length of each step"""
    curvature: Array
    """(N,) 1/m"""
    bend: Array
    """(N-1,) 1/m, lesser curvature of each step's ends; 0 on straight steps"""
    feed: Array
    """(N-1,) m/s"""


def grid(run: Run, steps: int = STEPS) -> Grid:
    """Nodes at every border of pieces, and more where the path bends."""
    count = np.where(run.bent, steps, 1)
    piece = np.repeat(np.arange(len(count)), count)
    part = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    lengths = np.diff(run.s)
    s = np.append(run.s[piece] + lengths[piece] * part / count[piece], run.s[-1])
    middle = (s[1:] + s[:-1]) / 2
    first, between = (_norm(run.at(each)[1]) for each in (s[:-1], middle))
    last = _norm(run.at(s[1:], before=True)[1])
    arc = np.diff(s) * (first + 4 * between + last) / 6
    curvature = _curvature(run, s)
    bend = np.where(run.bent[piece], np.minimum(curvature[1:], curvature[:-1]), 0.0)
    return Grid(s, arc, curvature, bend, run.feed[piece])


def _curvature(run: Run, s: Array) -> Array:
    _, slope, bend, _ = run.at(s)
    rate = _norm(slope)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = _norm(np.cross(slope, bend)) / rate**3
    return np.where(rate > 1e-6, found, 0.0)


def fastest(nodes: Grid, acceleration: float) -> Array:
    """(N,) m²/s²: greatest squared nozzle speed at every node, from rest to rest."""
    feed = np.minimum(np.append(nodes.feed, np.inf), np.concatenate(([np.inf], nodes.feed)))
    with np.errstate(divide="ignore"):
        cap = np.minimum(feed**2, acceleration / nodes.curvature)
    cap[[0, -1]] = 0.0
    forward = _pass(cap, nodes.arc, nodes.bend, acceleration)
    return _pass(forward[::-1], nodes.arc[::-1], nodes.bend[::-1], acceleration)[::-1]


def _pass(cap: Array, arc: Array, bend: Array, acceleration: float) -> Array:
    """(N,) -> (N,): each value lowered to what the one before it can reach."""
    x, found = 0.0, [0.0]
    for top, length, k in zip(cap[1:].tolist(), arc.tolist(), bend.tolist(), strict=True):
        x = min(top, _reached(x, length, k, acceleration))
        found.append(x)
    return np.array(found)


def _reached(x: float, length: float, k: float, acceleration: float) -> float:
    """Squared speed after a step of constant curvature with all of the acceleration."""
    if k * length < 1e-9:
        return x + 2 * acceleration * length
    phase = asin(min(k * x / acceleration, 1.0)) + 2 * k * length
    return acceleration / k * (sin(phase) if phase < pi / 2 else 1.0)


def step_times(nodes: Grid, x: Array, acceleration: float) -> Array:
    """(N-1,) s: steps with x linear in arc length; straight ones may rise to their feed inside."""
    v0, v1, both = np.sqrt(x[:-1]), np.sqrt(x[1:]), (x[1:] + x[:-1]) / 2
    peak = np.minimum(nodes.feed, np.sqrt(both + acceleration * nodes.arc))
    cruise = np.maximum(nodes.arc - (peak**2 - both) / acceleration, 0.0)
    rising = (2 * peak - v0 - v1) / acceleration + cruise / peak
    with np.errstate(divide="ignore"):
        linear = 2 * nodes.arc / (v0 + v1)
    return np.where(nodes.bend > 0, linear, rising)


def bound(run: Run, limits: MotionLimits, steps: int = STEPS) -> float:
    """s: no motion along the run's geometry within speed and acceleration is faster."""
    nodes = grid(run, steps)
    x = fastest(nodes, limits.acceleration)
    return float(step_times(nodes, x, limits.acceleration).sum())


def _norm(vectors: Array) -> Array:
    return np.sqrt(np.einsum("nk,nk->n", vectors, vectors))
