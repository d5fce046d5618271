"""Jog keys: single steps, or motion that goes on as long as the key is held.

A terminal tells presses and repeats of a key, never its release. So continuous motion lives on
the printer's lease: each press or repeat renews it, and when none comes the motion ends.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from cdhr_host.job.surface import Surface
from cdhr_host.units import MINUTE, MM
from cdhr_host.values import Array

STEPS_MM: Final = (0.1, 1.0, 10.0, 100.0)
SPEEDS_MM_S: Final = (1.0, 5.0, 20.0, 50.0)
"""of continuous motion, beside the steps"""
STEP_SPEED: Final = 25 * MM
"""m/s of a single step"""
AXES: Final = {
    "right": (0, 1),
    "left": (0, -1),
    "up": (1, 1),
    "down": (1, -1),
    "pageup": (2, 1),
    "pagedown": (2, -1),
}
"""key -> axis, direction"""


class Jogging:
    """What a jog key does now."""

    def __init__(self, surface: Surface, run: Callable[[str], None]) -> None:
        """``run`` takes a line of G-code as if it had been typed."""
        self._surface = surface
        self._run = run
        self._size = 1
        self.continuous = False

    @property
    def label(self) -> str:
        """The present size, for a person."""
        if self.continuous:
            return f"hold a key: {SPEEDS_MM_S[self._size]:g} mm/s"
        return f"step {STEPS_MM[self._size]:g} mm"

    def resize(self, by: int) -> None:
        """A larger or smaller step or speed."""
        self._size = min(max(self._size + by, 0), len(STEPS_MM) - 1)

    def toggle(self) -> None:
        """Between steps and continuous motion."""
        self.release()
        self.continuous = not self.continuous

    def press(self, key: str) -> None:
        """A jog key was pressed, or repeated itself."""
        axis, sign = AXES[key]
        if self.continuous:
            self._surface.jog(self._velocity(axis, sign))
        else:
            step = sign * STEPS_MM[self._size]
            self._run(f"G91\nG1 {'XYZ'[axis]}{step:g} F{STEP_SPEED / MM * MINUTE:g}\nG90")

    def release(self) -> None:
        """End continuous motion now: the key is known to be up, or nobody looks."""
        if self.continuous:
            self._surface.jog(np.zeros(3))

    def _velocity(self, axis: int, sign: int) -> Array:
        velocity = np.zeros(3)
        velocity[axis] = sign * SPEEDS_MM_S[self._size] * MM
        return velocity
