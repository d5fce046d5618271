"""The pressure regulator: first-order lag, p' = (command - p) / lag."""

import math

import numpy as np
from scipy.signal import lfilter

from cdhr_host.values import Array


class Regulator:
    """Gauge pressure behind a regulator that cannot draw a vacuum; exact per tick."""

    def __init__(self, lag: float, period: float) -> None:
        self._lag = lag
        self._keep = self._kept(period)

    def _kept(self, duration: float) -> float:
        return math.exp(-duration / self._lag) if self._lag > 0.0 else 0.0

    def step(self, pressure: float, command: Array) -> Array:
        """(N,) Pa commands, each held for a tick -> (N,) Pa at the ticks' ends, from ``pressure`` on."""
        keep = self._keep
        held = np.maximum(command, 0.0)
        followed, _ = lfilter([1.0 - keep], [1.0, -keep], held, zi=np.array([keep * pressure]))
        return np.asarray(followed, dtype=np.float64)

    def vented(self, pressure: float, duration: float) -> float:
        """Pa left of ``pressure`` after ``duration`` s without a command."""
        return pressure * self._kept(duration)
