"""How high the print stands, cell by cell, and which line of the program made it so."""

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
        """m: farthest from the axis so far, with its cell"""
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
        """Any shape, m -> heights, m, and lines, the highest of nine cells; nothing beyond the map."""
        i, j = self._cells(x, y)
        height, line = np.zeros(x.shape), np.zeros(x.shape, dtype=np.int64)
        for di in (-1, 0, 1):
            for dj in (-1, 0, 1):
                near = self._height[i + di, j + dj]
                higher = near > height
                height = np.where(higher, near, height)
                line = np.where(higher, self._line[i + di, j + dj], line)
        return height, line

    def _raise(self, start: Array, end: Array, line: Ints) -> None:
        step = np.linalg.norm(end - start, axis=1)
        pieces = 1 + (2.0 * step / self.cell).astype(np.int64)
        whole = np.repeat(np.arange(len(pieces)), pieces)
        part = (np.arange(len(whole)) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 1) / pieces[whole]
        points = start[whole] + part[:, None] * (end - start)[whole]
        i, j = self._cells(points[:, 0], points[:, 1])
        order = np.argsort(points[:, 2], kind="stable")
        i, j, points, whole = i[order], j[order], points[order], whole[order]
        higher = points[:, 2] > self._height[i, j]
        self._line[i[higher], j[higher]] = line[whole[higher]]
        np.maximum.at(self._height, (i, j), points[:, 2])
        self.top = max(self.top, float(points[-1, 2]))
        far = float(np.hypot(points[:, 0], points[:, 1]).max()) + self.cell
        self.radius = max(self.radius, far)

    def _cells(self, x: Array, y: Array) -> tuple[Ints, Ints]:
        """Numbers of cells; places beyond the map are in its empty border."""
        edge = self._half - 1
        i = np.clip(np.rint(x / self.cell), -edge, edge).astype(np.int64)
        j = np.clip(np.rint(y / self.cell), -edge, edge).astype(np.int64)
        return i + self._half, j + self._half
