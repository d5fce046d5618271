"""The whole file walked once without drives: time, extremes, and everything it cannot do."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import singledispatchmethod
from typing import TYPE_CHECKING

import numpy as np

from cdhr_host.errors import MAX_LISTED, Problem
from cdhr_host.extrusion import AirStage
from cdhr_host.motion.arc import arc_length
from cdhr_host.motion.curves import spline_length
from cdhr_host.motion.sampling import Timed
from cdhr_host.motion.vectors import norms
from cdhr_host.pipeline.clearing import Clearing
from cdhr_host.pipeline.columns import setpoint_columns
from cdhr_host.pipeline.leading import Leading
from cdhr_host.pipeline.shift import Shift
from cdhr_host.pipeline.staircase import Checked, Staircase
from cdhr_host.pipeline.survey import Survey
from cdhr_host.pipeline.trace import Trace
from cdhr_host.profile import Profile
from cdhr_host.values import (
    Arc,
    Blend,
    Command,
    Dwell,
    Moves,
    Notice,
    Pause,
    Prime,
    Setpoints,
    Spline,
    Stop,
    ToolTrack,
)

if TYPE_CHECKING:
    from cdhr_host.pipeline.tracer import Tracer

Extreme = tuple[float, int, float, int]
"""least, its line, greatest, its line"""


@dataclass(frozen=True, slots=True)
class Proof:
    """What is known of a program once it was walked."""

    lines: int
    moves: int
    duration: float
    """s"""
    path: float
    """m, as drawn"""
    extruded: float
    """m³ of clay, as drawn"""
    problems: tuple[Problem, ...]
    """the first hundred"""
    total_problems: int
    extremes: dict[str, Extreme]
    """of each log column, in the log's unit"""
    layers: tuple[tuple[int, int], ...]
    """(line, layer) where each layer begins"""
    layer_times: tuple[float, ...]
    """s at which each layer begins, as exactly as the ticks looked at tell"""
    pauses: int
    warnings: tuple[Problem, ...]

    @property
    def ok(self) -> bool:
        """Whether the machine can do all of it."""
        return self.total_problems == 0


def prove(
    chunks: Iterable[bytes],
    profile: Profile,
    *,
    rate_hz: float | None = None,
    sink: Callable[[Setpoints], None] | None = None,
    trace: Callable[[Trace], None] | None = None,
    watch: Callable[[Checked], None] | None = None,
) -> Proof:
    """Walk a program's text once, in memory that does not grow with it.

    ``sink`` gets every setpoint, in blocks, as long as there is no problem. Without it only
    the setpoints are computed that prove the others (see ``survey``); the extremes are then
    theirs. ``trace`` gets every tick without its forces. ``watch`` gets the blocks that are
    computed, to show progress or draw. Raises ProgramError for text that is not understood; what the
    machine cannot do is listed in the proof instead.
    """
    staircase = Staircase(profile, rate_hz=rate_hz)
    chosen = Survey(staircase.rig).tracks if sink is None else Timed.tracks
    clearing, tally = Clearing(profile), _Tally()
    tracer = None if trace is None else _tracer(staircase)

    def seen(steps: Iterable[Command | Checked]) -> None:
        for step in steps:
            if not isinstance(step, Checked):
                tally.command(step)
                continue
            tally.block(step)
            tally.collisions(clearing.problems(step.setpoints))
            if sink is not None and not (staircase.problems or tally.collided):
                sink(step.setpoints)
            if watch is not None:
                watch(step)

    def kept(traces: Iterable[Trace]) -> None:
        if trace is not None and not (staircase.problems or tally.collided):
            for traced in traces:
                trace(traced)

    leading = Leading(AirStage(staircase.rig.air, staircase.period) if sink is not None else None)
    for step in staircase.timed(chunks):
        if isinstance(step, Timed | Shift):
            for checked in _computed(staircase, step, chosen):
                seen(leading.push(checked))
            kept(tracer.traces(step) if tracer else ())
        else:
            seen(leading.push(step))
            kept(tracer.command(step) if tracer else ())
    seen(leading.finish())
    kept(tracer.finish() if tracer else ())
    return tally.proof(staircase, clearing.warning)


def _tracer(staircase: Staircase) -> "Tracer":
    """Loads a compiler, which nothing else here needs."""
    from cdhr_host.pipeline.tracer import Tracer  # noqa: PLC0415

    return Tracer(staircase.rig, staircase.period)


def _computed(
    staircase: Staircase, step: Timed | Shift, chosen: Callable[[Timed], Iterator[ToolTrack]]
) -> Iterator[Checked]:
    if isinstance(step, Shift):
        yield staircase.shifted(step)
    else:
        yield from map(staircase.checked, chosen(step))


@dataclass(slots=True)
class _Tally:
    """Sums and extremes so far."""

    moves: int = 0
    path: float = 0.0
    extruded: float = 0.0
    duration: float = 0.0
    pauses: int = 0
    collided: int = 0
    problems: dict[tuple[int | None, str | None], Problem] = field(default_factory=dict)
    layers: list[tuple[int, int]] = field(default_factory=list)
    layer_times: list[float] = field(default_factory=list)
    warnings: list[Problem] = field(default_factory=list)
    extremes: dict[str, Extreme] = field(default_factory=dict)

    def block(self, checked: Checked) -> None:
        """Take in a block of setpoints."""
        for problem in checked.problems:
            self._list(problem)
        rows = checked.setpoints
        if not len(rows):
            return
        self.duration = float(rows.t[-1])
        self._layers(rows)
        for name, values in setpoint_columns(rows).items():
            if name not in {"t_s", "line"}:
                low, high = int(np.argmin(values)), int(np.argmax(values))
                self._widen(
                    name, (float(values[low]), int(rows.line[low]), float(values[high]), int(rows.line[high]))
                )

    def _layers(self, rows: Setpoints) -> None:
        for line, _ in self.layers[len(self.layer_times) :]:
            if rows.line[-1] < line:
                return
            self.layer_times.append(float(rows.t[np.searchsorted(rows.line, line)]))

    def collisions(self, found: list[Problem]) -> None:
        """Take in collisions of cables."""
        self.collided += len(found)
        for problem in found:
            self._list(problem)

    def _list(self, problem: Problem) -> None:
        place = problem.line, problem.key or problem.message.split(" would")[0]
        if place in self.problems or len(self.problems) < MAX_LISTED:
            self.problems[place] = problem

    def _widen(self, name: str, found: Extreme) -> None:
        known = self.extremes.get(name, found)
        low, high = min(known[:2], found[:2]), max(known[2:], found[2:], key=lambda pair: pair[0])
        self.extremes[name] = (*low, *high)

    @singledispatchmethod
    def command(self, command: Command) -> None:
        """Take in a command."""
        raise TypeError(f"not a command: {command!r}")

    @command.register
    def _(self, command: Moves) -> None:
        steps = np.diff(np.concatenate((command.start_G[None], command.end_G)), axis=0)
        self.moves += len(command.line)
        self.path += float(norms(steps).sum())
        self.extruded += float(command.clay.sum())

    @command.register
    def _(self, command: Arc) -> None:
        self.moves += 1
        self.path += arc_length(command)
        self.extruded += command.clay

    @command.register
    def _(self, command: Spline) -> None:
        self.moves += 1
        self.path += spline_length(command)
        self.extruded += command.clay

    @command.register
    def _(self, command: Prime) -> None:
        self.moves += 1
        self.extruded += command.clay

    @command.register
    def _(self, command: Notice) -> None:
        if command.kind == "layer":
            self.layers.append((command.line, int(command.text)))
        elif command.kind == "warning":
            self.warnings.append(Problem("warning", command.text, line=command.line))

    @command.register
    def _(self, _: Pause) -> None:
        self.pauses += 1

    @command.register(Dwell | Stop | Blend)
    def _(self, _: Dwell | Stop | Blend) -> None:
        """Adds nothing of its own; its time is in the setpoints."""

    def proof(self, staircase: Staircase, collision: Problem | None) -> Proof:
        """All of it."""
        return Proof(
            lines=staircase.lines,
            moves=self.moves,
            duration=self.duration,
            path=self.path,
            extruded=self.extruded,
            problems=tuple(self.problems.values()),
            total_problems=staircase.problems + self.collided,
            extremes=self.extremes,
            layers=tuple(self.layers),
            layer_times=(*self.layer_times, *[self.duration] * (len(self.layers) - len(self.layer_times))),
            pauses=self.pauses,
            warnings=(*self.warnings, *([collision] if collision else [])),
        )
