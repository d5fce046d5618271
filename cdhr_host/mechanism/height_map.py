"""How high the print stands, cell by cell, and which line of the program made it so."""

import itertools

import numpy as np

from cdhr_host.values import Array, Flags, Ints


class HeightMap:
    """Square cells over the bed in program coordinates; only ever grows."""

    def __init__(self, radius: float, cell: float) -> None:
        """An empty bed of ``radius``, m."""
        self.cell = cell
        self.top = 0.0
        """m: highest so far"""
        self.radius = 0.0
        """m: farthest from the axis so far, with the cells around it"""
        self._half = int(np.ceil(radius / cell)) + 3
        size = 2 * self._half + 1
        self._height = np.zeros((size, size))
        self._line = np.zeros((size, size), dtype=np.int64)
        self._last: Array | None = None

    def lay(self, nozzle_G: Array, line: Ints, clay: Flags) -> None:
        """(N, 3) m, (N,), (N,): nozzle positions in order; clay is laid on the way to those marked.

        The way from the sample before (of the block before, too) is straight.
        """
        before = nozzle_G[:1] if self._last is None else self._last[None]
        start = np.concatenate([before, nozzle_G[:-1]])
        self._last = nozzle_G[-1].copy()
        if clay.any():
            self._raise(start[clay], nozzle_G[clay], line[clay])

    def at(self, x: Array, y: Array) -> tuple[Array, Ints]:
        """Any shape, m -> heights, m, and lines; clay counts in the cells around its own, too."""
        i, j = self._cells(x, y)
        return self._height[i, j], self._line[i, j]

    def _raise(self, start: Array, end: Array, line: Ints) -> None:
        step = np.linalg.norm(end - start, axis=1)
        pieces = 1 + (2.0 * step / self.cell).astype(np.int64)
        whole = np.repeat(np.arange(len(pieces)), pieces)
        part = (np.arange(len(whole)) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 1) / pieces[whole]
        points = start[whole] + part[:, None] * (end - start)[whole]
        order = np.argsort(points[:, 2], kind="stable")
        points, line = points[order], line[whole[order]]
        i, j = self._cells(points[:, 0], points[:, 1])
        for di, dj in itertools.product((-1, 0, 1), repeat=2):
            self._raise_cells(i + di, j + dj, points[:, 2], line)
        self.top = max(self.top, float(points[-1, 2]))
        far = float(np.hypot(points[:, 0], points[:, 1]).max()) + 3.0 * self.cell
        self.radius = max(self.radius, far)

    def _raise_cells(self, i: Ints, j: Ints, z: Array, line: Ints) -> None:
        """By ascending z."""
        higher = z > self._height[i, j]
        self._line[i[higher], j[higher]] = line[higher]
        np.maximum.at(self._height, (i, j), z)

    def _cells(self, x: Array, y: Array) -> tuple[Ints, Ints]:
        """Numbers of cells; places beyond the map are in its empty border."""
        edge = self._half - 1
        i = np.clip(np.rint(x / self.cell), -edge, edge).astype(np.int64)
        j = np.clip(np.rint(y / self.cell), -edge, edge).astype(np.int64)
        return i + self._half, j + self._half
