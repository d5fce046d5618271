"""A long record in few intervals: the least and the greatest of each, so that no peak is lost."""

from typing import Final

import numpy as np

from cdhr_host.values import Array

INTERVALS: Final = 1500
"""at least, of a record that has as many rows; at most twice as many"""


class Envelope:
    """Extremes of k columns over intervals of equally many rows, which double as the record grows."""

    def __init__(self, intervals: int = INTERVALS) -> None:
        self._most = 2 * intervals
        self.span = 1
        """rows in an interval"""
        self._rest: Array | None = None
        self._low: list[Array] = []
        self._high: list[Array] = []
        self._held = 0

    def add(self, rows: Array) -> None:
        """Append (N, k) rows; NaN is no extreme."""
        rows = rows if self._rest is None else np.concatenate([self._rest, rows])
        while len(rows) >= self.span:
            taken = min(len(rows) // self.span, self._most - self._held)
            self._keep(rows[: taken * self.span].reshape(taken, self.span, rows.shape[1]))
            rows = rows[taken * self.span :]
            if self._held == self._most:
                self._double()
        self._rest = rows

    def extremes(self) -> tuple[Array, Array]:
        """Two (B, k): least and greatest of each interval; the last may have fewer rows."""
        low, high = [*self._low], [*self._high]
        if self._rest is not None and len(self._rest):
            low.append(np.fmin.reduce(self._rest)[None])
            high.append(np.fmax.reduce(self._rest)[None])
        if not low:
            return np.zeros((0, 0)), np.zeros((0, 0))
        return np.concatenate(low), np.concatenate(high)

    def _keep(self, parts: Array) -> None:
        """(B, span, k): whole intervals."""
        self._low.append(np.fmin.reduce(parts, axis=1))
        self._high.append(np.fmax.reduce(parts, axis=1))
        self._held += len(parts)

    def _double(self) -> None:
        low, high = np.concatenate(self._low), np.concatenate(self._high)
        pairs = (-1, 2, low.shape[1])
        self._low, self._high = (
            [np.fmin.reduce(low.reshape(pairs), axis=1)],
            [np.fmax.reduce(high.reshape(pairs), axis=1)],
        )
        self._held //= 2
        self.span *= 2
