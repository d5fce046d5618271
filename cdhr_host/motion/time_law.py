"""s(t): constant-jerk pieces through a row of cells."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.motion.cells import Cells
from cdhr_host.motion.choice import chosen
from cdhr_host.motion.closely import Pieces
from cdhr_host.motion.look_ahead import inside
from cdhr_host.motion.speed_change import speed_change
from cdhr_host.units import MM
from cdhr_host.values import Array, Flags

ROUNDING = 1e-10
"""m by which a change of speed may be longer than its cell."""
INSIDE = 32 * float(np.finfo(np.float64).eps)
"""By how much of a leg's length s keeps off the borders of its cell: s'' may jump there, and q'' with it,
so that rounding must not pair a law with the path beyond. More than rounding, and no more than needed:
the nozzle waits there for so long."""


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
    within: Array
    """(2, K) m, first and last s of the cell it runs through, less what rounding might exceed"""
    close: Flags
    """(K,) whether a piece is so short that it is bounded closely (motion.closely)"""

    @property
    def pieces(self) -> Pieces:
        """All of them."""
        start = self.state[0]
        reached = np.clip((start, np.append(start[1:], self.end)), *self.within)
        return Pieces(self.state, np.diff(self.t, append=self.duration), reached)

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """(N,) s -> s, s', s'' (N,) each."""
        piece = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 1)
        x = t - self.t[piece]
        s, v, a, j = (row[piece] for row in self.state)
        return (
            np.clip(s + x * (v + x * (a / 2 + x * (j / 6))), *self.within[:, piece]),
            v + x * (a + x * (j / 2)),
            a + x * j,
        )


def time_law(cells: Cells, borders: Array) -> TimeLaw:
    """Fastest law through the cells with the nozzle's speeds (K+1,) at borders, s'' = 0 at each.

    In each cell the speed rises to a peak, cruises, and falls to the next border.
    """
    cells, peaks = chosen(cells, borders)
    begin, end = inside(cells, borders)
    duration = np.zeros((len(peaks), 7))
    jerk = np.zeros((len(peaks), 7))
    _change(duration[:, :3], jerk[:, :3], (begin, peaks), cells)
    _change(duration[:, 4:], jerk[:, 4:], (peaks, end), cells)
    way = _way(duration[:, :3], jerk[:, :3], begin) + _way(duration[:, 4:], jerk[:, 4:], peaks)
    _check(way - cells.length)
    duration[:, 3] = np.maximum(cells.length - way, 0.0) / peaks
    last = float(cells.start[-1] + cells.length[-1])
    return _integrated(cells.start, begin, last, duration, jerk)


def _check(over: Array) -> None:
    """Raise MotionError if changing speed takes more way (K,) m than there is, by more than rounding."""
    if len(over) and float(over.max()) > ROUNDING:
        raise MotionError(
            Problem(
                "unplannable",
                f"a change of speed takes {float(over.max()) / MM:.3g} mm more than the path has",
                hint="please report this as a bug, with the program",
            )
        )


def _change(duration: Array, jerk: Array, speed: tuple[Array, Array], cells: Cells) -> None:
    """Fill in the three pieces (K, 3) of each cell whose speed changes."""
    v0, v1 = speed
    for k in np.flatnonzero(v0 != v1).tolist():
        a, j = float(cells.acceleration[0, k]), float(cells.jerk[0, k])
        t, jerks = speed_change(float(v0[k]), float(v1[k]), a, j)
        duration[k], jerk[k] = t[:3], jerks[:3]


def _way(duration: Array, jerk: Array, v: Array) -> Array:
    """(K,) m: the way of pieces (K, 3) from speed v (K,) with s'' = 0."""
    way, a = np.zeros((2, len(v)))
    for x, j in zip(duration.T, jerk.T, strict=True):
        way += x * (v + x * (a / 2 + x * (j / 6)))
        v, a = v + x * (a + x * (j / 2)), a + x * j
    return way


def _integrated(begin: Array, speed: Array, last: float, duration: Array, jerk: Array) -> TimeLaw:
    """Pieces (K, 7) of each cell, from its start s and s' (K,), as one law ending at s = last."""
    state = np.zeros((4, *duration.shape))
    state[0, :, 0], state[3] = begin, jerk
    state[1, :, 0] = speed
    for i in range(6):
        x, (s, v, a, j) = duration[:, i], state[:, :, i]
        state[0, :, i + 1] = s + x * (v + x * (a / 2 + x * (j / 6)))
        state[1, :, i + 1] = v + x * (a + x * (j / 2))
        state[2, :, i + 1] = a + x * j
        # In between the speed neither rises nor falls.
        if i == 2:
            state[2, :, 3] = 0.0
    end = np.cumsum(duration)
    lasting = duration.ravel() > 0
    start = np.concatenate(([0.0], end[:-1]))[lasting]
    inside = INSIDE * max(abs(float(begin[0])), abs(last))
    within = np.stack((np.append(begin[0], begin[1:] + inside), np.append(begin[1:] - inside, last)))
    within = within.repeat(7, axis=1)
    state, within = state.reshape(4, -1)[:, lasting], within[:, lasting]
    return TimeLaw(start, float(end[-1]), last, state, within, np.zeros(len(start), dtype=np.bool_))
