"""Stretches and shifts -> traces: every tick, with no more worked out than a compact log holds."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cdhr_host.extrusion import AirStage, air_command
from cdhr_host.motion.leg import Leg
from cdhr_host.motion.sampling import Timed
from cdhr_host.pipeline.rig import Rig
from cdhr_host.pipeline.shift import Shift
from cdhr_host.pipeline.ticking import ticked
from cdhr_host.pipeline.trace import Trace
from cdhr_host.pipeline.way import Turns, places, way
from cdhr_host.values import Array, Command, Ints, Pause, ToolTrack

BLOCK: Final = 8192
"""ticks handed on at a time"""


class Tracer:
    """Samples of the nozzle -> traces; the numbers are the setpoints', those of sliders to ``way.NEAR``."""

    def __init__(self, rig: Rig, period: float) -> None:
        self._rig = rig
        self._turns = Turns.of(rig)
        self._stage: AirStage[Trace] = AirStage(rig.air, period)

    def traces(self, step: Timed | Shift) -> Iterator[Trace]:
        """Every tick, in blocks, all within reach; the last of them once it is known what follows."""
        if isinstance(step, Shift):
            shifted = self._rig.shifted_sliders(step.track, step.upper)
            yield self._stage.push(self._sampled(step.track, shifted))
        else:
            yield from map(self._stage.push, self._blocks(step))

    def command(self, command: Command) -> Iterator[Trace]:
        """What is left before a pause."""
        if isinstance(command, Pause):
            yield from self.finish()

    def finish(self) -> Iterator[Trace]:
        """What is left at the end."""
        left = self._stage.flush()
        if left is not None:
            yield left

    def _blocks(self, timed: Timed) -> Iterator[Trace]:
        """Along the path where cubics do and are fewer than ticks, else tick by tick."""
        leg = timed.stretch
        if isinstance(leg, Leg) and timed.shaper.length == 0.0 and self._rig.give is None:
            s = places(leg, self._turns)
            if len(s) < len(timed.ticks):
                yield from self._along(timed, leg, s)
                return
        for track in timed.tracks():
            yield self._sampled(track, self._rig.slider_places(track))

    def _along(self, timed: Timed, leg: Leg, s: Array) -> Iterator[Trace]:
        known, carried = way(self._rig, leg, s), leg.segments
        for first in range(timed.ticks.start, timed.ticks.stop, BLOCK):
            tick = np.arange(first, min(first + BLOCK, timed.ticks.stop))
            t = np.asarray(tick * timed.period, dtype=np.float64)
            found = ticked(leg, known, timed.laid[-1].elapsed(t))
            flow = carried.clay[found.segment] * found.speed
            air = np.where(found.speed > 0.0, carried.air[found.segment], 0.0)
            moved = found.nozzle_G.T, found.slider.T
            yield self._trace((tick, carried.line[found.segment]), moved, (flow, air))

    def _sampled(self, track: ToolTrack, slider: Array) -> Trace:
        return self._trace((track.tick, track.line), (track.position_G, slider), (track.flow, track.air))

    def _trace(self, at: tuple[Ints, Ints], moved: tuple[Array, Array], pushed: tuple[Array, Array]) -> Trace:
        """Of tick and line, nozzle and sliders, flow and air."""
        air = air_command(*pushed, self._rig.air.law)
        return Trace(*at, *moved, air.flow, air.pressure)
