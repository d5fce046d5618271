"""What a run amounted to, summed up while it goes on."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.drives.timing import CycleTiming
from cdhr_host.values import Array, Feedback, Setpoints


@dataclass(frozen=True, slots=True)
class RunSummary:
    """One run in numbers."""

    ticks: int
    """executed"""
    duration: float
    """s of machine time executed"""
    last_tick: int | None
    last_line: int | None
    """of the last executed row; None when there was none"""
    following_max: Array
    """(6,) m, greatest distance of each slider from its setpoint"""
    following_rms: Array
    """(6,) m"""
    torque_max: Array
    """(6,) N m, greatest amount"""
    pressure_deviation_max: float
    """Pa, greatest distance of the pressure from its command"""
    interrupted: bool
    """stopped on request before the program's end"""
    timing: CycleTiming | None = None
    """how punctual the sender was; None for drives without one"""


class Tally:
    """Sums up executed rows; its size does not grow with the run."""

    def __init__(self) -> None:
        self._ticks = 0
        self._last: tuple[int | None, int | None] = (None, None)
        self._away = np.zeros(6)
        self._squares = np.zeros(6)
        self._torque = np.zeros(6)
        self._pressure = 0.0

    def add(self, rows: Setpoints, feedback: Feedback) -> None:
        """N >= 1 executed rows, and what was measured at each."""
        away = np.abs(feedback.slider - rows.slider)
        self._ticks += len(rows)
        self._last = int(rows.tick[-1]), int(rows.line[-1])
        self._away = np.maximum(self._away, away.max(axis=0))
        self._squares += np.sum(away * away, axis=0)
        self._torque = np.maximum(self._torque, np.abs(feedback.torque).max(axis=0))
        self._pressure = max(self._pressure, float(np.abs(feedback.pressure - rows.pressure).max()))

    def summary(self, period: float, *, interrupted: bool, timing: CycleTiming | None = None) -> RunSummary:
        """The run so far."""
        return RunSummary(
            ticks=self._ticks,
            duration=self._ticks * period,
            last_tick=self._last[0],
            last_line=self._last[1],
            following_max=self._away,
            following_rms=np.sqrt(self._squares / max(self._ticks, 1)),
            torque_max=self._torque,
            pressure_deviation_max=self._pressure,
            interrupted=interrupted,
            timing=timing,
        )
