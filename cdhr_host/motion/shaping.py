"""Input shaping: the motion is the mean of a few delayed copies of itself, so that what rings
because of one copy is cancelled by the next.

    q_shaped(t) = sum A_i q(t - t_i),   sum A_i = 1, A_i > 0

A mean of positions, velocities, accelerations and flows: no limit on any of them can be
exceeded by it, and clay stays in phase with the nozzle. It leaves the path by at most
a/2 · sum A_i (t_i - m)² with m the mean delay and a the greatest acceleration: to first
order in time the mean of the copies is the copy at the mean delay.

Impulses: ZV (Singer and Seering 1990), EI (Singhose, Seering and Singer 1994, 5 % tolerated
vibration), and MZV, which is between them in length and robustness.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cdhr_host.values import Array

Kind = Literal["none", "zv", "mzv", "ei"]
EI_TOLERANCE = 0.05
"""Share of the vibration that EI accepts at the very frequency it is made for."""


@dataclass(frozen=True, slots=True)
class Shaper:
    """Delayed copies and their weights."""

    delay: Array
    """(K,) s, ascending from 0"""
    weight: Array
    """(K,), positive, sum 1"""

    @property
    def length(self) -> float:
        """s, how much longer every motion takes."""
        return float(self.delay[-1])

    @property
    def middle(self) -> int:
        """The copy nearest to the mean delay: the one that says which line is executed."""
        return int(np.argmin(np.abs(self.delay - self.weight @ self.delay)))

    def deviation(self, acceleration: float) -> float:
        """m/s² -> m: the most a shaped path leaves the unshaped one."""
        spread = self.weight @ (self.delay - self.weight @ self.delay) ** 2
        return float(acceleration * spread / 2)


UNSHAPED = Shaper(np.zeros(1), np.ones(1))


def shaper(kind: Kind, frequency: float, damping: float) -> Shaper:
    """Hz, ratio below 1 -> the copies that cancel a mode of that frequency and damping."""
    if kind == "none":
        return UNSHAPED
    root = math.sqrt(1.0 - damping**2)
    period = 1.0 / (frequency * root)
    decay = math.exp(-damping * math.pi / root)
    if kind == "zv":
        return _normal([0.0, 0.5 * period], [1.0, decay])
    if kind == "ei":
        outer, inner = 0.25 * (1 + EI_TOLERANCE), 0.5 * (1 - EI_TOLERANCE)
        return _normal([0.0, 0.5 * period, period], [outer, inner * decay, outer * decay**2])
    decay = decay**0.75
    outer, inner = 1 - math.sqrt(0.5), math.sqrt(2) - 1
    return _normal([0.0, 0.375 * period, 0.75 * period], [outer, inner * decay, outer * decay**2])


def residual(shaped: Shaper, frequency: float, damping: float) -> float:
    """Share of the vibration that is left in a mode after the last copy.

    The response of an oscillator to impulses A_i at t_i, at the end of the last one,
    relative to one impulse of weight 1 at t = 0 seen at that time.
    """
    omega = 2 * math.pi * frequency
    ringing = math.sqrt(1 - damping**2) * omega * shaped.delay
    grown = shaped.weight * np.exp(damping * omega * shaped.delay)
    return math.hypot(float(grown @ np.cos(ringing)), float(grown @ np.sin(ringing))) * math.exp(
        -damping * omega * shaped.length
    )


def _normal(delay: list[float], weight: list[float]) -> Shaper:
    total = math.fsum(weight)
    return Shaper(np.array(delay), np.array(weight) / total)
