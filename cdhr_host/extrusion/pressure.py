"""The static model: below a threshold nothing flows, above it flow grows in proportion."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.profile import Extruder
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class AirCommand:
    """What the air does: (N,) each."""

    flow: Array
    """m³/s of clay"""
    pressure: Array
    """Pa, gauge; 0 is air off"""


def air_command(flow: Array, held: Array, extruder: Extruder) -> AirCommand:
    """(N,) m³/s of planned flow, (N,) Pa held by air words -> flow and pressure.

    p = threshold + slope · flow where clay is planned, else the held pressure, whose flow is
    (p - threshold) / slope; 0 where neither asks for clay. The result is not bounded by the
    supply: whoever uses it refuses what exceeds pressure_max.
    """
    pushed = flow > 0.0
    needed = extruder.pressure_threshold + extruder.pressure_slope * flow
    pressure = np.where(pushed, needed, held)
    given = np.maximum(pressure - extruder.pressure_threshold, 0.0) / extruder.pressure_slope
    return AirCommand(np.where(pushed, flow, given), pressure)
