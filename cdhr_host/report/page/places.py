"""Where a problem is: the sample whose number the problem tells."""

import numpy as np

from cdhr_host.errors import Problem
from cdhr_host.motion.vectors import norms
from cdhr_host.pipeline import Checked
from cdhr_host.units import KPA, MM
from cdhr_host.values import Array


def place_of(problem: Problem, checked: Checked) -> Array:
    """(3,) m, ``_G``: among the samples of the problem's line, where its value is met.

    For quantities that a block does not carry it is the first sample of the line.
    """
    track = checked.track
    wanted = problem.value if isinstance(problem.value, float) else 0.0
    away = np.abs(_numbers(problem.kind, checked) - wanted)
    away = np.where(np.isnan(away), np.inf, away).min(axis=1)
    away[track.line != problem.line] = np.inf
    place: Array = track.position_G[int(away.argmin())].copy()
    return place


def _numbers(kind: str, checked: Checked) -> Array:
    """(N, k): what a kind of problem is about, in its unit, at each sample of the track; NaN off the bed."""
    track, rows = checked.track, checked.setpoints
    if kind == "bed":
        x, y, z = track.position_G.T / MM
        return np.column_stack([np.hypot(x, y), z])
    if kind == "speed":
        return norms(track.velocity)[:, None] / MM
    if kind == "acceleration":
        return norms(track.acceleration)[:, None] / MM
    known = {
        "force": np.hstack([rows.tension, checked.nine]),
        "travel": rows.slider / MM,
        "pressure": rows.pressure[:, None] / KPA,
    }.get(kind)
    found = np.full((len(track.tick), 1 if known is None else known.shape[1]), np.nan)
    if known is None:
        found[:] = 0.0
    else:
        found[np.isin(track.tick, rows.tick, assume_unique=True)] = known
    return found
