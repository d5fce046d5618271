"""Simulated motion capture: frames at a rate, late, noisy, now and then missing."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.control.pose import PoseSample
from cdhr_host.plant.faults import CAMERA, DROPPED
from cdhr_host.plant.noise import normal, uniform
from cdhr_host.units import MM
from cdhr_host.values import Array

PATIENCE: Final = 600
"""frames looked back for one that was not dropped"""


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera system and its ways to fail."""

    rate: float = 60.0
    """Hz"""
    delay: float = 0.05
    """s from exposure to being heard"""
    noise: float = 0.05 * MM
    """m, standard deviation of each coordinate"""
    dropped: float = 0.0
    """share of frames that never arrive"""
    gaps: tuple[tuple[float, float], ...] = ()
    """s, s: from when to when nothing is seen"""
    seed: int = 0


class SimulatedCapture:
    """A ``PoseSource`` that looks at the simulated nozzle; a frame depends on seed and number only."""

    def __init__(self, camera: Camera, truth: Callable[[float], Array]) -> None:
        """``truth`` gives the (3,) m displacement of the lower platform at a time up to now."""
        self._camera = camera
        self._truth = truth

    def latest(self, now: float) -> PoseSample | None:
        """See ``PoseSource``."""
        camera = self._camera
        newest = int(np.floor((now - camera.delay) * camera.rate + 1e-9))
        for frame in range(newest, max(newest - PATIENCE, -1), -1):
            if self._seen(frame):
                t = frame / camera.rate
                noise = camera.noise * normal(camera.seed, CAMERA, frame, 3)
                return PoseSample(t, self._truth(t) + noise, frame)
        return None

    def _seen(self, frame: int) -> bool:
        camera, t = self._camera, frame / self._camera.rate
        if any(start <= t < end for start, end in camera.gaps):
            return False
        return not camera.dropped or float(uniform(camera.seed, DROPPED, frame, 1)[0]) >= camera.dropped
