"""Programs for the planner, and what a track must keep."""

import numpy as np

from cdhr_host.values import Moves

PERIOD = 0.004


def moves(points, speed=0.02, clay=0.0, line=None):
    """Straight moves through points (M+1, 3) in m."""
    points = np.asarray(points, dtype=float)
    count = len(points) - 1
    return Moves(
        line=np.arange(1, count + 1) if line is None else np.asarray(line),
        start_G=points[0].copy(),
        end_G=points[1:].copy(),
        speed=np.broadcast_to(np.asarray(speed, float), count).copy(),
        clay=np.broadcast_to(np.asarray(clay, float), count).copy(),
        air=np.zeros(count),
    )


class Joined:
    """All blocks of a run as one."""

    def __init__(self, tracks):
        for name in ("tick", "line", "position_G", "velocity", "acceleration", "flow", "air"):
            setattr(self, name, np.concatenate([getattr(track, name) for track in tracks]))


def joined(tracks):
    return Joined(tracks)


def norm(rows):
    return np.linalg.norm(rows, axis=1)


def differences(track, period=PERIOD):
    """Greatest speed, acceleration and jerk by finite differences of positions."""
    rows = track.position_G
    largest = []
    for _ in range(3):
        rows = np.diff(rows, axis=0) / period
        largest.append(norm(rows).max() if len(rows) else 0.0)
    return largest


def distance_to(points, polyline, chunk=2000):
    """(N, 3), (M+1, 3) -> (N,): distance of each point to the polyline."""
    start, step = polyline[:-1], np.diff(polyline, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-300)
    nearest = []
    for first in range(0, len(points), chunk):
        some = points[first : first + chunk]
        onwards = some @ step.T - (start * step).sum(axis=1)
        u = np.clip(onwards / square, 0.0, 1.0)
        # But for what is the same for all segments. Rounding may take one that is as near to some nanometres.
        k = ((start**2).sum(axis=1) - 2 * some @ start.T + u * (u * square - 2 * onwards)).argmin(axis=1)
        nearest.append(norm(some - start[k] - u[np.arange(len(k)), k, None] * step[k]))
    return np.concatenate(nearest)
