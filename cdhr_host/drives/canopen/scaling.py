"""Metres and newtons to the numbers on the wire, and back."""

import math
from typing import Final

import numpy as np

from cdhr_host.errors import DriveError, Problem
from cdhr_host.profile.schema import Profile
from cdhr_host.units import MM
from cdhr_host.values import Array, Ints

INT32: Final = 2**31 - 1
INT16: Final = 2**15 - 1


class Scaling:
    """One machine's numbers; ``zero`` (6,) is what the drives read at the reference pose."""

    def __init__(self, profile: Profile, zero: Ints | None = None) -> None:
        self.unit = profile.canopen.position_unit
        self.zero: Ints = np.zeros(6, dtype=np.int64) if zero is None else zero
        self._per_newton = profile.sliders.screw_lead / (2.0 * math.pi * profile.drives.screw_efficiency)
        self._rated = profile.canopen.rated_torque
        self._pressure = profile.canopen.pressure_full_scale
        self._force = profile.canopen.force_full_scale

    def counts(self, slider: Array) -> Ints:
        """(..., 6) m -> position units, the nearest ones; DriveError beyond 32 bit."""
        found = np.rint(slider / self.unit) + self.zero
        if not (np.abs(found) <= INT32).all():
            worst = float(np.abs(slider).max())
            raise DriveError(
                Problem(
                    "int32",
                    f"a slider position of {worst / MM:.3f} mm does not fit 32-bit position units",
                    hint="choose a larger [canopen] position_unit_mm",
                )
            )
        return np.asarray(found, dtype=np.int64)

    def slider(self, counts: Ints) -> Array:
        """(..., 6) position units -> m."""
        return np.asarray((counts - self.zero) * self.unit, dtype=np.float64)

    def feed_forward(self, tension: Array) -> Ints:
        """(..., 6) N -> thousandths of the rated torque, 0x60B2: F lead / (2 pi efficiency)."""
        torque = np.rint(tension * self._per_newton / self._rated * 1e3)
        if not (np.abs(torque) <= INT16).all():
            raise DriveError(
                Problem("torque", f"a cable force of {np.abs(tension).max():.0f} N does not fit 0x60B2")
            )
        return np.asarray(torque, dtype=np.int64)

    def torque(self, thousandths: Array) -> Array:
        """Thousandths of the rated torque, 0x6077 -> N m."""
        return np.asarray(thousandths * (1e-3 * self._rated), dtype=np.float64)

    def pressure_raw(self, pressure: float) -> int:
        """Pa -> 0x6411."""
        return round(pressure / self._pressure * INT16)

    def pressure(self, raw: int) -> float:
        """0x6401 -> Pa."""
        return raw / INT16 * self._pressure

    def force(self, raw: int) -> float:
        """0x6401 -> N."""
        return raw / INT16 * self._force
