"""Air and clay, simulated: pressure command in, regulator's pressure and deposited clay out.

The command travels to the valve (dead times of opening and of closing), the regulator follows
with hysteresis and a first-order lag, the clay in hose and reservoir with another, and leaves
the nozzle by its law. Once the air is shut, part of the clay that was stored by compliance goes
on oozing. Every number is a function of state and input: no clock, and noise by seed.
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.signal import lfilter

from cdhr_host.extrusion import PressureFlow, flow_law
from cdhr_host.plant.noise import normal
from cdhr_host.plant.regulator import Regulator
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Flags, Ints

NOISE_STREAM = 7


@dataclass(frozen=True, slots=True)
class Paste:
    """What the simulated clay and its air are like; SI."""

    law: PressureFlow
    regulator_lag: float
    """s"""
    line_lag: float = 0.0
    """s"""
    open_dead: float = 0.0
    """s"""
    close_dead: float = 0.0
    """s"""
    compliance: float = 0.0
    """m³/Pa of clay stored before the nozzle"""
    ooze: float = 0.0
    """share of the stored clay that runs out of the nozzle once the air is shut"""
    ooze_lag: float = 0.3
    """s, time constant of that"""
    hysteresis: float = 0.0
    """Pa by which the command must turn before the regulator follows"""
    noise: float = 0.0
    """standard deviation of the flow, of the flow; independent from tick to tick"""
    seed: int = 0

    @classmethod
    def from_profile(cls, profile: Profile) -> Self:
        """The clay as the profile knows it, without hysteresis, ooze and noise."""
        clay, law = profile.clay, flow_law(profile.extruder, profile.clay)
        lags = profile.drives.regulator_lag, clay.line_lag, clay.open_dead, clay.close_dead
        return cls(law, *lags, clay.compliance)


@dataclass(frozen=True, slots=True)
class ClayState:
    """Air and clay between two batches of ticks."""

    sent: Array
    """(D,) Pa, the latest commands: those that are still on their way"""
    kept: float
    """Pa, the last level that arrived with the air open"""
    turned: float
    """Pa the regulator aims at"""
    pressure: float
    """Pa behind the regulator"""
    line: float
    """Pa of the clay before the nozzle"""
    stored: float
    """m³ that will ooze if the air is shut now"""


class Clay:
    """Steps a state through batches of commands; the result does not depend on the batching."""

    def __init__(self, paste: Paste, period: float) -> None:
        self._paste = paste
        self._period = period
        self._regulator = Regulator(paste.regulator_lag, period)
        self._open, self._close = (math.floor(d / period + 0.5) for d in (paste.open_dead, paste.close_dead))
        self._line = _ramped(paste.line_lag, period)
        self._kept = math.exp(-period / paste.ooze_lag)

    def standing(self, pressure: float = 0.0, rested: float = 0.0) -> ClayState:
        """Air off; ``pressure`` has vented for ``rested`` s, the clay's with it."""
        left = self._regulator.vented(pressure, rested)
        return ClayState(np.zeros(max(self._open, self._close)), 0.0, 0.0, left, left, 0.0)

    def step(self, state: ClayState, tick: Ints, command: Array) -> tuple[ClayState, Array, Array]:
        """(N,) ticks, (N,) Pa, N >= 1 -> next state, (N,) Pa behind the regulator, (N,) m³/s deposited."""
        sent = np.concatenate((state.sent, np.maximum(command, 0.0)))
        level, kept = self._arriving(sent, state.kept, len(command))
        aimed = self._aimed(level, state.turned)
        pressure = self._regulator.step(state.pressure, aimed)
        line = self._followed(pressure, state)
        stored, oozed = self._oozed(level > 0.0, line, state.stored)
        memory, last = sent[len(command) :], float(pressure[-1])
        after = ClayState(memory, kept, float(aimed[-1]), last, float(line[-1]), stored)
        return after, pressure, self._noisy(tick, self._paste.law.flow(line) + oozed)

    def _arriving(self, sent: Array, kept: float, count: int) -> tuple[Array, float]:
        """(D + N,) commands -> (N,) Pa arriving at the regulator, and the last level of open air."""
        dead = max(self._open, self._close)
        on = sent > 0.0
        level = sent[dead - self._open : dead - self._open + count]
        at = np.maximum.accumulate(np.where(level > 0.0, np.arange(1, count + 1), 0))
        held = np.concatenate(([kept], level))[at]
        first, last = max(self._open, self._close), min(self._open, self._close)
        known = _number_of(on, dead, first, last)
        opened = known > 0 if self._close >= self._open else known == first - last + 1
        return np.where(opened, held, 0.0), float(held[-1])

    def _aimed(self, level: Array, turned: float) -> Array:
        """(N,) Pa the regulator aims at: it follows a command that has turned by its hysteresis; 0 is 0."""
        play = self._paste.hysteresis
        if play == 0.0:
            return level
        aimed = level.copy()
        for k, wanted in enumerate(level.tolist()):
            turned = min(max(turned, wanted - play), wanted + play) if wanted > 0.0 else 0.0
            aimed[k] = turned
        return aimed

    def _followed(self, pressure: Array, state: ClayState) -> Array:
        """(N,) Pa behind the regulator -> (N,) Pa of the clay."""
        keep, early, late = self._line
        memory = np.array([keep * state.line + early * state.pressure])
        followed, _ = lfilter([late, early], [1.0, -keep], pressure, zi=memory)
        return np.asarray(followed, dtype=np.float64)

    def _oozed(self, opened: Flags, line: Array, before: float) -> tuple[float, Array]:
        """m³ stored after N ticks, (N,) m³/s of stored clay that runs out while the air is shut."""
        store = self._paste.ooze * self._paste.compliance * np.maximum(line, 0.0)
        count = len(line)
        at = np.maximum.accumulate(np.where(opened, np.arange(1, count + 1), 0))
        left = np.concatenate(([before], store))[at] * self._kept ** (np.arange(1, count + 1) - at)
        lost = np.where(opened, 0.0, left * (1.0 / self._kept - 1.0))
        return float(left[-1]), lost / self._period

    def _noisy(self, tick: Ints, flow: Array) -> Array:
        """(N,) m³/s with the noise of the paste, never drawn back."""
        if self._paste.noise == 0.0:
            return flow
        draws = np.array([normal(self._paste.seed, NOISE_STREAM, int(k), 1)[0] for k in tick])
        return np.asarray(flow * np.maximum(1.0 + self._paste.noise * draws, 0.0))


def _number_of(on: Flags, dead: int, first: int, last: int) -> Ints:
    """(N,) at how many of the ticks from ``first`` to ``last`` ticks ago the air was on."""
    count = len(on) - dead
    sums = np.concatenate(([0], np.cumsum(on)))
    begin = np.arange(count) + dead - first
    return np.asarray(sums[begin + first - last + 1] - sums[begin], dtype=np.int64)


def _ramped(lag: float, period: float) -> tuple[float, float, float]:
    """A first-order lag fed with a ramp over each tick: what it keeps, and its gains of the ramp's ends."""
    if lag == 0.0:
        return 0.0, 0.0, 1.0
    keep = math.exp(-period / lag)
    mean = lag / period * (1.0 - keep)
    return keep, mean - keep, 1.0 - mean
