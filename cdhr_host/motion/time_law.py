"""s(t): constant-jerk pieces through a row of cells."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.limits import Cells
from cdhr_host.motion.look_ahead import change_distance, peak_speeds
from cdhr_host.motion.speed_change import speed_change
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class TimeLaw:
    """K pieces of constant jerk: s, s', s'' at the start of each, s''' on it."""

    t: Array
    """(K,) s, start of each piece; the first is 0"""
    duration: float
    """s"""
    end: float
    """m, s at the end"""
    state: Array
    """(4, K) s (m), s' (m/s), s'' (m/s²) at the start, s''' (m/s³)"""

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """(N,) s -> s, s', s'' (N,) each."""
        piece = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 1)
        x = t - self.t[piece]
        s, v, a, j = (row[piece] for row in self.state)
        return (
            s + x * (v + x * (a / 2 + x * (j / 6))),
            v + x * (a + x * (j / 2)),
            a + x * j,
        )


def time_law(cells: Cells, borders: Array) -> TimeLaw:
    """Fastest law through the cells with the given border speeds (K+1,), s'' = 0 at each border.

    In each cell the speed rises to a peak, cruises, and falls to the next border.
    """
    peaks = peak_speeds(cells, borders)
    duration = np.zeros((len(peaks), 7))
    jerk = np.zeros((len(peaks), 7))
    rise = change_distance(borders[:-1], peaks, cells.acceleration, cells.jerk)
    fall = change_distance(peaks, borders[1:], cells.acceleration, cells.jerk)
    duration[:, 3] = np.maximum(cells.length - rise - fall, 0.0) / peaks
    _change(duration[:, :3], jerk[:, :3], borders[:-1], peaks, cells)
    _change(duration[:, 4:], jerk[:, 4:], peaks, borders[1:], cells)
    end = float(cells.start[-1] + cells.length[-1])
    return _integrated(cells.start, borders[:-1], end, duration, jerk)


def _change(duration: Array, jerk: Array, v0: Array, v1: Array, cells: Cells) -> None:
    """Fill in the three pieces (K, 3) of each cell whose speed changes from v0 to v1."""
    for k in np.flatnonzero(v0 != v1).tolist():
        t, j = speed_change(float(v0[k]), float(v1[k]), float(cells.acceleration[k]), float(cells.jerk[k]))
        duration[k], jerk[k] = t[:3], j[:3]


def _integrated(s: Array, v: Array, last: float, duration: Array, jerk: Array) -> TimeLaw:
    """Pieces (K, 7) of each cell, from its start s and speed v (K,), as one law ending at s = last."""
    state = np.zeros((4, *duration.shape))
    state[0, :, 0], state[1, :, 0], state[3] = s, v, jerk
    for i in range(6):
        x, (s, v, a, j) = duration[:, i], state[:, :, i]
        state[0, :, i + 1] = s + x * (v + x * (a / 2 + x * (j / 6)))
        state[1, :, i + 1] = v + x * (a + x * (j / 2))
        state[2, :, i + 1] = a + x * j
    end = np.cumsum(duration)
    lasting = duration.ravel() > 0
    start = np.concatenate(([0.0], end[:-1]))[lasting]
    return TimeLaw(start, float(end[-1]), last, state.reshape(4, -1)[:, lasting])
