"""Which way each cell is run through, once the speeds at its borders are known: the one that takes least."""

from dataclasses import replace

import numpy as np

from cdhr_host.motion.cells import Cells
from cdhr_host.motion.look_ahead import HALVINGS, change_time, feasible, inside, needed
from cdhr_host.values import Array, Ints

NEVER = 1e9
"""s, more than any cell takes."""


def chosen(cells: Cells, borders: Array) -> tuple[Cells, Array]:
    """The same K cells with one way each, and the greatest speeds (K,) m/s inside them.

    Their ends are passed at ``borders`` (K+1,) m/s.
    """
    both = inside(cells, borders)
    several = np.flatnonzero(cells.several)
    row, column = np.zeros(len(cells.length), dtype=np.intp), np.arange(len(cells.length))
    row[several] = _soonest(cells.only(several), (both[0][several], both[1][several]))
    speed, a, j = (each[row, column][None] for each in (cells.speed, cells.acceleration, cells.jerk))
    one = replace(cells, speed=speed, acceleration=a, jerk=j)
    return one, peak_speeds(one, both)[0]


def _soonest(cells: Cells, both: tuple[Array, Array]) -> Ints:
    """(K,) the way that takes least; if rounding leaves none, the one that is short of least."""
    peaks = peak_speeds(cells, both)
    over = needed(both, np.maximum(*both), cells) - cells.length
    time = np.where(feasible(both, cells), _time(cells, both, peaks), NEVER + over)
    return np.asarray(np.argmin(time, axis=0), dtype=np.intp)


def _time(cells: Cells, both: tuple[Array, Array], peaks: Array) -> Array:
    """(M, K) s, of no meaning where a cell cannot have these ends."""
    a, j = cells.acceleration, cells.jerk
    with np.errstate(divide="ignore", invalid="ignore"):
        cruising = (cells.length - needed(both, peaks, cells)) / peaks
        return sum((change_time(peaks - one, a, j) for one in both), cruising)


def peak_speeds(cells: Cells, both: tuple[Array, Array]) -> Array:
    """(M, K) m/s: greatest speed inside each cell between its ends."""
    least, length = np.maximum(*both), cells.length
    peaks = np.maximum(cells.speed, least)
    short = np.flatnonzero((needed(both, peaks, cells) > length).any(axis=0))
    if len(short):
        some, ends_there = cells.only(short), (both[0][short], both[1][short])
        low, high = np.broadcast_to(least[short], some.speed.shape), peaks[:, short]
        fits = needed(ends_there, high, some) <= length[short]
        low = np.where(fits, high, low)
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            fits = needed(ends_there, middle, some) <= length[short]
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        peaks[:, short] = low
    return peaks
