"""The static model: the pressure of a flow by the clay's law, as if the air acted at once."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.extrusion.rheology import PressureFlow
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class AirCommand:
    """What the air does: (N,) each."""

    flow: Array
    """m³/s of clay"""
    pressure: Array
    """Pa, gauge; 0 is air off"""


def air_command(flow: Array, held: Array, law: PressureFlow) -> AirCommand:
    """(N,) m³/s of planned flow, (N,) Pa held by air words -> flow and pressure.

    The law's pressure where clay is planned, else the held pressure with the flow it gives;
    0 where neither asks for clay. The result is not bounded by the supply: whoever uses it
    refuses what exceeds pressure_max.
    """
    pushed = flow > 0.0
    pressure = np.array(held, dtype=np.float64)
    pressure[pushed] = law.pressure(flow[pushed])
    given = np.array(flow, dtype=np.float64)
    blown = ~pushed & (pressure > 0.0)
    given[blown] = law.flow(pressure[blown])
    return AirCommand(given, pressure)
