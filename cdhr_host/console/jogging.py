"""Jog keys: single steps, or motion that goes on as long as the key is held.

A terminal tells presses and repeats of a key, never its release. So continuous motion lives on
the printer's lease: each press or repeat renews it, and when none comes the motion ends.
"""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Final

import numpy as np

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.surface import Reply, Surface
from cdhr_host.units import MM
from cdhr_host.values import Array

STEPS_MM: Final = (0.1, 1.0, 10.0, 100.0)
SPEEDS_MM_S: Final = (1.0, 5.0, 20.0, 50.0)
"""of continuous motion, beside the steps"""
AXES: Final = {
    "right": (0, 1),
    "left": (0, -1),
    "up": (1, 1),
    "down": (1, -1),
    "pageup": (2, 1),
    "pagedown": (2, -1),
}
"""key -> axis, direction"""
SLIDERS: Final = "123456"
FINE: Final = 2
"""of the steps, the small ones, may be taken by a single slider"""


class Jogging:
    """What a jog key does now."""

    def __init__(self, surface: Surface, answered: Callable[["Future[Reply]"], None]) -> None:
        """``answered`` is told what became of each step."""
        self._surface = surface
        self._answered = answered
        self._size = 1
        self.continuous = False
        self.slider: int | None = None
        """the one that is moved alone, from 0 on"""

    @property
    def label(self) -> str:
        """The present size, for a person."""
        if self.slider is not None:
            return f"SLIDER {self.slider + 1} alone: step {STEPS_MM[self._size]:g} mm"
        if self.continuous:
            return f"hold a key: {SPEEDS_MM_S[self._size]:g} mm/s"
        return f"step {STEPS_MM[self._size]:g} mm"

    def resize(self, by: int) -> None:
        """A larger or smaller step or speed."""
        self._size = min(max(self._size + by, 0), len(STEPS_MM) - 1)

    def toggle(self) -> None:
        """Between steps and continuous motion."""
        self.release()
        self.slider, self.continuous = None, not self.continuous

    def choose(self, slider: int | None) -> None:
        """One slider for the arrows, from 0 on; None gives them back to the nozzle."""
        self.release()
        self.slider, self.continuous = slider, False

    def press(self, key: str) -> None:
        """A jog key was pressed, or repeated itself. Raises JobError for what is refused at once."""
        axis, sign = AXES[key]
        if self.slider is not None:
            self._slide(self.slider, sign)
        elif self.continuous:
            self._surface.jog(_along(axis, sign * SPEEDS_MM_S[self._size] * MM))
        else:
            step = _along(axis, sign * STEPS_MM[self._size] * MM)
            self._surface.step(step).add_done_callback(self._answered)

    def _slide(self, slider: int, sign: int) -> None:
        if self._size >= FINE:
            text = f"a single slider is not moved by {STEPS_MM[self._size]:g} mm at a time"
            raise JobError(Problem("slider", text, hint="- chooses 1 or 0.1 mm"))
        answer = self._surface.step_slider(slider, sign * STEPS_MM[self._size] * MM)
        answer.add_done_callback(self._answered)

    def release(self) -> None:
        """End continuous motion now: the key is known to be up, or nobody looks."""
        if self.continuous:
            self._surface.jog(np.zeros(3))


def _along(axis: int, amount: float) -> Array:
    """(3,) along one axis."""
    vector = np.zeros(3)
    vector[axis] = amount
    return vector
