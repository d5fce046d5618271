"""The baseline: constant acceleration, with instantaneous speed changes at junctions.

The classic scheme of desktop printers: each straight move is a trapezoid of speed; from one
move to the next the velocity may jump by a vector of at most ``jump``, so two moves whose
directions differ by |d1 - d0| meet at no more than jump / |d1 - d0|; a run starts and stops
at rest. One pass backwards and one forwards make all junction speeds reachable.
Acceleration is infinite at each jump, and jerk wherever acceleration changes.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.arc import chords
from cdhr_host.motion.curves import points_on
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.values import Arc, Array, Blend, Command, Dwell, Moves, Pause, Prime, Spline, Stop

CHORD = 1e-3
"""m, chords for curves, as firmware commonly draws them"""


@dataclass(frozen=True, slots=True)
class Polyline:
    """A row of straight moves between standstills."""

    points: Array
    """(N+1, 3) m"""
    feed: Array
    """(N,) m/s"""


@dataclass(frozen=True, slots=True)
class Trapezoids:
    """The motion along a polyline: K pieces of constant acceleration."""

    points: Array
    """(N+1, 3) m"""
    t: Array
    """(K+1,) s"""
    state: Array
    """(3, K) m along the polyline, m/s, m/s²"""

    @property
    def duration(self) -> float:
        """s"""
        return float(self.t[-1])

    def at(self, t: Array) -> Array:
        """(M,) s -> (M, 3) m."""
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, self.state.shape[1] - 1)
        x, (s, v, a) = t - self.t[k], self.state[:, k]
        drawn = np.concatenate(([0.0], np.cumsum(_norm(np.diff(self.points, axis=0)))))
        reached = s + x * (v + x * a / 2)
        return np.column_stack([np.interp(reached, drawn, axis) for axis in self.points.T])


def trapezoids(line: Polyline, acceleration: float, jump: float) -> Trapezoids:
    """The classic plan of a polyline."""
    steps = np.diff(line.points, axis=0)
    length = _norm(steps)
    border = _reachable(_junctions(steps / length[:, None], line.feed, jump), length, acceleration)
    v0, v1 = border[:-1], border[1:]
    peak = np.minimum(line.feed, np.sqrt((v0**2 + v1**2) / 2 + acceleration * length))
    rise, fall = (peak**2 - v0**2) / (2 * acceleration), (peak**2 - v1**2) / (2 * acceleration)
    cruise = np.maximum(length - rise - fall, 0.0)
    times = np.column_stack(((peak - v0) / acceleration, cruise / peak, (peak - v1) / acceleration))
    begin = np.cumsum(length) - length
    s = np.column_stack((begin, begin + rise, begin + rise + cruise))
    v = np.column_stack((v0, peak, peak))
    a = np.broadcast_to(np.array([acceleration, 0.0, -acceleration]), times.shape)
    t = np.concatenate(([0.0], np.cumsum(times.ravel())))
    return Trapezoids(line.points, t, np.stack((s.ravel(), v.ravel(), a.ravel())))


def _junctions(direction: Array, feed: Array, jump: float) -> Array:
    """(N+1,) m/s: greatest speed at each end of a move that the jump and the feeds allow."""
    turn = np.maximum(_norm(np.diff(direction, axis=0)), 1e-12)
    inner = np.minimum(np.minimum(feed[1:], feed[:-1]), jump / turn)
    return np.concatenate(([0.0], inner, [0.0]))


def _reachable(cap: Array, length: Array, acceleration: float) -> Array:
    """(N+1,) m/s: those speeds lowered to what acceleration reaches, both ways."""
    gain = (2 * acceleration * length).tolist()
    backward = _pass(cap.tolist()[::-1], gain[::-1])[::-1]
    return np.array(_pass(backward, gain))


def _pass(speeds: list[float], gain: list[float]) -> list[float]:
    for i, more in enumerate(gain):
        speeds[i + 1] = min(speeds[i + 1], math.sqrt(speeds[i] ** 2 + more))
    return speeds


def drawn(commands: Iterable[Command], limits: MotionLimits) -> list[Polyline | float]:
    """A program as polylines, and the times (s) it stands between them; G61 stops after each command."""
    found: list[Polyline | float] = []
    parts: list[Polyline] = []
    exact = False
    for command in commands:
        if isinstance(command, Moves | Arc | Spline):
            parts += _lines(command, limits, exact=exact)
        exact = command.exact if isinstance(command, Blend) else exact
        if exact or isinstance(command, Blend | Dwell | Prime | Pause | Stop):
            found += [line for part in parts for line in _joined([part])] if exact else _joined(parts)
            parts = []
        if isinstance(command, Dwell | Prime | Pause | Stop):
            found.append(_standing(command))
    return found + _joined(parts)


def _lines(command: Moves | Arc | Spline, limits: MotionLimits, *, exact: bool) -> list[Polyline]:
    """What a command draws, each move by itself where it ends in an exact stop."""
    if not isinstance(command, Moves):
        return [_chords(command, limits)]
    points = np.concatenate((command.start_G[None], command.end_G))
    whole = Polyline(points, np.minimum(command.speed, limits.speed))
    if not exact:
        return [whole]
    return [Polyline(points[k : k + 2], whole.feed[k : k + 1]) for k in range(len(whole.feed))]


def _standing(command: Dwell | Prime | Pause | Stop) -> float:
    if isinstance(command, Dwell):
        return command.duration
    return command.clay / command.flow if isinstance(command, Prime) else 0.0


def _joined(parts: list[Polyline]) -> list[Polyline]:
    """One polyline of several in a row, without moves of no length; none if nothing is left."""
    if not parts:
        return []
    points = np.concatenate([parts[0].points[:1], *(part.points[1:] for part in parts)])
    moves = _norm(np.diff(points, axis=0)) > 0.0
    if not moves.any():
        return []
    kept = np.concatenate((points[:1], points[1:][moves]))
    return [Polyline(kept, np.concatenate([part.feed for part in parts])[moves])]


def _chords(curve: Arc | Spline, limits: MotionLimits) -> Polyline:
    """A curve as chords of at most CHORD."""
    points = chords(curve, 2 * CHORD) if isinstance(curve, Arc) else points_on(curve, 2 * CHORD)
    return Polyline(points, np.full(len(points) - 1, min(curve.speed, limits.speed)))


def _norm(vectors: Array) -> Array:
    return np.sqrt(np.einsum("nk,nk->n", vectors, vectors))
