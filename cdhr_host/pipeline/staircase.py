"""Text -> Command -> Leg -> ToolTrack -> CableState -> Setpoints, a block at a time."""

import copy
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.extrusion import air_command
from cdhr_host.mechanism import Cables, Loads, cable_state, direction_change_bound, slider
from cdhr_host.motion.limits import MotionLimits, profile_shaper
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.sampling import Timed, Timeline
from cdhr_host.pipeline.audit import Audit, on_bed
from cdhr_host.profile import Profile
from cdhr_host.program import Interpreter, Modal
from cdhr_host.values import Array, Command, Pause, Setpoints, ToolTrack


@dataclass(frozen=True, slots=True)
class Checked:
    """A block of setpoints, each checked; only those on the bed are there."""

    setpoints: Setpoints
    problems: tuple[Problem, ...]
    """what the machine cannot do of it, one for each line, limit and cable"""


class Staircase:
    """One machine standing at rest, and the modal state of the programs it is given.

    It starts at the reference pose. Each text ends at rest, so that the next can follow.
    """

    def __init__(self, profile: Profile, *, rate_hz: float | None = None) -> None:
        self.profile = profile
        self._cables = Cables.from_profile(profile)
        self._loads = Loads.from_profile(profile)
        self._period = profile.drives.period if rate_hz is None else 1.0 / rate_hz
        self._limits = MotionLimits.from_profile(profile, direction_change_bound(profile))
        self._audit = Audit(profile)
        self._timeline = Timeline(self._period, profile_shaper(self.profile))
        self._planner = Planner(self._limits, self._cables.reference_G)
        self._interpreter = Interpreter(profile, at_G=self._cables.reference_G)

    @property
    def lines(self) -> int:
        """Lines read so far."""
        return self._interpreter.lines

    @property
    def problems(self) -> int:
        """Lines, limits and cables of the current text that were told as problems."""
        return self._audit.total

    @property
    def modal(self) -> Modal:
        """What the next line inherits from those read so far."""
        return self._interpreter.modal

    def stand_at(self, at_G: Array) -> None:
        """The machine was stopped on its way and stands at (3,) m; modal state stays otherwise."""
        x, y, z = at_G.tolist()
        self._planner, self._timeline = (
            self._planner.moved_to(at_G),
            Timeline(self._period, profile_shaper(self.profile)),
        )
        self._interpreter.modal = replace(self._interpreter.modal, position=(x, y, z), onward=None)

    def timed(self, chunks: Iterable[bytes]) -> Iterator[Command | Timed]:
        """Each command of a text, after the stretches it settles; ends at rest.

        Before a Pause comes everything up to rest. Raises ProgramError, after the last line,
        for text that is not understood.
        """
        self._audit = Audit(self.profile)
        for command in self._interpreter.commands(chunks):
            for stretch in self._planner.stretches(command):
                yield self._timeline.lay(stretch)
            if isinstance(command, Pause):
                yield self._timeline.rest(self._planner.standing)
            yield command
        for stretch in self._planner.close():
            yield self._timeline.lay(stretch)
        yield self._timeline.rest(self._planner.standing)

    def walk(self, chunks: Iterable[bytes]) -> Iterator[Command | Checked]:
        """As ``timed``, with every setpoint of each stretch in its place."""
        for step in self.timed(chunks):
            if isinstance(step, Timed):
                for track in step.tracks():
                    yield self.checked(track)
            else:
                yield step

    def setpoints(self, chunks: Iterable[bytes]) -> Iterator[Setpoints]:
        """Setpoints only; raises MotionError at the first the machine cannot do."""
        for step in self.walk(chunks):
            if isinstance(step, Checked):
                if step.problems:
                    raise MotionError(step.problems)
                yield step.setpoints

    def prepare(self, chunks: Iterable[bytes]) -> list[Setpoints]:
        """All setpoints of a short text, or a refusal that leaves the machine as it was."""
        before = copy.deepcopy((self._planner, self._timeline)), self._interpreter.modal
        try:
            return list(self.setpoints(chunks))
        except BaseException:
            (self._planner, self._timeline), self._interpreter.modal = before
            raise

    def checked(self, track: ToolTrack) -> Checked:
        """Samples of the nozzle -> setpoints of the machine, audited."""
        inside = on_bed(track.position_G, self.profile)
        problems = self._audit.places(track)
        if not inside.all():
            track = track[inside]
        q = track.position_G - self._cables.reference_G
        state = cable_state(self._cables, self._loads, q, q, track.velocity, track.acceleration)
        air = air_command(track.flow, track.air, self.profile.extruder)
        setpoints = Setpoints(
            tick=track.tick,
            t=(track.tick * self._period).astype(np.float64),
            line=track.line,
            nozzle_G=track.position_G,
            upper=q,
            slider=slider(self._cables, state.length),
            tension=state.tension,
            flow=air.flow,
            pressure=air.pressure,
        )
        problems += self._audit.motion(track, state, setpoints)
        return Checked(setpoints, tuple(problems))
