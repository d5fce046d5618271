"""What a compact log holds of each tick: where sliders and nozzle are, and the air."""

from collections.abc import Iterator
from dataclasses import dataclass

from cdhr_host.extrusion import air_command
from cdhr_host.motion.sampling import Timed
from cdhr_host.pipeline.rig import Rig
from cdhr_host.pipeline.shift import Shift
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

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    def traces(self, step: Timed | Shift) -> Iterator[Trace]:
        """Every tick, in blocks, all within reach."""
        if isinstance(step, Shift):
            yield self._trace(step.track, self._rig.shifted_sliders(step.track, step.upper))
        else:
            for track in step.tracks():
                yield self._trace(track, self._rig.slider_places(track))

    def _trace(self, track: ToolTrack, slider: Array) -> Trace:
        air = air_command(track.flow, track.air, self._rig.profile.extruder)
        return Trace(track.tick, track.line, track.position_G, slider, air.pressure)
