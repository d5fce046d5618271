"""Where the nozzle is, as someone measured it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from cdhr_host.mechanism import Cables, forward
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class PoseSample:
    """One measurement of the lower platform."""

    t: float
    """s since the program's start, when it was taken, not when it was heard"""
    position: Array
    """(3,) m of displacement from the reference pose"""
    frame: int
    """number of the measurement; a repeated number is the same measurement"""


class PoseSource(Protocol):
    """Encoders, a camera system or its simulation."""

    def latest(self, now: float) -> PoseSample | None:
        """The newest sample heard by ``now`` (s since the program's start); None before the first."""
        ...


class EncoderPose:
    """The pose by forward kinematics from slider positions: exact geometry assumed, always there."""

    def __init__(self, cables: Cables, slider: Callable[[float], Array], period: float) -> None:
        """``slider`` gives the (6,) m measured at a time; ``period`` is the drives' tick, s."""
        self._cables = cables
        self._slider = slider
        self._period = period

    def latest(self, now: float) -> PoseSample:
        """The pose of the last tick; raises MotionError where the sliders fit no pose."""
        frame = int(now / self._period + 1e-9)
        t = frame * self._period
        lower, _ = forward(self._cables, (self._cables.reference_lengths + self._slider(t))[None])
        return PoseSample(t, lower[0], frame)
