"""What a compact log holds of each tick: where sliders and nozzle are, and the air."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.extrusion import air_command
from cdhr_host.mechanism import Cables, lengths
from cdhr_host.profile import Profile
from cdhr_host.values import Array, Ints, ToolTrack


@dataclass(frozen=True, slots=True)
class Trace:
    """N consecutive ticks."""

    tick: Ints
    """(N,)"""
    line: Ints
    """(N,)"""
    nozzle_G: Array
    """(N, 3) m"""
    slider: Array
    """(N, 6) m"""
    pressure: Array
    """(N,) Pa"""


class Tracer:
    """Samples of the nozzle -> traces; the same numbers as the setpoints', without the forces."""

    def __init__(self, profile: Profile) -> None:
        self._cables = Cables.from_profile(profile)
        self._extruder = profile.extruder

    def trace(self, track: ToolTrack) -> Trace:
        """A block of samples, all within reach."""
        q = track.position_G - self._cables.reference_G
        air = air_command(track.flow, track.air, self._extruder)
        length = lengths(self._cables, q, q)
        slider = np.subtract(length, self._cables.reference_lengths, out=length)
        return Trace(track.tick, track.line, track.position_G, slider, air.pressure)
