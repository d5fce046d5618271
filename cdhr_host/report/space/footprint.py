"""The places a program goes to, fed during its proof: one for each small cube of space."""

from typing import Final

import numpy as np

from cdhr_host.pipeline import Checked
from cdhr_host.units import MM
from cdhr_host.values import Array, Ints

EDGE: Final = 2.0 * MM
"""m: edge of the cubes to begin with"""
MOST: Final = 60_000
"""cubes held; their edge doubles when there are more"""
CHUNK: Final = 50_000
"""samples gathered before they are sorted into cubes"""


class Footprint:
    """Places from the first to the last at which clay is laid, travel between them included."""

    def __init__(self) -> None:
        self.edge = EDGE
        self._places, self._lines = np.zeros((0, 3)), np.zeros(0, dtype=np.int64)
        self._gathered: list[tuple[Array, Ints]] = []
        self._travel: list[tuple[Array, Ints]] = []
        self._begun = False

    def watch(self, checked: Checked) -> None:
        """Take in a block of a proof."""
        track = checked.track
        laid = np.flatnonzero(track.flow > 0.0)
        if not laid.size:
            if self._begun:
                self._travel.append((track.position_G, track.line))
            return
        first = 0 if self._begun else int(laid[0])
        last = int(laid[-1]) + 1
        self._gathered += [*self._travel, (track.position_G[first:last], track.line[first:last])]
        self._travel = [(track.position_G[last:], track.line[last:])]
        self._begun = True
        if sum(len(line) for _, line in self._gathered) > CHUNK:
            self._settle()

    def places(self) -> tuple[Array, Ints]:
        """(N, 3) m ``_G``, (N,) lines; N is 0 for a program that lays no clay."""
        self._settle()
        return self._places, self._lines

    def _settle(self) -> None:
        parts = [(self._places, self._lines), *self._gathered]
        places = np.concatenate([place for place, _ in parts])
        lines = np.concatenate([line for _, line in parts])
        self._gathered = []
        self._places, self._lines = self._cubes(places, lines)
        while len(self._lines) > MOST:
            self.edge *= 2.0
            self._places, self._lines = self._cubes(self._places, self._lines)

    def _cubes(self, places: Array, lines: Ints) -> tuple[Array, Ints]:
        _, first = np.unique(np.floor(places / self.edge), axis=0, return_index=True)
        kept = np.sort(first)
        return places[kept], lines[kept]
