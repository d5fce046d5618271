"""The section that says by how much a measured machine differs from its drawing."""

from typing import Annotated, Final

import numpy as np
from pydantic import AfterValidator, Field

from cdhr_host.profile.fields import Section
from cdhr_host.units import MM
from cdhr_host.values import Array

CABLES: Final = 6
MOST_MM: Final = 100.0
"""further away is another machine"""


def _shifts(value: list[list[float]]) -> list[list[float]]:
    if value and (len(value) != CABLES or not all(value)):
        raise ValueError("six rows of x, y, z are wanted, one for each cable, or [] for none")
    return value


def _near(value: list[float]) -> list[float]:
    if len(value) not in {0, 3}:
        raise ValueError("x, y and z are wanted, or [] for none")
    if any(abs(part) > MOST_MM for part in value):
        raise ValueError(f"more than {MOST_MM:g} mm away from the drawing")
    return value


Shift = Annotated[list[float], AfterValidator(_near)]
Shifts = Annotated[list[Shift], AfterValidator(_shifts)]


class Calibration(Section):
    """[calibration]: what ``cdhr calibrate geometry`` found; empty is the drawing."""

    pulley_shift_mm: Annotated[
        Shifts, Field(description="pulley centres of cables 1-6 away from their drawn places, x, y, z in W")
    ] = []  # noqa: RUF012 - pydantic copies defaults
    attachment_shift_mm: Annotated[
        Shifts, Field(description="attachments 1-6 on their platforms away from their drawn places, x, y, z")
    ] = []  # noqa: RUF012 - pydantic copies defaults
    reference_shift_mm: Annotated[
        Shift,
        Field(description="lower platform at the reference pose, sliders at 0, away from its drawn place"),
    ] = []  # noqa: RUF012 - pydantic copies defaults

    def pulleys(self) -> Array:
        """(6, 3) m."""
        return _metres(self.pulley_shift_mm, (CABLES, 3))

    def arms(self) -> Array:
        """(6, 3) m: attachments on their platforms."""
        return _metres(self.attachment_shift_mm, (CABLES, 3))

    def reference(self) -> Array:
        """(3,) m."""
        return _metres(self.reference_shift_mm, (3,))

    def attachments(self) -> Array:
        """(6, 3) m: attachments in W at the reference pose."""
        shift = self.arms()
        shift[:3] += self.reference()
        return shift

    def greatest(self) -> float:
        """M: furthest that a pulley and its attachment have moved together."""
        return float(np.linalg.norm(self.pulleys() - self.attachments(), axis=1).max())


def _metres(shift_mm: list[list[float]] | list[float], shape: tuple[int, ...]) -> Array:
    return MM * np.array(shift_mm, dtype=np.float64) if shift_mm else np.zeros(shape)
