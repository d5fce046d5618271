"""Text -> Command -> Leg -> ToolTrack -> CableState -> Setpoints, a block at a time."""

import copy
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.extrusion import AirStage, air_command
from cdhr_host.mechanism import UpperMotion
from cdhr_host.motion.leg import AS_PROGRAMMED, FeedOverride
from cdhr_host.motion.limits import MotionLimits, profile_shaper
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.sampling import Stand, Timed, Timeline
from cdhr_host.motion.shaping import Shaper
from cdhr_host.pipeline.audit import Audit, on_bed
from cdhr_host.pipeline.checked import Checked
from cdhr_host.pipeline.drying import Layers, Parking, paused
from cdhr_host.pipeline.leading import Leading
from cdhr_host.pipeline.pushing import Pushing, first_flow, lays
from cdhr_host.pipeline.rig import Rig
from cdhr_host.pipeline.shift import SAME, Shift, nozzle_moving, nozzle_standing, shift
from cdhr_host.profile import Profile
from cdhr_host.program import Interpreter, Modal
from cdhr_host.values import Array, Command, Notice, Pause, Setpoints, ToolTrack

__all__ = ["Checked", "Staircase"]


class Staircase:
    """One machine standing at rest, and the modal state of the programs it is given.

    It starts at the reference pose. Each text ends at rest, so that the next can follow.
    """

    def __init__(self, profile: Profile, *, rate_hz: float | None = None, rig: Rig | None = None) -> None:
        """``rig`` is the profile's, where it is at hand."""
        self.profile = profile
        self.rig = rig or Rig.from_profile(profile)
        self._period = profile.drives.period if rate_hz is None else 1.0 / rate_hz
        self._limits = self.rig.limits()
        self._audit = Audit(profile)
        self._timeline = self._new_timeline()
        self._planner = Planner(self._limits, self.rig.cables.reference_G)
        self._interpreter = Interpreter(profile, at_G=self.rig.cables.reference_G)
        self._offset = np.zeros(3)
        self._airless_since: int | None = 0
        self._layers = Layers(profile.job.layer_time_min)
        self._parking = Parking(profile)
        self._primes = False

    @property
    def lines(self) -> int:
        """Lines read so far."""
        return self._interpreter.lines

    @property
    def problems(self) -> int:
        """Lines, limits and cables of the current text that were told as problems."""
        return self._audit.total

    def _new_timeline(self) -> Timeline:
        return Timeline(self._period, profile_shaper(self.profile), still=0 if self.rig.give is None else 1)

    @property
    def modal(self) -> Modal:
        """What the next line inherits from those read so far."""
        return self._interpreter.modal

    def stand_at(self, at_G: Array, upper: Array | None = None) -> None:
        """The machine was stopped on its way and stands at (3,) m; modal state stays otherwise.

        ``upper`` (3,) m is the upper platform's displacement, if it is not where it belongs.
        """
        x, y, z = at_G.tolist()
        self._planner, self._timeline = self._planner.moved_to(at_G), self._new_timeline()
        self._interpreter.modal = replace(self._interpreter.modal, position=(x, y, z), onward=None)
        self._offset = self._wanted() if upper is None else upper - (at_G - self.rig.cables.reference_G)

    def timed(self, chunks: Iterable[bytes], *, ends: bool = True) -> Iterator[Command | Timed | Shift]:
        """Each command of a text, after the stretches it settles; ends at rest.

        First the upper platform goes where the spring policy wants it; if this text ``ends`` the
        job at the reference pose, it goes back to its reference offset at last.
        Before a Pause comes everything up to rest. Raises ProgramError, after the last line,
        for text that is not understood.
        """
        pushing = Pushing(self.rig.air, self.profile.limits.speed_max)
        yield from self.opened()
        for command in self.commands(chunks):
            yield from pushing.notices(command)
            yield from self.settled(command)
            yield command
        yield from self.closed(ends=ends)
        yield from pushing.summary()

    def commands(self, chunks: Iterable[bytes]) -> Iterator[Command]:
        """A text's commands, by the modal state of those before it."""
        return paused(self._interpreter.commands(chunks), self.profile.job.pause_every_layers)

    def opened(self) -> Iterator[Shift]:
        """What comes before a text's first command."""
        self._audit = Audit(self.profile)
        self._airless_since = self.tick
        yield from self._shift(self._wanted())

    def settled(self, command: Command) -> Iterator[Timed]:
        """Stretches that a further command settles; all there are before a Pause."""
        if self._parking.away and not isinstance(command, Notice):
            yield from self._lowered()
        if lays(command):
            yield from self._readied(command)
        if isinstance(command, Pause):
            yield from self._raised(command.line)
        for stretch in self._planner.stretches(command):
            yield self._timeline.lay(stretch)
        if isinstance(command, Pause):
            yield self._timeline.rest(self._planner.standing)
            self._airless_since = self.tick
            self._primes = True
        yield from self._dried(command)

    def _dried(self, command: Command) -> Iterator[Timed]:
        """Stand where a layer that took too little time ends."""
        if not isinstance(command, Notice) or not self._layers.ends(command):
            return
        yield from self._brought_to_rest()
        missing = self._layers.missing(self._timeline.now)
        if missing > 0.0:
            yield from self._raised(command.line)
            yield from self._brought_to_rest()
            standing = self._planner.standing
            yield self._timeline.lay(Stand(standing.at_G, missing, 0.0, command.line, standing.number))
            self._layers.waited(self._timeline.now)
            yield from self._lowered()

    def _raised(self, line: int) -> Iterator[Timed]:
        """Away from where the nozzle stands, if pauses lift or park."""
        yield from self._brought_to_rest()
        if (way := self._parking.leave(self._planner.standing.at_G, line)) is not None:
            for stretch in self._planner.stretches(way):
                yield self._timeline.lay(stretch)

    def _lowered(self) -> Iterator[Timed]:
        """Back to where it was."""
        if (way := self._parking.come_back()) is not None:
            yield from self._brought_to_rest()
            for stretch in self._planner.stretches(way):
                yield self._timeline.lay(stretch)
            yield from self._brought_to_rest()

    def _brought_to_rest(self) -> Iterator[Timed]:
        for stretch in self._planner.close():
            yield self._timeline.lay(stretch)

    @property
    def drawn(self) -> float:
        """s, roughly, that are drawn and not settled yet."""
        return self._planner.drawn

    def advanced(self) -> Iterator[Timed]:
        """Stretches that all commands so far settle, without waiting for more of them."""
        for stretch in self._planner.advance():
            yield self._timeline.lay(stretch)

    def _readied(self, command: Command) -> Iterator[Timed]:
        """What comes before clay is laid again: the air, and after a pause the clay for the nozzle."""
        self._parking.note(command)
        if self._airless_since is not None:
            yield from self._awaited()
        if self._primes and self.profile.job.resume_prime:
            yield from self._brought_to_rest()
            standing, flow = (
                self._planner.standing,
                first_flow(command, self.rig.air, self.profile.limits.speed_max),
            )
            prime = Stand(standing.at_G, self.profile.job.resume_prime, flow, standing.line, standing.number)
            yield self._timeline.lay(prime)
        self._primes = False

    def _awaited(self) -> Iterator[Timed]:
        """Stand before the first clay for as long as the air needs to be ready for it."""
        yield from self._brought_to_rest()
        assert self._airless_since is not None
        missing = self.rig.air.start_lead - (self.tick - self._airless_since - 2) * self._period
        self._airless_since = None
        if self.rig.air.leads and missing > 0.0:
            standing = self._planner.standing
            yield self._timeline.lay(Stand(standing.at_G, missing, 0.0, standing.line, standing.number))

    def closed(self, *, ends: bool) -> Iterator[Timed | Shift]:
        """What comes after a text's last command, up to rest."""
        yield from self._lowered()
        yield from self._brought_to_rest()
        yield self._timeline.rest(self._planner.standing)
        self._offset = self._wanted()
        if ends and self._at_reference():
            yield from self._shift(np.zeros(3))

    def moved(self, nozzle: UpperMotion, upper: UpperMotion) -> Shift:
        """Both platforms moved from rest to rest; the machine stands there then.

        ``nozzle``: places (N, 3) m in G; ``upper``: displacements of the upper platform.
        """
        standing, ticks = self._planner.standing, self._timeline.reserve(len(nozzle.place))
        x, y, z = nozzle.place[-1].tolist()
        self._planner = self._planner.moved_to(nozzle.place[-1])
        self._interpreter.modal = replace(self._interpreter.modal, position=(x, y, z), onward=None)
        self._offset = upper.place[-1] - (nozzle.place[-1] - self.rig.cables.reference_G)
        return Shift(nozzle_moving(nozzle, np.arange(ticks.start, ticks.stop), standing.line), upper)

    def fork(self, override: FeedOverride = AS_PROGRAMMED) -> "Staircase":
        """This machine as it is now, to be planned on apart from it, with another feed.

        Text is read by one of them only.
        """
        other = copy.copy(self)
        other._planner, other._timeline = self._planner.fork(override), copy.copy(self._timeline)
        other._layers, other._parking = copy.copy(self._layers), copy.copy(self._parking)
        return other

    def restore(self, modal: Modal) -> None:
        """Forget what lines read since then have set."""
        self._interpreter.modal = modal

    def apart(self) -> "Staircase":
        """The same machine where it stands now, with modal state of its own."""
        other = Staircase(self.profile, rig=self.rig)
        other._planner, other._timeline = self._planner.fork(), copy.copy(self._timeline)
        other._offset = self._offset
        x, y, z = self._planner.standing.at_G.tolist()
        other._interpreter.modal = replace(other._interpreter.modal, position=(x, y, z))
        return other

    @property
    def standing_G(self) -> Array:
        """(3,) m, where the nozzle stands once all that is planned was done."""
        return self._planner.standing.at_G

    @property
    def top(self) -> float:
        """m, the top of all clay laid by what is settled; minus infinity where there is none."""
        return self._parking.top

    @property
    def upper(self) -> Array:
        """(3,) m, where the upper platform stands then."""
        return self._planner.standing.at_G - self.rig.cables.reference_G + self._offset

    def reads_with(self, other: "Staircase") -> bool:
        """Whether what one reads is in force for the other."""
        return self._interpreter is other._interpreter

    @property
    def tick(self) -> int:
        """The first that is not planned yet."""
        return self._timeline.tick

    @property
    def feed_override(self) -> FeedOverride:
        """The feed it plans with."""
        return self._planner.override

    @property
    def period(self) -> float:
        """s between two ticks"""
        return self._period

    @property
    def limits(self) -> MotionLimits:
        """What bounds the nozzle's motion."""
        return self._limits

    @property
    def shaper(self) -> Shaper:
        """What smooths the motion against ringing."""
        return self._timeline.shaper

    def walk(self, chunks: Iterable[bytes], *, ends: bool = True) -> Iterator[Command | Checked]:
        """As ``timed``, with every setpoint of each stretch in its place, the air led."""
        leading = Leading(AirStage(self.rig.air, self._period))
        for step in self.timed(chunks, ends=ends):
            if isinstance(step, Timed):
                for track in step.tracks():
                    yield from leading.push(self.checked(track))
            else:
                yield from leading.push(self.shifted(step) if isinstance(step, Shift) else step)
        yield from leading.finish()

    def setpoints(self, chunks: Iterable[bytes], *, ends: bool = True) -> Iterator[Setpoints]:
        """Setpoints only; raises MotionError at the first the machine cannot do."""
        for step in self.walk(chunks, ends=ends):
            if isinstance(step, Checked):
                if step.problems:
                    raise MotionError(step.problems)
                yield step.setpoints

    def prepare(self, chunks: Iterable[bytes]) -> list[Setpoints]:
        """All setpoints of a short text, or a refusal that leaves the machine as it was."""
        before = copy.deepcopy((self._planner, self._timeline, self._offset)), self._interpreter.modal
        try:
            return list(self.setpoints(chunks, ends=False))
        except BaseException:
            (self._planner, self._timeline, self._offset), self._interpreter.modal = before
            raise

    def afresh(self) -> "Staircase":
        """Itself, which tells again what it has told before."""
        self._audit = Audit(self.profile)
        return self

    def checked(self, track: ToolTrack) -> Checked:
        """Samples of the nozzle -> setpoints of the machine, audited."""
        inside = on_bed(track.position_G, self.profile)
        problems, kept = self._audit.places(track), track if inside.all() else track[inside]
        q, upper = self.rig.follow(kept)
        return replace(self._audited(kept, q, upper, problems), track=track)

    def shifted(self, step: Shift) -> Checked:
        """As ``checked``, for motion of the upper platform that is not the policy's."""
        problems = self._audit.places(step.track)
        q = step.track.position_G - self.rig.cables.reference_G
        return self._audited(step.track, q, step.upper, problems)

    def _audited(self, track: ToolTrack, q: Array, upper: UpperMotion, problems: list[Problem]) -> Checked:
        state = self.rig.state(q, track, upper)
        air = air_command(track.flow, track.air, self.rig.air.law)
        setpoints = Setpoints(
            tick=track.tick,
            t=(track.tick * self._period).astype(np.float64),
            line=track.line,
            nozzle_G=track.position_G,
            upper=upper.place,
            slider=self.rig.sliders(state.length, state.tension),
            tension=state.tension,
            flow=air.flow,
            pressure=air.pressure,
        )
        nine = self.rig.nine(q, track, upper)
        problems += self._audit.motion(track, state, nine, setpoints)
        return Checked(setpoints, tuple(problems), track, nine)

    def _wanted(self) -> Array:
        """(3,) m: the offset the policy wants where the nozzle stands."""
        q = self._planner.standing.at_G - self.rig.cables.reference_G
        offset: Array = self.rig.policy.upper(q[None])[0] - q
        return offset

    def _at_reference(self) -> bool:
        away = self._planner.standing.at_G - self.rig.cables.reference_G
        return bool(np.linalg.norm(away) < SAME)

    def _shift(self, offset: Array) -> Iterator[Shift]:
        """Take the upper platform to another offset."""
        standing = self._planner.standing
        way = shift(self.rig, standing.at_G, (self._offset, offset), self._period)
        self._offset = offset
        if way is not None:
            ticks = self._timeline.reserve(len(way.place))
            yield Shift(nozzle_standing(standing, ticks), way)
