"""What can be said of commands before they are planned: places and forces at rest, cables' way."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cdhr_host.errors import Problem
from cdhr_host.motion.arc import chords
from cdhr_host.motion.curves import points_on
from cdhr_host.motion.vectors import norms
from cdhr_host.pipeline.audit import on_bed
from cdhr_host.pipeline.clearing import Clearing
from cdhr_host.pipeline.staircase import Staircase
from cdhr_host.pipeline.survey import SPACING
from cdhr_host.values import Arc, Array, Command, Ints, Moves, Spline, ToolTrack


class Foresight:
    """Looks at commands in the order of the program, and remembers the clay they lay."""

    def __init__(self, machine: Staircase) -> None:
        self._machine = machine
        self._judge = machine.apart()
        self._clearing = Clearing(machine.profile)

    def problems(self, commands: Sequence[Command]) -> list[Problem]:
        """What the machine could not do even standing there, one for each line, limit and cable."""
        found: list[Problem] = []
        for command in commands:
            drawn = self._drawn(command)
            if drawn is not None:
                found += self._at_rest(*drawn)
        if found:
            self._judge = self._machine.apart()
        return found

    def _drawn(self, command: Command) -> tuple[Array, Ints, Array] | None:
        """(N, 3) m places at most SPACING apart, (N,) lines, (N,) clay; None where nothing is drawn."""
        if isinstance(command, Moves):
            corners = np.concatenate((command.start_G[None], command.end_G))
            return _spaced(corners, command.line, command.clay)
        if isinstance(command, Arc | Spline):
            width = self._machine.limits.half_width
            corners = chords(command, width) if isinstance(command, Arc) else points_on(command, width)
            count = len(corners) - 1
            return _spaced(corners, np.full(count, command.line), np.full(count, command.clay))
        return None

    def _at_rest(self, places: Array, line: Ints, clay: Array) -> list[Problem]:
        if on_bed(places, self._machine.profile).all():
            kept = _thinned(places)
            places, line, clay = places[kept], line[kept], clay[kept]
        still, nothing = np.zeros_like(places), np.zeros(len(places))
        tick = np.arange(len(places))
        checked = self._judge.checked(ToolTrack(tick, line, places, still, still, nothing, nothing))
        if checked.problems:
            return list(checked.problems)
        rows = replace(checked.setpoints, flow=np.where(clay > 0.0, 1.0, 0.0))
        return self._clearing.problems(rows)


def _thinned(places: Array) -> Ints:
    """Of places that may be far closer, those about SPACING apart, and the last."""
    way = np.cumsum(norms(np.diff(places, axis=0, prepend=places[:1])))
    steps = np.floor(way / SPACING)
    fresh = np.flatnonzero(np.diff(steps, prepend=-1.0) > 0.0)
    return np.unique(np.append(fresh, len(places) - 1))


def _spaced(corners: Array, line: Ints, clay: Array) -> tuple[Array, Ints, Array]:
    """Places along a polyline, each named by the segment that leads to it."""
    steps = np.diff(corners, axis=0)
    count = np.maximum(np.ceil(norms(steps) / SPACING).astype(np.int64), 1)
    segment = np.repeat(np.arange(len(steps)), count)
    within = np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count) + 1
    places = corners[segment] + steps[segment] * (within / count[segment])[:, None]
    return places, line[segment], clay[segment]
