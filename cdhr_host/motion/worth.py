"""Which rows of cells take so much longer than they need that the fastest law is worth looking for."""

from collections.abc import Iterator

import numpy as np

from cdhr_host.motion.cells import Cells
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.look_ahead import change_time, inside
from cdhr_host.motion.nodes import Road, Stretch
from cdhr_host.motion.time_law import TimeLaw
from cdhr_host.values import Array, Ints

SLOW = 1.002
"""Cells that take longer than this, over what each place by itself allows, may be worth it,"""
WORTH = 1e-2, 5e-3
"""where a row may gain this, s, and this part of its time."""
AT_ONCE = 2
"""Rows, one after the other, that are planned together where they are committed together."""


def worthwhile(law: TimeLaw, cells: Cells, borders: Array, road: Road) -> Iterator[Stretch]:
    """Rows of cells that take longer than each place allows by itself, with a neighbour on both sides."""
    heads = np.searchsorted(law.state[0], cells.start)
    taken, least = np.diff(law.t[heads], append=law.duration), _least(cells, road)
    slow = (taken > SLOW * least) & (cells.together >= 0)
    same = np.diff(_spans(cells.together)) == 0
    wide = slow.copy()
    wide[1:] |= slow[:-1] & same
    wide[:-1] |= slow[1:] & same
    number = np.cumsum(np.diff(wide, prepend=False) | np.append(True, ~same))
    rates = inside(cells, borders)
    for k in np.flatnonzero(wide & (np.diff(number, prepend=-1) != 0)).tolist():
        last = int(np.searchsorted(number, number[k], side="right")) - 1
        end = int(heads[last + 1]) if last + 1 < len(heads) else len(law.t)
        s = float(cells.start[k]), float(cells.start[last] + cells.length[last])
        rate = float(rates[0][k]), float(rates[1][last])
        time, soonest = (float(each[k : last + 1].sum()) for each in (taken, least))
        gained = time - soonest - _changing(rate, (s[1] - s[0]) / soonest, road.limits)
        if gained > max(WORTH[0], WORTH[1] * time):
            yield Stretch(slice(int(heads[k]), end), s, rate, gained)


def _least(cells: Cells, road: Road) -> Array:
    """(K,) s that cells would take if each place were passed at the speed that it allows by itself."""
    path, limits = road.path, road.limits
    steady = np.minimum(road.speed, road.bends.speed(0.0, limits, road.room))
    passed = np.concatenate(([0.0], np.cumsum(path.lengths() / steady)))
    places = np.append(path.start, path.end)
    return np.asarray(
        np.diff(np.interp(np.append(cells.start, cells.start[-1] + cells.length[-1]), places, passed))
    )


def _changing(rate: tuple[float, float], speed: float, limits: MotionLimits) -> float:
    """s that getting from the speeds at both ends to a mean one takes longer than having it, m/s each."""
    change = np.maximum(speed - np.array(rate), 0.0)
    time = change_time(change, np.array(limits.acceleration), np.array(limits.jerk))
    return float((time * change).sum() / (2 * speed))


def _spans(together: Ints) -> Ints:
    """(K,) numbers of rows of cells of which up to AT_ONCE follow one another."""
    begins = np.diff(together >= 0, prepend=False) | (together < 0)
    first = np.maximum.accumulate(np.where(begins, np.arange(len(together)), 0))
    part = (together - together[first]) // AT_ONCE
    return np.cumsum(begins | (np.diff(part, prepend=0) != 0))
