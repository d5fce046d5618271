"""Playback: at which time of the plan, u, the machine is at time t. Both count drive ticks.

With the plan x(u) and the rate r = du/dt the machine does
    x'  = r v
    x'' = r² a + r' v
    x''' = r³ j + 3 r r' a + r'' v,
so where r, r' and r'' are continuous, x is as smooth as the plan. A hold is a ramp of r to 0,
a resume one back to 1; an override below 100 % is a constant r < 1. r never exceeds 1: faster
than planned is planned anew.

A ramp is a polynomial: r over z = (t - begin) / duration is the quintic that continues r, r',
r'' and ends at its target with r' = r'' = 0, plus c z³ (1 - z)³, which changes none of these
but how much of the plan is played. So a ramp to 1 can land on a whole tick of the plan, and
what follows is the plan itself, row for row.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cdhr_host.values import Array, ToolTrack

BUMP = np.array([0.0, 0.0, 0.0, 1.0, -3.0, 3.0, -1.0])
"""z³ (1 - z)³, by powers of z"""
BUMP_AREA = 1.0 / 140.0
WHOLE = 1e-9
"""ticks from a whole one that are rounding"""
NEARLY_WHOLE = 1e-6
"""the same after a ramp that lands"""


class Beat(NamedTuple):
    """Playback at one moment, or (N,) of each."""

    u: Array
    """ticks of the plan"""
    rate: Array
    """du/dt"""
    slope: Array
    """1/tick, its change"""


@dataclass(frozen=True, slots=True)
class Ramp:
    """The rate from one tick on, a polynomial in time; constant where the duration is infinite."""

    begin: float
    """tick"""
    duration: float
    """ticks"""
    u: float
    """ticks of the plan at the beginning"""
    rate: Array
    """(K,) by powers of z, of t - begin where the duration is infinite"""

    @property
    def end(self) -> float:
        """tick"""
        return self.begin + self.duration

    def at(self, t: Array) -> Beat:
        """(N,) ticks of this ramp -> playback at them."""
        scale = self._scale
        z: Array = (t - self.begin) / scale
        return Beat(
            self.u + scale * _value(_areas(self.rate), z),
            _value(self.rate, z),
            _value(_slopes(self.rate), z) / scale,
        )

    def start(self, t: float) -> "Start":
        """What a ramp from a tick on continues."""
        scale = self._scale
        z = (t - self.begin) / scale
        area = rate = slope = bend = 0.0
        for power, c in reversed(list(enumerate(self.rate.tolist()))):
            area = area * z + c / (power + 1)
            bend, slope, rate = bend * z + 2.0 * slope, slope * z + rate, rate * z + c
        return Start(t, self.u + scale * area * z, rate, slope / scale, bend / scale**2)

    @property
    def _scale(self) -> float:
        return self.duration if math.isfinite(self.duration) else 1.0


def _value(powers: Array, z: Array) -> Array:
    """(K,) coefficients by ascending powers, (N,) -> (N,)."""
    value = np.full(len(z), powers[-1])
    for power in powers[-2::-1]:
        value = value * z + power
    return value


def _areas(powers: Array) -> Array:
    """(K,) coefficients by ascending powers -> (K + 1,) of the integral from 0."""
    return np.concatenate(([0.0], powers / np.arange(1.0, len(powers) + 1.0)))


def _slopes(powers: Array) -> Array:
    """(K,) coefficients by ascending powers -> those of the derivative."""
    return np.concatenate((powers[1:] * np.arange(1.0, len(powers)), [0.0]))


def steady(begin: float, u: float, rate: float) -> Ramp:
    """A constant rate from a tick on."""
    return Ramp(begin, math.inf, u, np.array([rate]))


@dataclass(frozen=True, slots=True)
class Start:
    """What a ramp continues."""

    tick: float
    u: float
    rate: float
    slope: float = 0.0
    """1/tick"""
    bend: float = 0.0
    """1/tick²"""


def ramp(start: Start, duration: float, target: float) -> Ramp:
    """The quintic from a start to a constant rate, over ``duration`` ticks."""
    a0, a1, a2 = start.rate, start.slope * duration, start.bend * duration**2 / 2.0
    value, first, second = target - a0 - a1 - a2, -a1 - 2.0 * a2, -2.0 * a2
    a3 = 10.0 * value - 4.0 * first + second / 2.0
    a4 = -15.0 * value + 7.0 * first - second
    a5 = 6.0 * value - 3.0 * first + second / 2.0
    return Ramp(start.tick, duration, start.u, np.array([a0, a1, a2, a3, a4, a5, 0.0]))


def landing(start: Start, duration: float, target: float) -> Ramp:
    """As ``ramp``, slower in between so that it ends where u and t differ by whole ticks."""
    plain = ramp(start, duration, target)
    beyond = _after(plain, target).u - plain.end
    short = beyond - math.floor(beyond + WHOLE)
    return replace(plain, rate=plain.rate - short / duration / BUMP_AREA * BUMP)


def _after(ramped: Ramp, target: float) -> Ramp:
    """The constant rate a ramp leads to."""
    return steady(ramped.end, ramped.start(ramped.end).u, target)


@dataclass(frozen=True, slots=True)
class Pace:
    """Playback over all time: ramps one after the other, the last one constant."""

    ramps: tuple[Ramp, ...]

    @classmethod
    def of(cls, *, tick: float = 0.0, u: float = 0.0, rate: float = 1.0) -> "Pace":
        """A constant rate."""
        return cls((steady(tick, u, rate),))

    @property
    def target(self) -> float:
        """The rate in the end."""
        return float(self.ramps[-1].rate[0])

    @property
    def settled(self) -> float:
        """Tick from which on the rate is constant."""
        return self.ramps[-1].begin

    def at(self, t: Array) -> Beat:
        """(N,) ascending ticks -> playback at them; before the first ramp as it would have begun."""
        cuts = [0, *np.searchsorted(t, [each.begin for each in self.ramps[1:]]).tolist(), len(t)]
        parts = [
            each.at(t[cuts[k] : cuts[k + 1]])
            for k, each in enumerate(self.ramps)
            if cuts[k + 1] > cuts[k] or len(t) == 0
        ]
        return (
            parts[0]
            if len(parts) == 1
            else Beat(*(np.concatenate(part) for part in zip(*parts, strict=True)))
        )

    def start(self, t: float) -> Start:
        """What a ramp from a tick on continues."""
        piece = next(each for each in reversed(self.ramps) if each.begin <= t or each is self.ramps[0])
        return piece.start(t)

    def whole(self, first: float) -> bool:
        """Whether from this tick on the plan is played as it is, tick for tick."""
        last = self.ramps[-1]
        return first >= last.begin and self.target == 1.0 and float(last.u - last.begin).is_integer()

    def then(self, ramped: Ramp) -> "Pace":
        """As it is up to a ramp's beginning, then the ramp, then what it leads to."""
        target = _target(ramped)
        after = _after(ramped, target)
        whole = round(after.u - after.begin)
        if target == 1.0 and abs(after.u - after.begin - whole) < NEARLY_WHOLE:
            after = steady(after.begin, after.begin + whole, 1.0)
        return Pace((*self._before(ramped.begin), ramped, after))

    def since(self, tick: float) -> "Pace":
        """Without the ramps that ended before a tick."""
        keep = [k for k, each in enumerate(self.ramps) if each.begin <= tick]
        return Pace(self.ramps[keep[-1] :]) if keep else self

    def _before(self, tick: float) -> Sequence[Ramp]:
        return [each for each in self.ramps if each.begin < tick]


def _target(ramped: Ramp) -> float:
    """The rate at the end of a ramp, without the rounding of its coefficients."""
    value = float(ramped.rate.sum())
    nearest = round(value, 12)
    return nearest if abs(value - nearest) < WHOLE else value


def played(track: ToolTrack, beat: Beat, period: float) -> ToolTrack:
    """The plan sampled at ``beat.u`` -> what the machine does at those ticks of ``period`` s."""
    rate, slope = beat.rate[:, None], beat.slope[:, None] / period
    return replace(
        track,
        velocity=rate * track.velocity,
        acceleration=rate**2 * track.acceleration + slope * track.velocity,
        flow=beat.rate * track.flow,
    )
