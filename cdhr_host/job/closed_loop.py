"""A controller on the simulated rig, tick by tick: setpoints in, what the loop made of them out.

``outer`` shifts the positions before they become sliders; ``ppc`` drives the platforms by
force, and the sliders are what the cables then ran. Both close the loop inside the simulation,
at the tick the measurement belongs to, so that the buffer of a link adds no latency. Used as
a stage between the staircase and a link: what comes out are setpoints like any others.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Final, Protocol

import numpy as np

from cdhr_host.control import (
    Action,
    Gains,
    Mode,
    Outer,
    OuterSettings,
    OuterState,
    Plan,
    PoseSource,
    Prescribed,
    PrescribedState,
    Seen,
)
from cdhr_host.drives.rows import joined
from cdhr_host.errors import JobError, Problem
from cdhr_host.mechanism import Cables, lengths, slider
from cdhr_host.mechanism.pairs import Pairs, shares
from cdhr_host.motion.hold import path_true_stop, rows_needed
from cdhr_host.plant.bodies import Bodies, BodiesState, Forces
from cdhr_host.plant.capture import Camera, SimulatedCapture
from cdhr_host.plant.faults import FAULTLESS, PAPER, Faults
from cdhr_host.plant.held import Held
from cdhr_host.plant.rig import Rig, RigState
from cdhr_host.plant.strands import Strands
from cdhr_host.profile import Profile
from cdhr_host.values import Array, Setpoints

INNER_STEPS: Final = 4
"""control steps in a tick of force control: 1 kHz at 4 ms"""

Say = Callable[[str], None]
Watched = Callable[["Truth"], PoseSource]


@dataclass(frozen=True, slots=True)
class Setup:
    """The simulated rig and the loop around it."""

    faults: Faults = FAULTLESS
    rigid: bool = False
    """cables that do not stretch"""
    outer: OuterSettings = field(default_factory=OuterSettings)
    gains: Gains = field(default_factory=lambda: Gains(at_plan=True))


class Truth:
    """Where the simulated nozzle really was: (3,) m of displacement by time, between ticks linearly."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._start: float | None = None
        self.positions: list[tuple[float, float, float]] = [(0.0, 0.0, 0.0)]

    def add(self, t: float, position: tuple[float, float, float]) -> None:
        """Where it was at the end of the tick of time ``t``; ticks come one after the other."""
        if self._start is None:
            self._start = t - self._period
        self.positions.append(position)

    def __call__(self, t: float) -> Array:
        """Times before the start or beyond the last tick give the first or last position."""
        start = 0.0 if self._start is None else self._start
        place = min(max((t - start) / self._period, 0.0), len(self.positions) - 1.0)
        before = int(place)
        after = min(before + 1, len(self.positions) - 1)
        a, b = np.array(self.positions[before]), np.array(self.positions[after])
        return np.asarray(a + (place - before) * (b - a))


class Loop(Protocol):
    """A simulated plant with its controller."""

    truth: Truth

    def tick(self, plan: Plan, *, last: bool = False) -> tuple[Array, Action]:
        """Run a tick from this plan on: (6,) m of sliders commanded or run, and what was done.

        In the ``last`` one nothing is corrected any more, so that setpoints at rest stay so.
        """
        ...


class OuterLoop:
    """Positions to the drives, shifted by ``Outer``."""

    def __init__(self, profile: Profile, setup: Setup, watched: Watched) -> None:
        self._rig = Rig(profile, setup.faults, rigid=setup.rigid)
        self._controller = Outer(profile, setup.outer)
        self._cables = Cables.from_profile(profile)
        self._period = profile.drives.period
        self._sense = not setup.rigid
        self._rig_state, self._state = RigState(), self._controller.start()
        self._action = Action(Mode.OPEN)
        self.truth = Truth(self._period)
        self._source = watched(self.truth)

    @property
    def state(self) -> OuterState:
        """Of the controller."""
        return self._state

    def tick(self, plan: Plan, *, last: bool = False) -> tuple[Array, Action]:
        """See ``Loop``."""
        if not last:
            self._action = self._decided(plan)
        commanded = shifted(self._cables, plan.position[None], self._action)[0]
        self._rig_state = self._rig.step(self._rig_state, commanded.tolist())
        self.truth.add(plan.t, self._rig_state.bodies.lower)
        return commanded, self._action if not last else replace(self._action, notice="")

    def _decided(self, plan: Plan) -> Action:
        tension = self._rig.sensed(self._rig_state).tension if self._sense and self._rig_state.tick else None
        seen = Seen(plan.position, plan.velocity, tension, self._source.latest(plan.t))
        self._state, action = self._controller.step(self._state, plan, seen, self._period)
        return action


class ForceLoop:
    """Forces to the platforms by ``Prescribed``, poses from the lengths the cables have."""

    def __init__(self, profile: Profile, setup: Setup, watched: Watched) -> None:  # noqa: ARG002
        self._bodies = Bodies(profile, Strands.from_profile(profile, moved=setup.faults.moved))
        self._controller = Prescribed(profile, setup.gains)
        self._cables, self._pairs = Cables.from_profile(profile), Pairs.from_profile(profile)
        self._period = profile.drives.period
        self._body, self._state = BodiesState(), self._controller.start()
        self._run = self._bodies.run(self._body)
        self._held = Held(Strands.from_profile(profile))
        self._pose = self._body.lower, self._body.upper
        self._seen = np.zeros(6)
        self.truth = Truth(self._period)

    @property
    def state(self) -> PrescribedState:
        """Of the controller."""
        return self._state

    def tick(self, plan: Plan, *, last: bool = False) -> tuple[Array, Action]:
        """See ``Loop``; in the last tick the drives hold the sliders where they are."""
        dt = self._period / INNER_STEPS
        action = Action(Mode.CLOSED)
        for n in range(0 if last else INNER_STEPS):
            action = self._inner(_ahead(plan, n * dt), dt)
        self.truth.add(plan.t, self._body.lower)
        return np.array(self._run), action

    def _inner(self, plan: Plan, dt: float) -> Action:
        lower, upper = self._pose
        self._pose = self._held.lower(self._run[:3], lower), self._held.upper(self._run[3:], upper)
        position = np.array([*self._pose[0], *self._pose[1]])
        seen = Seen(position, (position - self._seen) / dt)
        self._seen = position
        self._state, action = self._controller.step(self._state, plan, seen, dt)
        if action.tension is None:
            raise JobError(Problem("control", "the force controller gave no forces"))
        shared = shares(self._cables, self._pairs, position[None, :3], action.tension[None, :3])
        force = [*shared.left[0].tolist(), *shared.right[0].tolist(), *action.tension[3:].tolist()]
        self._body = self._bodies.step(self._body, Forces(force), dt)
        self._run = self._bodies.run(self._body)
        return action


def simulated(control: str, profile: Profile, *, seed: int = 1, watched: Watched | None = None) -> Loop:
    """``outer`` or ``ppc`` on the machine of this seed, drawn from the paper's budget of faults.

    Without ``watched`` a simulated camera with that budget's noise is the pose source. Raises
    JobError for any other word.
    """
    setup = Setup(Faults.drawn(seed, PAPER))
    camera = Camera(noise=PAPER.camera, seed=seed)
    source = watched or (lambda truth: SimulatedCapture(camera, truth))
    if control == "outer":
        return OuterLoop(profile, setup, source)
    if control == "ppc":
        return ForceLoop(profile, setup, source)
    raise JobError(
        Problem("control", f"no control '{control}'", hint="there are outer and ppc, and none without a loop")
    )


def closed_loop(
    setpoints: Iterator[Setpoints], loop: Loop, profile: Profile, say: Say
) -> Iterator[Setpoints]:
    """Setpoints with the sliders as the loop commands them; ``say`` hears every change of mode.

    When the error leaves the funnel, what comes last is a path-true stop with the air off, and
    JobError with the line.
    """
    planned = _Ahead(setpoints, Cables.from_profile(profile), profile.drives.period)
    for rows, plans in planned.batches():
        done = np.empty((len(rows), 6))
        for n, plan in enumerate(plans):
            done[n], action = loop.tick(plan, last=planned.ended)
            if action.notice:
                say(action.notice)
            if action.mode is Mode.STOP:
                yield replace(rows[:n], slider=done[:n])
                yield _stopped(planned.rest(rows[n:], rows_needed(profile)), profile, action)
                raise JobError(Problem("funnel", action.notice, line=int(rows.line[n])))
        yield replace(rows, slider=done)


def shifted(cables: Cables, position: Array, action: Action) -> Array:
    """(N, 6) m of both platforms -> (N, 6) m of sliders with the action's shift added."""
    moved = position if action.shift is None else position + action.shift
    return slider(cables, lengths(cables, moved[:, :3], moved[:, 3:]))


def _stopped(rows: Setpoints, profile: Profile, action: Action) -> Setpoints:
    """The path-true stop of what was planned, with the correction held."""
    cables = Cables.from_profile(profile)
    stop = path_true_stop(rows, profile)
    position = np.hstack([stop.nozzle_G - cables.reference_G, stop.upper])
    return replace(stop, slider=shifted(cables, position, action))


def _ahead(plan: Plan, dt: float) -> Plan:
    """The plan ``dt`` s later at constant acceleration."""
    velocity = plan.velocity + dt * plan.acceleration
    position = plan.position + dt * (plan.velocity + 0.5 * dt * plan.acceleration)
    return Plan(plan.t + dt, position, velocity, plan.acceleration)


class _Ahead:
    """Batches of rows with the plan at each, one row looked ahead for the rates."""

    def __init__(self, setpoints: Iterator[Setpoints], cables: Cables, period: float) -> None:
        self._setpoints = setpoints
        self._reference_G = cables.reference_G
        self._period = period
        self.ended = False
        self._held: Setpoints | None = None
        self._before: Array | None = None

    def batches(self) -> Iterator[tuple[Setpoints, list[Plan]]]:
        """Rows in order with their plans; ``ended`` when it is the last row, a rest, by itself."""
        for batch in self._setpoints:
            if not len(batch):
                continue
            rows = batch if self._held is None else joined([self._held, batch])
            self._held = rows[-1:]
            if len(rows) > 1:
                yield rows[:-1], self._plans(rows, len(rows) - 1)
        if self._held is not None:
            rows, self._held, self.ended = self._held, None, True
            yield rows, self._plans(rows, 1)

    def rest(self, rows: Setpoints, count: int) -> Setpoints:
        """These rows and those after them, ``count`` or as many as there are."""
        found = rows if self._held is None else joined([rows, self._held])
        while len(found) < count and (batch := next(self._setpoints, None)) is not None:
            found = joined([found, batch])
        return found

    def _plans(self, rows: Setpoints, count: int) -> list[Plan]:
        """The first ``count`` rows, with velocities and accelerations by differences."""
        places = np.hstack([rows.nozzle_G - self._reference_G, rows.upper])
        first = places[:1] if self._before is None else self._before[None]
        padded = np.vstack([first, places, places[-1:]])
        self._before = places[count - 1]
        velocity = (padded[2:] - padded[:-2]) / (2.0 * self._period)
        second = (padded[2:] - 2.0 * places + padded[:-2]) / self._period**2
        return [Plan(float(rows.t[n]), places[n], velocity[n], second[n]) for n in range(count)]
