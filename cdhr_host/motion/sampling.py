"""Stretches -> samples: which ticks fall on a stretch, and what the nozzle does at them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.leg import Leg
from cdhr_host.values import Array, Ints, ToolTrack

BLOCK = 4096
"""Samples handed on at a time."""
EARLY = 1e-9
"""Share of a period by which a tick may come early through rounding."""


@dataclass(frozen=True, slots=True)
class Stand:
    """Standing still, perhaps pushing clay."""

    at_G: Array
    """(3,) m"""
    duration: float
    """s"""
    flow: float
    """m³/s"""
    line: int


Stretch = Leg | Stand


@dataclass(frozen=True, slots=True)
class Timed:
    """A stretch on the time axis, with the ticks that fall on it."""

    stretch: Stretch
    begin: float
    """s since the program's start"""
    ticks: range
    period: float
    """s"""

    def tracks(self) -> Iterator[ToolTrack]:
        """Every tick, in blocks."""
        for first in range(self.ticks.start, self.ticks.stop, BLOCK):
            yield self.track(np.arange(first, min(first + BLOCK, self.ticks.stop)))

    def track(self, tick: Ints) -> ToolTrack:
        """(N,) ticks of this stretch -> the nozzle at them."""
        if isinstance(self.stretch, Stand):
            return _standing(self.stretch, tick)
        t = np.clip(tick * self.period - self.begin, 0.0, self.stretch.duration)
        return _moving(self.stretch, tick, t)


class Timeline:
    """Lays stretches one after the other, on ticks of one period."""

    def __init__(self, period: float) -> None:
        self.period = period
        self._time = 0.0
        self._tick = 0

    def lay(self, stretch: Stretch) -> Timed:
        """The next stretch, from where the last one ended."""
        begin, self._time = self._time, self._time + stretch.duration
        end = max(math.ceil(self._time / self.period - EARLY), self._tick)
        ticks, self._tick = range(self._tick, end), end
        return Timed(stretch, begin, ticks, self.period)

    def rest(self, stand: Stand) -> Timed:
        """Stand until the first tick at which nothing moves has passed; the next stretch begins there."""
        last = max(math.ceil(self._time / self.period - EARLY), self._tick)
        timed = Timed(stand, self._time, range(self._tick, last + 1), self.period)
        self._tick, self._time = last + 1, last * self.period
        return timed


def _standing(stand: Stand, tick: Ints) -> ToolTrack:
    still, nothing = np.zeros((len(tick), 3)), np.zeros(len(tick))
    line = np.full(len(tick), stand.line)
    return ToolTrack(tick, line, still + stand.at_G, still, still.copy(), nothing + stand.flow, nothing)


def _moving(leg: Leg, tick: Ints, t: Array) -> ToolTrack:
    """The nozzle at times t (N,) s since the leg began."""
    s, rate, change = leg.law.at(t)
    piece, position, slope, bend = leg.path.at(s)
    velocity = slope * rate[:, None]
    acceleration = bend * (rate**2)[:, None] + slope * change[:, None]
    segment = leg.path.segment[piece]
    speed = np.sqrt(np.einsum("nk,nk->n", velocity, velocity))
    carried = leg.segments
    air = np.where(speed > 0.0, carried.air[segment], 0.0)
    flow = carried.clay[segment] * speed
    return ToolTrack(tick, carried.line[segment], position, velocity, acceleration, flow, air)
