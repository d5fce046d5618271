"""How much of its acceleration the cables' forces leave the nozzle, along a drawn path.

A force is f0(q) + B(q) a, affine in the nozzle's acceleration, so |a| <= min (window's end - f0)/|B|
keeps all of them inside their windows, whatever the direction. Where that is less than the usual
limit, near the windows' ends, segments are divided into parts with limits of their own.

A table over the bed tells where nothing need be looked at: in each of its boxes every force's
room is at least its value at the box's corners less what its second differences allow for.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

from cdhr_host.values import Array, Flags, Ints

LOOK: Final = 1e-3
"""m, between two looks along the path"""
PART: Final = 5e-3
"""m, longest part of a divided segment"""
LEVELS: Final = np.append(0.02 * 1.3 ** np.arange(15), 1.0)
"""shares of the acceleration that a part may have; with the least the proof refuses what is outside"""
GRID: Final = (9, 36, 21)
"""places in radius, azimuth and height of the table"""
SAFETY: Final = 1.3
"""on slopes and second differences found between them"""

Room = Callable[[Array], Array]
"""(N, 3) m in G -> (N, K) m/s², the acceleration that each of K ends of windows allows; smooth"""


@dataclass(frozen=True, eq=False)
class AccelerationRoom:
    """Of one machine; without arguments the forces bound nothing."""

    radius: float = 1.0
    """m, of the bed"""
    height: float = 1.0
    """m, of the bed"""
    lag: float = 0.0
    """m, by which input shaping sets the acceleration apart from where it was planned"""
    measure: Room | None = field(default=None, repr=False)

    def along(self, points: Array, acceleration: float, away: float) -> tuple[Ints, Array] | None:
        """Polyline (M+1, 3) m -> (M,) parts of each segment, and their shares of the acceleration, m/s².

        None where all of it may be used all along; the path may leave the polyline by ``away``, m.
        """
        if self.measure is None:
            return None
        usual = acceleration + (away + self.lag) * self._table.slope
        if self._certain(points, usual):
            return None
        lengths = np.sqrt(((points[1:] - points[:-1]) ** 2).sum(axis=1))
        drawn = np.concatenate(([0.0], np.cumsum(lengths)))
        looks = np.linspace(0.0, drawn[-1], int(np.ceil(drawn[-1] / LOOK)) + 1)
        places = np.column_stack([np.interp(looks, drawn, axis) for axis in points.T])
        share = self._shares(places, acceleration, usual)
        if share.min() >= 1.0:
            return None
        tight = _least(share, looks, drawn) < 1.0
        count = np.where(tight, np.maximum(np.ceil(lengths / PART), 1), 1).astype(np.int64)
        part = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        begins = np.repeat(drawn[:-1], count) + part * np.repeat(lengths / count, count)
        return count, _least(share, looks, np.append(begins, drawn[-1]))

    def _shares(self, places: Array, acceleration: float, usual: float) -> Array:
        """(N, 3) m -> (N,): one of LEVELS each; room for ``usual``, m/s², is enough for the acceleration."""
        assert self.measure is not None
        share = np.ones(len(places))
        near = np.flatnonzero(self._doubtful(places, usual))
        if len(near):
            room = self.measure(places[near]).min(axis=1) - (usual - acceleration)
            level = np.searchsorted(LEVELS, room / acceleration, side="right") - 1
            share[near] = LEVELS[np.maximum(level, 0)]
        return share

    def _certain(self, points: Array, usual: float) -> bool:
        """Whether no box between the heights and out to the radius of these points needs a look."""
        ring, _, layer = self._boxes(points)
        around = self._table.least[: ring.max() + 1, :, layer.min() : layer.max() + 1]
        return bool(around.min() >= usual)

    def _doubtful(self, places: Array, usual: float) -> Flags:
        """(N,) whether the room must be measured; outside the bed nothing moves anyway."""
        x, y, z = places.T
        inside = (x**2 + y**2 <= self.radius**2) & (z >= 0.0) & (z <= self.height)
        return np.asarray((self._table.least[self._boxes(places)] < usual) & inside, dtype=np.bool_)

    def _boxes(self, places: Array) -> tuple[Ints, Ints, Ints]:
        """(N, 3) m -> the box each is in, or the nearest one."""
        x, y, z = places.T
        ring = np.hypot(x, y) / self.radius * (GRID[0] - 1)
        turn = np.arctan2(y, x) / (2 * np.pi) * GRID[1]
        layer = z / self.height * (GRID[2] - 1)
        return (
            np.clip(ring.astype(np.int64), 0, GRID[0] - 2),
            np.floor(turn).astype(np.int64) % GRID[1],
            np.clip(layer.astype(np.int64), 0, GRID[2] - 2),
        )

    @cached_property
    def _table(self) -> "_Table":
        assert self.measure is not None
        r, turn, z = np.meshgrid(
            np.linspace(0.0, self.radius, GRID[0]),
            np.arange(GRID[1]) * (2 * np.pi / GRID[1]),
            np.linspace(0.0, self.height, GRID[2]),
            indexing="ij",
        )
        places = np.stack((r * np.cos(turn), r * np.sin(turn), z), axis=-1).reshape(-1, 3)
        room = self.measure(places).reshape(*GRID, -1)
        return _Table.of(room, self.radius, self.height)


@dataclass(frozen=True, slots=True)
class _Table:
    """What is known over the bed."""

    least: Array
    """GRID, m/s²: no place in the box that begins here has less room"""
    slope: float
    """1/s²: the most any room changes for each metre"""

    @classmethod
    def of(cls, room: Array, radius: float, height: float) -> "_Table":
        """Rooms (*GRID, K) m/s² at the boxes' corners."""
        around = np.concatenate((room[:, -1:], room, room[:, :2]), axis=1)
        bent = [np.abs(np.diff(each, 2, axis=axis)) for axis, each in enumerate((room, around, room))]
        bend = sum(each.max(axis=(0, 1, 2)) for each in bent) / 8
        steps = radius / (GRID[0] - 1), height / (GRID[2] - 1)
        outwards, upwards = (float(np.abs(np.diff(room, axis=axis)).max()) for axis in (0, 2))
        sideways = np.abs(np.diff(around, axis=1)).max(axis=(1, 2, 3))[1:]
        arcs = 2 * np.pi / GRID[1] * steps[0] * np.arange(1, GRID[0])
        gradient = outwards / steps[0], upwards / steps[1], float((sideways / arcs).max())
        slope = SAFETY * math.hypot(*gradient)
        return cls((_smallest(around[:, 1:-1]) - SAFETY * bend).min(axis=-1), slope)


def _smallest(room: Array) -> Array:
    """(I, J + 1, L, K) at corners -> (I, J, L, K): the least of the eight of each box."""
    for axis in range(3):
        after = np.roll(room, -1, axis=axis)
        if axis != 1:
            last = [slice(None)] * 4
            last[axis] = slice(-1, None)
            after[tuple(last)] = room[tuple(last)]
        room = np.minimum(room, after)
    return room[:, :-1]


def _least(share: Array, looks: Array, borders: Array) -> Array:
    """(N,), (N,), (K+1,) m -> (K,): the least share between two borders, and one look beyond each."""
    first = np.maximum(np.searchsorted(looks, borders[:-1], side="right") - 1, 0)
    last = np.minimum(np.searchsorted(looks, borders[1:], side="left") + 1, len(share))
    rows = np.column_stack((first, last)).ravel()
    return np.asarray(np.minimum.reduceat(np.append(share, np.inf), rows)[::2], dtype=np.float64)


ALL: Final = AccelerationRoom()
"""Cables that bear any acceleration."""
