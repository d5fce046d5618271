"""What lies between the pressure command and the clay at the nozzle's tip.

A command reaches the regulator after a dead time; its pressure follows with a first-order lag,
the clay's in hose and reservoir with another; the clay then flows by its law. Opening and
closing have dead times of their own: while the end of the air is on its way the last level lasts.
"""

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from cdhr_host.extrusion.material import flow_law
from cdhr_host.extrusion.rheology import PressureFlow
from cdhr_host.profile import Profile

RESTORE: Final = 3.0
"""lags over which the pressure is restored to the clay's yield before a bead"""
RESERVE: Final = 0.15
"""of the greatest pressure, kept for changing the flow where the air is led"""
CREEP: Final = 2e-4
"""m/s at which clay may leave the nozzle just before a bead: a paste's pressure rises steepest at rest"""
SETTLE: Final = 0.05
"""s a valve stays closed at least: shorter gaps between two beads are passed at yield"""


@dataclass(frozen=True, slots=True)
class AirModel:
    """Clay, air and their delays; SI."""

    law: PressureFlow
    pressure_max: float
    """Pa, gauge"""
    regulator_lag: float = 0.0
    """s"""
    line_lag: float = 0.0
    """s"""
    open_dead: float = 0.0
    """s"""
    close_dead: float = 0.0
    """s"""
    creep: float = 0.0
    """m³/s that may flow as a bead begins"""
    coast: float = 0.0
    """m before the end of a bead from which on the clay in the line is left to run out"""

    @classmethod
    def from_profile(cls, profile: Profile) -> Self:
        """The air of a profile; without delays where its clay has not been identified."""
        extruder, clay = profile.extruder, profile.clay
        law = flow_law(extruder, clay)
        if not is_led(profile):
            return cls(law, extruder.pressure_max)
        return cls(
            law,
            extruder.pressure_max,
            profile.drives.regulator_lag,
            clay.line_lag,
            clay.open_dead,
            clay.close_dead,
            CREEP * math.pi / 4.0 * extruder.nozzle_diameter**2,
            extruder.coast,
        )

    @property
    def leads(self) -> bool:
        """Whether the air must act before the clay is to flow."""
        return max(self.lag, self.open_dead, self.close_dead, self.coast) > 0.0

    @property
    def lag(self) -> float:
        """s: both lags"""
        return self.regulator_lag + self.line_lag

    @property
    def restore(self) -> float:
        """s over which the pressure is brought to the clay's yield before a bead."""
        return RESTORE * self.lag

    @property
    def start_lead(self) -> float:
        """s that the air needs to know of a bead before it begins."""
        return self.restore + self.open_dead

    @property
    def change_lead(self) -> float:
        """s that the air needs to know of a change of flow: what ``[job] hold = "clean"`` waits for."""
        return max(self.open_dead, self.close_dead)

    @property
    def gap(self) -> float:
        """s of the longest gap between two beads that is passed at yield, the valve open."""
        return self.restore + self.change_lead + SETTLE

    @property
    def flow_max(self) -> float:
        """m³/s: the greatest flow that is planned."""
        usable = self.pressure_max * (1.0 - RESERVE if self.lag > 0.0 else 1.0)
        return float(self.law.flow(np.array(usable)))


def is_led(profile: Profile) -> bool:
    """Whether the profile's air is led: as it says, or once its clay's delays are known."""
    wish, clay = profile.extruder.lead, profile.clay
    known = max(clay.open_dead, clay.close_dead, clay.line_lag) > 0.0
    return wish == "on" or (wish == "identified" and known)


def ticks(duration: float, period: float) -> int:
    """s -> whole periods, the nearest."""
    return math.floor(duration / period + 0.5)
