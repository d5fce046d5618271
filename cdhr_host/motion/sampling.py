"""Stretches -> samples: which ticks fall on a stretch, and what the nozzle does at them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.leg import Leg
from cdhr_host.motion.shaping import UNSHAPED, Shaper
from cdhr_host.motion.vectors import norms
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
    number: int = 0
    """of the drawn leg that follows"""


Stretch = Leg | Stand


@dataclass(frozen=True, slots=True)
class Laid:
    """A stretch on the time axis."""

    stretch: Stretch
    begin: float
    """s since the program's start"""

    def track(self, tick: Ints, t: Array) -> ToolTrack:
        """(N,) ticks, and the times (N,) s at which this stretch is asked for them."""
        if isinstance(self.stretch, Stand):
            return _standing(self.stretch, tick)
        return _moving(self.stretch, tick, self.elapsed(t))

    def elapsed(self, t: Array) -> Array:
        """(N,) s -> (N,) s since the stretch began, but never before it or after its end."""
        since: Array = np.clip(t - self.begin, 0.0, self.stretch.duration)
        return since


@dataclass(frozen=True, slots=True)
class Timed:
    """A stretch with the ticks that fall on it, and what the shaper still sees of earlier ones."""

    laid: tuple[Laid, ...]
    """in order; the last is the stretch itself"""
    ticks: range
    period: float
    """s"""
    shaper: Shaper

    @property
    def stretch(self) -> Stretch:
        """The stretch itself."""
        return self.laid[-1].stretch

    @property
    def settling(self) -> range:
        """Ticks at which the shaper still looks back to earlier stretches."""
        end = math.ceil((self.laid[-1].begin + self.shaper.length) / self.period)
        return range(self.ticks.start, min(max(end, self.ticks.start), self.ticks.stop))

    def tracks(self) -> Iterator[ToolTrack]:
        """Every tick, in blocks."""
        for first in range(self.ticks.start, self.ticks.stop, BLOCK):
            yield self.track(np.arange(first, min(first + BLOCK, self.ticks.stop)))

    @property
    def begin(self) -> float:
        """Tick, not a whole one, at which the stretch itself begins, before any shaping."""
        return self.laid[-1].begin / self.period

    def unshaped(self, tick: Ints, u: Array) -> ToolTrack:
        """(N,) ticks to be named by, and the times (N,) in ticks of the plan -> the stretch at them."""
        return self.laid[-1].track(tick, u * self.period)

    def track(self, tick: Ints) -> ToolTrack:
        """(N,) ascending ticks of this stretch -> the nozzle at them."""
        copies = [self._copy(tick, tick * self.period - delay) for delay in self.shaper.delay]
        return copies[0] if len(copies) == 1 else mean(copies, self.shaper)

    def _copy(self, tick: Ints, t: Array) -> ToolTrack:
        """The unshaped nozzle at times t (N,) s, ascending, perhaps reaching back."""
        begins = [each.begin for each in self.laid[1:]]
        cuts = [0, *np.searchsorted(t, begins).tolist(), len(t)]
        parts = [
            each.track(tick[cuts[k] : cuts[k + 1]], t[cuts[k] : cuts[k + 1]])
            for k, each in enumerate(self.laid)
            if cuts[k + 1] > cuts[k]
        ]
        return parts[0] if len(parts) == 1 else ToolTrack.joined(parts)


class Timeline:
    """Lays stretches one after the other, on ticks of one period.

    A ``rest`` stands for ``still`` ticks more: sliders that follow a cable's stretch give way to the
    forces of the last moving tick.
    """

    def __init__(self, period: float, shaper: Shaper = UNSHAPED, *, still: int = 0) -> None:
        self.period = period
        self._still = still
        self.shaper = shaper
        self._laid: tuple[Laid, ...] = ()
        self._time = 0.0
        self._tick = 0

    @property
    def tick(self) -> int:
        """The first that is not taken yet."""
        return self._tick

    @property
    def now(self) -> float:
        """s since the program's start at which the next stretch begins."""
        return self._time

    def lay(self, stretch: Stretch) -> Timed:
        """The next stretch, from where the last one ended."""
        laid = self._add(stretch)
        self._time += stretch.duration
        return self._timed(laid, max(math.ceil(self._time / self.period - EARLY), self._tick))

    def rest(self, stand: Stand) -> Timed:
        """Stand until the first tick at which nothing moves any more; the next stretch begins there."""
        laid = self._add(stand)
        still = self._time + self.shaper.length
        last = max(math.ceil(still / self.period - EARLY), self._tick) + self._still
        self._time = last * self.period
        return self._timed(laid, last + 1)

    def reserve(self, count: int) -> range:
        """Ticks for what moves while the nozzle stands; only after ``rest``, or at the very start."""
        ticks = range(self._tick, self._tick + count)
        self._tick = ticks.stop
        self._time = (ticks.stop - 1) * self.period
        self._laid = ()
        return ticks

    def _add(self, stretch: Stretch) -> tuple[Laid, ...]:
        """The stretch behind those that the shaper still sees from its begin on."""
        seen = self._time - self.shaper.length
        ends = [*(each.begin for each in self._laid[1:]), self._time]
        kept = [each for each, end in zip(self._laid, ends, strict=False) if end > seen]
        self._laid = (*kept, Laid(stretch, self._time))
        return self._laid

    def _timed(self, laid: tuple[Laid, ...], end: int) -> Timed:
        ticks, self._tick = range(self._tick, end), end
        return Timed(laid, ticks, self.period, self.shaper)


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
    speed = norms(velocity)
    carried = leg.segments
    air = np.where(speed > 0.0, carried.air[segment], 0.0)
    flow = carried.clay[segment] * speed
    return ToolTrack(tick, carried.line[segment], position, velocity, acceleration, flow, air)


def mean(copies: list[ToolTrack], shaper: Shaper) -> ToolTrack:
    """The weighted mean of copies; line and air words are those of the middle one."""
    named = copies[shaper.middle]
    position, velocity, acceleration, flow = (
        np.tensordot(shaper.weight, np.stack([getattr(copy, name) for copy in copies]), axes=1)
        for name in ("position_G", "velocity", "acceleration", "flow")
    )
    return ToolTrack(named.tick, named.line, position, velocity, acceleration, flow, named.air)
