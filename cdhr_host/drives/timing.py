"""How punctual a cyclic sender was."""

from dataclasses import dataclass
from typing import Final

import numpy as np

BIN: Final = 1e-6
BINS: Final = 200_000
BUDGET: Final = 3
"""late cycles allowed among the last WINDOW"""
WINDOW: Final = 250
SOFT: Final = 8
"""times BUDGET where soft real time is allowed"""


@dataclass(frozen=True, slots=True)
class CycleTiming:
    """Lateness of the cycles of a run, s."""

    cycles: int
    p50: float
    p99: float
    p999: float
    max: float
    skipped: int
    """cycles that never were, because the one before ended too late"""
    late: int
    """cycles that began more than a period late"""
    real_time: bool
    """whether the sender ran under SCHED_FIFO"""


class Lateness:
    """A histogram of lateness, and the budget of late cycles; nothing grows.

    Two cycles lost in a row are too many, or more than BUDGET in a WINDOW. With ``soft`` > 0
    up to that many in a row pass and SOFT times the budget: the drives stand still meanwhile.
    """

    def __init__(self, soft: int = 0) -> None:
        self.real_time = False
        self._in_a_row = max(soft, 1)
        self._budget = BUDGET * SOFT if soft else BUDGET
        self._bins = np.zeros(BINS, dtype=np.int64)
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self._bins.fill(0)
        self._cycles = self._skipped = self._late = 0
        self._max = 0.0
        self._late_at: list[int] = []
        self._row, self._last = 0, -2

    def woke(self, late: float) -> None:
        """A cycle began ``late`` s after it was due."""
        self._cycles += 1
        self._max = max(self._max, late)
        self._bins[min(int(late / BIN), BINS - 1)] += 1

    def missed(self, skipped: int) -> bool:
        """A cycle came ``skipped`` >= 1 periods too late; whether the budget is exceeded."""
        self._skipped += skipped
        self._late += 1
        row = self._row + skipped if self._cycles - self._last <= 1 else skipped
        self._row, self._last = row, self._cycles
        self._late_at = [*(at for at in self._late_at if at > self._cycles - WINDOW), self._cycles]
        return row > self._in_a_row or len(self._late_at) > self._budget

    def summary(self) -> CycleTiming:
        """So far."""
        below = np.cumsum(self._bins)

        def quantile(share: float) -> float:
            return float(np.searchsorted(below, share * self._cycles)) * BIN if self._cycles else 0.0

        return CycleTiming(
            cycles=self._cycles,
            p50=quantile(0.5),
            p99=quantile(0.99),
            p999=quantile(0.999),
            max=self._max,
            skipped=self._skipped,
            late=self._late,
            real_time=self.real_time,
        )
