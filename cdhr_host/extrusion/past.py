"""What has been decided about the air, tick by tick on the axis of arrival, so that it can be revised."""

from typing import Final

import numpy as np

from cdhr_host.extrusion.wanted import NEVER, Wanted
from cdhr_host.values import Array, Flags

REMEMBERED: Final = 30_000
"""ticks at least: more than any link buffers"""
LEVEL, KEPT, REACHED, WANTED, SINCE = range(5)


class Past:
    """Columns over consecutive ticks, the latest of them remembered."""

    def __init__(self) -> None:
        self._columns = np.zeros((5, 0))
        self._first = 0

    @property
    def empty(self) -> bool:
        """Whether nothing has begun."""
        return self._columns.shape[1] == 0

    @property
    def end(self) -> int:
        """The first tick nothing is decided about."""
        return self._first + self._columns.shape[1]

    @property
    def level(self) -> float:
        """Pa fed to the regulator's lag at the last tick."""
        return float(self._columns[LEVEL, -1])

    @property
    def reached(self) -> float:
        """Pa the regulator has reached."""
        return float(self._columns[REACHED, -1])

    @property
    def wanted(self) -> float:
        """Pa wanted at the clay at the last tick."""
        return float(self._columns[WANTED, -1])

    @property
    def since(self) -> int:
        """Ticks since clay flowed last."""
        return int(self._columns[SINCE, -1])

    def begin(self, tick: int, dead: int) -> None:
        """Nothing arrives before ``dead`` ticks after ``tick``, whatever is sent."""
        self._columns = np.zeros((5, dead + 1))
        self._columns[SINCE] = NEVER
        self._first = tick - 1

    def add(self, level: Array, reached: Array, plan: Wanted) -> None:
        """N further ticks; what is planned may be known beyond them."""
        count = len(level)
        at = np.maximum.accumulate(np.where(level > 0.0, np.arange(1, count + 1), 0))
        kept = np.concatenate((self._columns[KEPT, -1:], level))[at]
        columns = level, kept, reached, plan.pressure[:count], plan.since[:count]
        self._columns = np.hstack((self._columns, np.vstack(columns)))

    def cut(self, end: int) -> bool:
        """Forget what was decided from tick ``end`` on; whether that is now the end."""
        if end >= self.end:
            return end == self.end
        if end <= self._first:
            raise ValueError(f"the air of tick {end} is not remembered, only of {self._first + 1} and later")
        self._columns = self._columns[:, : end - self._first]
        return True

    def opened(self, first: int, count: int) -> Flags:
        """(count,) whether the air is open at the clay."""
        return np.asarray(self._columns[LEVEL, first - self._first :][:count] > 0.0)

    def levels(self, first: int, count: int) -> Array:
        """(count,) Pa: the level, or the last one before the air was shut."""
        return np.array(self._columns[KEPT, first - self._first :][:count])

    def forget(self) -> None:
        """Drop what nobody can ask for any more."""
        if self._columns.shape[1] > 2 * REMEMBERED:
            self._first += self._columns.shape[1] - REMEMBERED
            self._columns = self._columns[:, -REMEMBERED:].copy()
