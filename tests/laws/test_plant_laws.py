"""Laws of the rigid bodies and the rig, over poses of the whole workspace."""

import math
from typing import NamedTuple

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.mechanism import Cables, Loads, Pairs, lengths, nine_tensions, slider
from cdhr_host.mechanism.pulley import PULLEYS
from cdhr_host.plant import Machine
from cdhr_host.plant.bodies import Bodies, BodiesState, Build, Forces, Wound
from cdhr_host.plant.faults import Budget, Faults
from cdhr_host.plant.rig import Rig, RigState
from cdhr_host.plant.strands import Strands
from cdhr_host.profile import find, read_table, validate
from cdhr_host.values import Array, Feedback, Setpoints

PROFILES = {name: validate(read_table(find(name)))[0] for name in ("paper", "paper-simulation", "paper-wide")}
STILL = (0.0,) * 9
DT = 2.5e-4
STEPS = 160
ERROR = 4e-3
"""of the energy put in: (omega DT)²/8 of the fastest mode, 700 rad/s"""
QUARTER = 0.25
"""of an error of second order is left in half the step"""
ROUNDING = 1e-11
"""J, of the sums that make an energy"""

names = st.sampled_from(sorted(PROFILES))
smooth_models = st.sampled_from(["swivel", "caster"])
seeds = st.integers(0, 2**32 - 1)


def vectors(size: float) -> st.SearchStrategy[tuple[float, float, float]]:
    return st.tuples(*[st.floats(-size, size)] * 3)


class Hung(NamedTuple):
    """A machine at rest at a pose: its state, its nine forces, N, and lengths, m."""

    name: str
    model: str
    state: BodiesState
    force: Array
    span: Array

    def bodies(self, build: Build | None = None) -> Bodies:
        return Bodies(PROFILES[self.name], Strands.from_profile(PROFILES[self.name], self.model), build)

    def wound(self, bodies: Bodies) -> Wound:
        """Sliders that hold the pose with elastic cables."""
        return Wound((self.span - self.force / np.array(bodies.stiffness)).tolist(), STILL)


@st.composite
def hung(draw: st.DrawFn, models: st.SearchStrategy[str] = smooth_models) -> Hung:
    """Within 250 mm of the axis, over the whole height of the bed."""
    name, model = draw(names), draw(models)
    profile = PROFILES[name]
    r, turn = draw(st.floats(0.0, 0.25)), draw(st.floats(0.0, 6.3))
    q = np.array([[r * math.cos(turn), r * math.sin(turn), draw(st.floats(0.0, profile.bed.height))]])
    cables = Cables.from_profile(profile).with_pulley(PULLEYS[model])
    force = nine_tensions(cables, Loads.from_profile(profile), Pairs.from_profile(profile), q, q)[0]
    place = tuple(q[0].tolist())
    strands = Strands.from_profile(profile, model)
    ends = [np.add(np.add(strands.lower, place), arm) for arm in strands.arms]
    ends += [np.add(strands.upper, place)] * 3
    span = np.array([wrapped(*end)[0] for wrapped, end in zip(strands.wrapped, ends, strict=True)])
    return Hung(name, model, BodiesState(lower=place, upper=place), force, span)


@st.composite
def shoves(draw: st.DrawFn) -> BodiesState:
    """Rates to start with, and nothing else."""
    return BodiesState(
        velocity=draw(vectors(0.02)), spin=draw(vectors(0.2)), upper_velocity=draw(vectors(0.02))
    )


def shoved(rest: BodiesState, by: BodiesState) -> BodiesState:
    return rest._replace(velocity=by.velocity, spin=by.spin, upper_velocity=by.upper_velocity)


def energies(bodies: Bodies, start: BodiesState, machine: Hung, dt: float = DT) -> tuple[Array, bool]:
    """J above rest after each step, and whether every cable stayed taut."""
    wound, state, taut = machine.wound(bodies), start, True
    found = [bodies.energy(state, wound)]
    for _ in range(round(STEPS * DT / dt)):
        state, felt = bodies.stepped(state, wound, dt)
        taut = taut and min(felt) > 0.0
        found.append(bodies.energy(state, wound))
    return np.array(found) - bodies.energy(machine.state, wound), taut


@settings(max_examples=60, deadline=None)
@given(hung(), shoves())
def test_nothing_feeds_or_drains_an_undamped_machine(machine: Hung, shove: BodiesState) -> None:
    """What it errs is the integrator's, of second order; a little more or less where cables go slack."""
    bodies, start = machine.bodies(Build(damping=0.0)), shoved(machine.state, shove)
    (whole, taut), (halves, _) = (energies(bodies, start, machine, dt) for dt in (DT, DT / 2))
    error, finer = (np.abs(found - found[0]).max() for found in (whole, halves))
    assert error <= ERROR * whole[0] + ROUNDING
    assert finer <= (1.03 * QUARTER if taut else 0.4) * error + ROUNDING


@settings(max_examples=60, deadline=None)
@given(hung(), shoves(), st.floats(1e-4, 2e-3), st.floats(0.0, 0.1))
def test_damping_and_friction_only_take(
    machine: Hung, shove: BodiesState, damping: float, friction: float
) -> None:
    bodies = machine.bodies(Build(damping=damping, friction=friction))
    found, _ = energies(bodies, shoved(machine.state, shove), machine)
    assert (found - np.minimum.accumulate(found)).max() <= ERROR * found[0] + ROUNDING
    assert found[-1] <= 0.99 * found[0] + ROUNDING


@settings(max_examples=40, deadline=None)
@given(hung(), shoves(), st.floats(0.0, 2e-3), st.floats(0.0, 0.1))
def test_the_balance_of_energy_closes(
    machine: Hung, shove: BodiesState, damping: float, friction: float
) -> None:
    """What is there now is what was there less what dampers and slipping pulleys took."""
    bodies = machine.bodies(Build(damping=damping, friction=friction))
    wound, state = machine.wound(bodies), shoved(machine.state, shove)
    first, lost = bodies.energy(state, wound), 0.0
    put_in = first - bodies.energy(machine.state, wound)
    for _ in range(STEPS):
        after = bodies.step(state, wound, DT)
        lost += bodies.work(state, after, wound, DT).lost
        state = after
    assert abs(bodies.energy(state, wound) - (first - lost)) <= 0.01 * put_in + ROUNDING


@settings(max_examples=60, deadline=None)
@given(hung())
def test_static_forces_keep_both_platforms_where_they_are(machine: Hung) -> None:
    """Given as forces, and as the stretch of elastic cables."""
    bodies = machine.bodies()
    for command in (Forces(machine.force.tolist()), machine.wound(bodies)):
        assert np.abs(np.subtract(bodies.tensions(machine.state, command), machine.force)).max() < 1e-8
        state = machine.state
        for _ in range(100):
            state = bodies.step(state, command, 4 * DT)
        moved = [
            np.abs(np.subtract(now, was)).max() for now, was in zip(state[:6], machine.state[:6], strict=True)
        ]
        assert max(moved) < 1e-9


@settings(max_examples=60, deadline=None)
@given(hung(st.just("swivel")), st.integers(0, 8), st.floats(0.2, 3.0))
def test_one_force_more_moves_them(machine: Hung, cable: int, more: float) -> None:
    bodies, force = machine.bodies(), machine.force.copy()
    force[cable] += more
    state = bodies.step(machine.state, Forces(force.tolist()), DT)
    moving = state.upper_velocity if cable > 5 else state.velocity
    mass = PROFILES[machine.name].platforms
    expected = more * DT / (mass.upper_mass if cable > 5 else mass.lower_mass)
    assert abs(math.hypot(*moving) - expected) < 1e-12


@settings(max_examples=100, deadline=None)
@given(hung(), st.lists(st.floats(-5e-3, 5e-3), min_size=9, max_size=9), shoves())
def test_slack_cables_carry_nothing_and_the_others_their_stretch(
    machine: Hung, paid: list[float], shove: BodiesState
) -> None:
    length, moving = machine.span + paid, shoved(machine.state, shove)
    for damping in (0.0, 1e-3):
        bodies = machine.bodies(Build(damping=damping, friction=0.05))
        felt = np.array(bodies.tensions(moving, Wound(length.tolist(), STILL)))
        assert (felt >= 0.0).all()
        assert (felt[machine.span < length - 1e-12] == 0.0).all()
    still = np.array(bodies.tensions(machine.state, Wound(length.tolist(), STILL)))
    stretched = np.array(bodies.stiffness) * np.maximum(machine.span - length, 0.0)
    assert np.abs(still - stretched).max() < 1e-7


@settings(max_examples=60, deadline=None)
@given(hung(), shoves(), st.floats(1e-4, 0.05))
def test_without_a_taut_cable_both_fall_freely(machine: Hung, shove: BodiesState, out: float) -> None:
    """The spring is between them: their common centre of mass falls at g, and nothing turns."""
    bodies, start = machine.bodies(), shoved(machine.state, shove)
    after, felt = bodies.stepped(start, Wound((machine.span + out).tolist(), STILL), 1e-5)
    assert felt == [0.0] * 9
    mass = PROFILES[machine.name].platforms
    lower = mass.lower_mass * np.subtract(after.velocity, start.velocity)
    upper = mass.upper_mass * np.subtract(after.upper_velocity, start.upper_velocity)
    fallen = (lower + upper) / (mass.lower_mass + mass.upper_mass)
    assert np.abs(fallen - [0.0, 0.0, -9.81e-5]).max() < 1e-14


BUDGETS = st.builds(
    Budget,
    pulley_position=st.floats(0.0, 1e-3),
    run_out=st.floats(0.0, 1e-4),
    play=st.floats(0.0, 5e-5),
    encoder=st.just(1e-6),
    force=st.just(0.05),
    sensor_delay=st.integers(0, 3),
)


def told(machine: Hung, ticks: int, seed: int) -> tuple[RigState, list[list[float]]]:
    """The rig at rest at the pose, and setpoints that wander off from there."""
    cables = Cables.from_profile(PROFILES[machine.name]).with_pulley(PULLEYS[machine.model])
    at = np.array([machine.state.lower])
    start = tuple(slider(cables, lengths(cables, at, at))[0].tolist())
    steps = np.cumsum(1e-4 * np.random.default_rng(seed).standard_normal((ticks, 6)), axis=0)
    return RigState(setpoint=start, cable=start, bodies=machine.state), (start + steps).tolist()


def rig_of(machine: Hung, faults: Faults) -> Rig:
    return Rig(PROFILES[machine.name], faults, build=Build(friction=0.01), pulley=machine.model)


@settings(max_examples=25, deadline=None)
@given(hung(), BUDGETS, seeds, st.integers(1, 19))
def test_a_rig_is_its_seed_and_its_state(machine: Hung, budget: Budget, seed: int, cut: int) -> None:
    """Bit for bit: run twice; and left at any tick, by another rig of this seed taken on from there."""
    one, other = (rig_of(machine, Faults.drawn(seed, budget)) for _ in range(2))
    start, rows = told(machine, 20, seed)
    states = [start]
    for row in rows:
        states.append(one.step(states[-1], row))
    state = states[cut]
    for row, after in zip(rows[cut:], states[cut + 1 :], strict=True):
        state = other.step(state, row)
        assert state == after
        for field in ("slider", "tension"):
            assert (getattr(other.sensed(state), field) == getattr(one.sensed(after), field)).all()
    stranger = rig_of(machine, Faults.drawn(seed + 1, budget)).sensed(state)
    assert (stranger.tension != one.sensed(state).tension).all()


@settings(max_examples=60, deadline=None)
@given(hung(), shoves(), st.floats(1e-5, 1e-3), st.integers(1, 29))
def test_steps_of_bodies_are_of_their_state_alone(
    machine: Hung, shove: BodiesState, dt: float, cut: int
) -> None:
    """Between the steps one machine takes, it may step others: n steps are n calls."""
    bodies, other = machine.bodies(), machine.bodies()
    wound, states = machine.wound(bodies), [shoved(machine.state, shove)]
    for _ in range(30):
        states.append(bodies.step(states[-1], wound, dt))
        bodies.tensions(machine.state, wound)
        bodies.step(machine.state, wound, 0.5 * dt)
    state = states[cut]
    for after in states[cut + 1 :]:
        state, _ = other.stepped(state, wound, dt)
        assert state == after


@settings(max_examples=60, deadline=None)
@given(hung(), seeds, st.lists(st.integers(1, 12), min_size=1, max_size=12))
def test_a_machine_does_not_notice_how_its_ticks_are_cut(machine: Hung, seed: int, sizes: list[int]) -> None:
    start, rows = told(machine, sum(sizes), seed)
    program = setpoints(np.array(rows), machine, seed)
    plant = Machine(PROFILES[machine.name])
    standing = plant.standing(np.array(start.setpoint))
    end, whole = plant.step(standing, program)
    state, at = standing, 0
    for size in sizes:
        state, part = plant.step(state, program[at : at + size])
        assert same(part, whole, slice(at, at + size))
        at += size
    assert (state.slider == end.slider).all()
    assert state.pressure == end.pressure


def same(part: Feedback, whole: Feedback, rows: slice) -> bool:
    measured = ("tick", "setpoint", "slider", "counts", "torque", "pressure")
    return all((getattr(part, name) == getattr(whole, name)[rows]).all() for name in measured)


def setpoints(sliders: Array, machine: Hung, seed: int) -> Setpoints:
    tick = np.arange(len(sliders))
    place = np.tile(machine.state.lower, (len(sliders), 1))
    pressure = np.random.default_rng(seed).uniform(0.0, 2e5, len(sliders))
    force = np.tile(machine.force[[0, 1, 2, 6, 7, 8]], (len(sliders), 1))
    return Setpoints(tick, 0.004 * tick, tick, place, place, sliders, force, 1e-12 * pressure, pressure)
