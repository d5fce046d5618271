"""Fewer vertices that look the same: what a line between neighbours already says is left out."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cdhr_host.values import Array, Flags, Ints

PASSES: Final = 8
"""each at most halves; the tolerances of all passes add up to less than one"""
CHUNK: Final = 50_000
"""vertices gathered before they are thinned"""


def thinned(rows: Array, scale: Array, breaks: Flags) -> Ints:
    """(M, k) vertices, (k,) tolerances, (M,) kinds -> (M',) indices of the vertices to keep.

    Every vertex left out is within the tolerances of the polyline that is kept: the first three
    columns together, each other column by itself (0 leaves a column out of account). Where the kind changes,
    vertices stay; so do the first and the last.
    """
    kept = np.arange(len(rows))
    spread = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0.0)
    scaled = rows * spread.astype(rows.dtype)
    for turn in range(PASSES):
        kept = kept[~_spare(scaled[kept], breaks[kept], 2.0 ** (turn - PASSES))]
    return kept


class Thinner:
    """A polyline kept within a budget of vertices while it grows without end.

    ``scale`` as for ``thinned``, to begin with; it doubles whenever twice the budget is held.
    ``kinds`` tells the kind of each row; the dtype of the rows is kept.
    """

    def __init__(self, scale: Array, kinds: Callable[[Array], Flags], budget: int) -> None:
        self._scale, self._kinds, self._budget = scale, kinds, budget
        self._gathered: list[Array] = []
        self._thin: list[Array] = []
        self.coarser = 1.0
        """how many times the tolerances to begin with"""

    def add(self, rows: Array) -> None:
        """Append (M, k) vertices."""
        self._gathered.append(rows)
        if sum(map(len, self._gathered)) >= CHUNK:
            self._settle()

    def vertices(self) -> Array:
        """(M, k), M at most the budget; empty (0, k) where none came."""
        self._settle()
        while len(rows := self._whole()) > self._budget:
            self._coarsen(rows)
        return rows

    def _settle(self) -> None:
        if self._gathered:
            self._thin.append(self._thinned(np.concatenate(self._gathered)))
            self._gathered = []
        if sum(map(len, self._thin)) > 2 * self._budget:
            self._coarsen(self._whole())

    def _coarsen(self, rows: Array) -> None:
        self.coarser *= 2.0
        self._thin = [self._thinned(rows)]

    def _thinned(self, rows: Array) -> Array:
        return rows[thinned(rows, self.coarser * self._scale, self._kinds(rows))]

    def _whole(self) -> Array:
        return np.concatenate(self._thin) if self._thin else np.zeros((0, len(self._scale)))


def _spare(rows: Array, breaks: Flags, tolerance: float) -> Flags:
    """(M,) which odd vertices lie on the line between their neighbours."""
    spare = np.zeros(len(rows), dtype=np.bool_)
    middle = np.arange(1, len(rows) - 1, 2)
    before, here, after = rows[middle - 1], rows[middle], rows[middle + 1]
    away = np.abs(here - before - _share(before, here, after)[:, None] * (after - before))
    off = np.maximum(np.sqrt((away[:, :3] ** 2).sum(axis=1)), away[:, 3:].max(axis=1, initial=0.0))
    same = (breaks[middle - 1] == breaks[middle]) & (breaks[middle] == breaks[middle + 1])
    spare[middle] = (off <= tolerance) & same
    return spare


def _share(before: Array, here: Array, after: Array) -> Array:
    """(M,): how far along from ``before`` to ``after`` the foot of ``here`` lies, 0 to 1."""
    way, part = (after - before)[:, :3], (here - before)[:, :3]
    square = (way**2).sum(axis=1)
    share = np.divide((way * part).sum(axis=1), square, out=np.full(len(way), 0.5), where=square > 0.0)
    return np.asarray(np.clip(share, 0.0, 1.0))
