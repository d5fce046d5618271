"""What a compact log holds of each tick: where sliders and nozzle are, and the air."""

from collections.abc import Iterator
from dataclasses import dataclass, fields

from cdhr_host.extrusion import AirStage, air_command
from cdhr_host.motion.sampling import Timed
from cdhr_host.pipeline.rig import Rig
from cdhr_host.pipeline.shift import Shift
from cdhr_host.values import Array, Command, Flags, Ints, Pause, ToolTrack


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
    flow: Array
    """(N,) m³/s"""
    pressure: Array
    """(N,) Pa"""

    def __len__(self) -> int:
        return len(self.tick)

    def __getitem__(self, rows: slice | Flags) -> "Trace":
        return Trace(*(getattr(self, field.name)[rows] for field in fields(self)))


class Tracer:
    """Samples of the nozzle -> traces; the same numbers as the setpoints', without the forces."""

    def __init__(self, rig: Rig, period: float) -> None:
        self._rig = rig
        self._stage: AirStage[Trace] = AirStage(rig.air, period)

    def traces(self, step: Timed | Shift) -> Iterator[Trace]:
        """Every tick, in blocks, all within reach; the last of them once it is known what follows."""
        if isinstance(step, Shift):
            shifted = self._rig.shifted_sliders(step.track, step.upper)
            yield self._stage.push(self._trace(step.track, shifted))
        else:
            for track in step.tracks():
                yield self._stage.push(self._trace(track, self._rig.slider_places(track)))

    def command(self, command: Command) -> Iterator[Trace]:
        """What is left before a pause."""
        if isinstance(command, Pause):
            yield from self.finish()

    def finish(self) -> Iterator[Trace]:
        """What is left at the end."""
        left = self._stage.flush()
        if left is not None:
            yield left

    def _trace(self, track: ToolTrack, slider: Array) -> Trace:
        air = air_command(track.flow, track.air, self._rig.air.law)
        return Trace(track.tick, track.line, track.position_G, slider, air.flow, air.pressure)
