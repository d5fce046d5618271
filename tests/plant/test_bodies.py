"""Cables, rigid bodies and the rig on their own."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from plant_machines import profile_of
from scipy.integrate import solve_ivp

from cdhr_host.errors import MotionError
from cdhr_host.mechanism import (
    Cables,
    Pairs,
    jacobian,
    lengths,
    nine_tensions,
    slider,
    tensions,
    trajectories,
)
from cdhr_host.mechanism.cables import Loads
from cdhr_host.mechanism.kinematics import components, wraps_of
from cdhr_host.mechanism.pulley import PULLEYS
from cdhr_host.plant.bodies import Bodies, BodiesState, Build, Forces
from cdhr_host.plant.faults import FAULTLESS, PAPER, Budget, Faults
from cdhr_host.plant.held import Held
from cdhr_host.plant.noise import normal, uniform
from cdhr_host.plant.rig import LONGEST_STEP, Rig, RigState, paired
from cdhr_host.plant.servo import Servo
from cdhr_host.plant.strands import MODELS, Strands
from cdhr_host.plant.turning import rotation, rotation_vector, turned
from cdhr_host.profile import Profile
from cdhr_host.profile.calibration import Calibration

STILL = (0.0,) * 6


def poses(seed: int, count: int = 40) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-0.25, 0.25, (count, 2)), rng.uniform(-0.1, 0.4, count)])


@pytest.mark.parametrize("model", list(MODELS))
def test_strands_are_the_mechanism_cables(model: str) -> None:
    profile = profile_of("paper")
    cables = Cables.from_profile(profile).with_pulley(PULLEYS[model])
    strands, held = Strands.from_profile(profile, model), Held(Strands.from_profile(profile, model))
    q = poses(1)
    run = slider(cables, lengths(cables, q, q))
    pulls = np.array([w.straight() for w in wraps_of(cables, range(6), components(q, slice(0, len(q))))])
    pulls /= np.linalg.norm(pulls, axis=1, keepdims=True)
    for n, place in enumerate(q.tolist()):
        assert_allclose(held.lengths(tuple(place), tuple(place)), run[n], atol=1e-12)
        top = np.add(strands.upper, place)
        for i in (6, 7, 8):
            assert_allclose(strands.wrapped[i](*top)[1:], pulls[i - 3, :, n], atol=1e-12)


def calibrated(name: str) -> Profile:
    """A machine a few millimetres away from its drawing."""
    rng = np.random.default_rng(31)
    found = Calibration(
        pulley_shift_mm=rng.normal(0.0, 3.0, (6, 3)).tolist(),
        attachment_shift_mm=rng.normal(0.0, 0.5, (6, 3)).tolist(),
        reference_shift_mm=[1.5, -2.0, 1.0],
    )
    return profile_of(name).model_copy(update={"calibration": found})


@pytest.mark.parametrize("model", list(MODELS))
def test_a_calibrated_machine_is_the_same_in_plan_and_simulation(model: str) -> None:
    """Sliders, and forces at rest: six by the mechanism, nine by the plant."""
    profile = calibrated("paper")
    cables, loads = Cables.from_profile(profile).with_pulley(PULLEYS[model]), Loads.from_profile(profile)
    strands = Strands.from_profile(profile, model)
    held, q = Held(strands), poses(5)
    run = slider(cables, lengths(cables, q, q))
    for place, row in zip(q.tolist(), run, strict=True):
        assert_allclose(held.lengths(tuple(place), tuple(place)), row, atol=1e-12)
    if model == "fixed-plane":
        return
    bodies = Bodies(profile, strands)
    nine = nine_tensions(cables, loads, Pairs.from_profile(profile), q, q)
    for place, force in zip(q.tolist(), nine.tolist(), strict=True):
        state = BodiesState(lower=tuple(place), upper=tuple(place))
        after = bodies.step(state, Forces(force), 1e-3)
        moved = [np.abs(np.subtract(a, b)).max() for a, b in zip(after[:6], state[:6], strict=True)]
        assert max(moved) < 1e-12


@pytest.mark.parametrize("model", list(MODELS))
def test_held_finds_the_pose_again(model: str) -> None:
    profile = profile_of("paper-simulation")
    held = Held(Strands.from_profile(profile, model, moved=1e-3 * normal(3, 0, 0, 18).reshape(6, 3)))
    for place in poses(2).tolist():
        run = held.lengths(tuple(place), tuple(place))
        assert_allclose(held.lower(run[:3], (0.0, 0.0, 0.0)), place, atol=1e-10)
        assert_allclose(held.upper(run[3:], (0.0, 0.0, 0.0)), place, atol=1e-10)


def test_no_pose_is_refused() -> None:
    held = Held(Strands.from_profile(profile_of("paper")))
    with pytest.raises(MotionError, match="no pose has these cable lengths"):
        held.lower((-0.8, -0.8, 0.9), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("column", ["paper", "paper-simulation"])
@pytest.mark.parametrize("dt", [1e-3, 4e-3])
def test_the_reference_pose_is_at_rest(column: str, dt: float) -> None:
    profile = profile_of(column)
    bodies = Bodies(profile, Strands.from_profile(profile), Build(damping=0.0))
    wound = bodies.wound(STILL, STILL)
    six = tensions(
        Cables.from_profile(profile), Loads.from_profile(profile), np.zeros((1, 3)), np.zeros((1, 3))
    )
    assert_allclose(paired(bodies.tensions(BodiesState(), wound)), six[0], rtol=1e-9)
    state = BodiesState()
    for _ in range(200):
        state = bodies.step(state, wound, dt)
    assert np.abs(state.lower).max() < 1e-12
    assert np.abs(rotation_vector(state.turn)).max() < 1e-9


def test_an_undamped_machine_keeps_its_energy() -> None:
    """To the second order: a quarter of the error in half the step."""
    profile = profile_of("paper")
    bodies = Bodies(profile, Strands.from_profile(profile), Build(damping=0.0, mass_height=0.01))
    wound, rest = bodies.wound(STILL, STILL), BodiesState()
    start = BodiesState(velocity=(0.01, 0.02, 0.01), spin=(0.05, 0.0, 0.1), upper_velocity=(0.0, 0.0, 0.02))
    moving = bodies.energy(start, wound) - bodies.energy(rest, wound)
    worst = []
    for steps in (4000, 8000):
        state, found = start, 0.0
        for _ in range(steps):
            state = bodies.step(state, wound, 1.0 / steps)
            found = max(found, abs(bodies.energy(state, wound) - bodies.energy(rest, wound) - moving))
        worst.append(found)
    assert worst[0] < 0.01 * moving
    assert worst[1] / worst[0] == pytest.approx(0.25, abs=0.02)


def moved_sliders(t: float) -> tuple[list[float], list[float]]:
    """(6,) m and m/s."""
    along = range(6)
    return [4e-4 * math.sin(9.0 * t + i) - 4e-4 * math.sin(i) for i in along], [
        36e-4 * math.cos(9.0 * t + i) for i in along
    ]


@pytest.mark.parametrize(
    "build", [Build(damping=2e-3), Build(friction=0.1), Build(friction=0.05, damping=0.0)]
)
def test_energy_is_what_was_supplied_less_what_was_lost(build: Build) -> None:
    """Moving sliders, dampers, slipping pulleys: the balance closes, the better the shorter the step."""
    profile = profile_of("paper")
    bodies = Bodies(profile, Strands.from_profile(profile), build)
    open_, lost = [], 0.0
    for steps in (1000, 2000):
        dt, state = 0.5 / steps, BodiesState(velocity=(0.02, 0.01, 0.0))
        state = bodies.step(state, bodies.wound(STILL, STILL), 1e-9)
        first, balance, lost = state, 0.0, 0.0
        for n in range(steps):
            wound = bodies.wound(*moved_sliders((n + 0.5) * dt))
            after = bodies.step(state, wound, dt)
            work = bodies.work(state, after, wound, dt)
            assert work.lost >= -1e-9
            balance, lost, state = balance + work.supplied - work.lost, lost + work.lost, after
        end = bodies.wound(*moved_sliders(0.5))
        gained = bodies.energy(state, end) - bodies.energy(first, bodies.wound(*moved_sliders(0.0)))
        open_.append(abs(gained - balance))
    assert lost > 1e-5
    assert open_[0] < 0.02 * lost
    assert open_[1] < 0.6 * open_[0] + 1e-9


def test_damping_takes_energy_away() -> None:
    profile = profile_of("paper")
    bodies = Bodies(profile, Strands.from_profile(profile), Build(damping=2e-3))
    wound = bodies.wound(STILL, STILL)
    state = BodiesState(velocity=(0.01, 0.0, 0.0))
    for _ in range(2000):
        state = bodies.step(state, wound, 1e-3)
    assert np.abs(state.velocity).max() < 1e-4


def test_friction_works_against_the_motion_once_pulleys_slip() -> None:
    """A cable that runs out pulls 10 % more than its drive, one that runs in 10 % less, at any speed."""
    profile = profile_of("paper")
    free, rubbing = (Bodies(profile, Strands.from_profile(profile), Build(friction=mu)) for mu in (0.0, 0.1))
    force = Forces(free.tensions(BodiesState(), free.wound(STILL, STILL)))
    held = rubbing.step(BodiesState(), force, 1e-9)
    for way, sign in ((2e-3, 1), (-2e-3, -1)):
        up = held._replace(lower=(0.0, 0.0, way))
        without, found = np.array(free.tensions(up, force)), np.array(rubbing.tensions(up, force))
        assert_allclose(found[:6], (1.0 + sign * 0.1) * without[:6], rtol=1e-12)
    near = np.array(rubbing.tensions(held._replace(lower=(0.0, 0.0, 1e-6)), force)) - np.array(force.force)
    assert (near[:6] > 0.0).all()
    assert (near[:6] < 0.02 * np.array(force.force)[:6]).all()


def settling(dt: float) -> tuple[BodiesState, list[float]]:
    """Strong friction: the end of 3 s after a shove, and the greatest speed in each half second, m/s."""
    profile = profile_of("paper-wide")
    bodies = Bodies(profile, Strands.from_profile(profile), Build(friction=0.1))
    wound, greatest = bodies.wound(STILL, STILL), []
    state = bodies.step(BodiesState(), wound, dt)._replace(velocity=(0.05, 0.0, 0.02), spin=(0.3, 0.0, 0.0))
    for _ in range(6):
        found = 0.0
        for _ in range(round(0.5 / dt)):
            state = bodies.step(state, wound, dt)
            found = max(found, *np.abs(state.velocity), *np.abs(state.upper_velocity))
        greatest.append(found)
    return state, greatest


def test_friction_does_not_chatter() -> None:
    """At the rig's longest step as at a fine one the machine rings down, and ends in one place."""
    ends = {dt: settling(dt) for dt in (2.5e-4, 1e-3, LONGEST_STEP)}
    fine = ends[2.5e-4][0]
    for state, greatest in ends.values():
        assert all(later < 0.6 * sooner for sooner, later in pairwise(greatest))
        assert greatest[-1] < 1e-4
        for part in ("lower", "upper"):
            assert_allclose(getattr(state, part), getattr(fine, part), atol=5e-7)


def test_cables_do_not_push() -> None:
    profile = profile_of("paper")
    bodies = Bodies(profile, Strands.from_profile(profile))
    assert min(bodies.tensions(BodiesState(), bodies.wound((0.01,) * 6, STILL))) == 0.0


def test_turning_by_steps_is_turning_at_once() -> None:
    turn, spin, ball = (1.0, 0.0, 0.0, 0.0), (0.3, -0.2, 0.1), (2.0, 2.0)
    for _ in range(100):
        turn, spin = turned(turn, spin, ball, 0.01)
    assert_allclose(rotation_vector(turn), (0.3, -0.2, 0.1), atol=1e-12)
    assert_allclose(np.array(rotation(turn)) @ np.array(rotation(turn)).T, np.eye(3), atol=1e-12)
    assert rotation_vector((1.0, 0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)
    assert turned(turn, (0.0, 0.0, 0.0), ball, 1.0) == (turn, (0.0, 0.0, 0.0))
    after, _ = turned(turn, (0.0, 0.0, 4.0), ball, 1.0)
    assert math.isclose(rotation_vector(after)[2], 4.1 - 2 * math.pi, abs_tol=0.1)


def test_free_turning_is_euler_s_equation() -> None:
    """Against an integration of I w' = -w x I w of a plate, with the axes carried along."""
    across, about, turn, spin = 1.6e-3, 3.2e-3, (1.0, 0.0, 0.0, 0.0), (0.7, -0.4, 1.1)
    inertia = np.diag([across, across, about])

    def rates(_: float, now: np.ndarray) -> np.ndarray:
        body, w, x, y, z = now[:3], *now[3:]
        wx, wy, wz = body
        quaternion = 0.5 * np.array(
            [
                -x * wx - y * wy - z * wz,
                w * wx + y * wz - z * wy,
                w * wy + z * wx - x * wz,
                w * wz + x * wy - y * wx,
            ]
        )
        return np.concatenate([-np.linalg.solve(inertia, np.cross(body, inertia @ body)), quaternion])

    found = solve_ivp(rates, (0.0, 2.0), [*spin, *turn], rtol=1e-11, atol=1e-13).y[:, -1]
    after, now = turned(turn, spin, (across, about), 2.0)
    assert_allclose(after, found[3:], atol=1e-9)
    assert_allclose(now, found[:3] @ np.array(rotation(after)), atol=1e-9)


def commands(count: int) -> list[list[float]]:
    cables = Cables.from_profile(profile_of("paper"))
    q = trajectories.eq15(np.arange(1, count + 1) * profile_of("paper").drives.period)
    return slider(cables, lengths(cables, q, q)).tolist()


def ran(rig: Rig, rows: list[list[float]]) -> list[RigState]:
    states = [RigState()]
    for row in rows:
        states.append(rig.step(states[-1], row))
    return states


def test_sliders_of_the_rig_are_the_servo_s() -> None:
    profile, rows = profile_of("paper"), commands(300)
    servo = Servo(profile.drives)
    _, wanted, _ = servo.step(servo.standing(np.zeros(6), np.zeros(6)), np.array(rows))
    states = ran(Rig(profile, rigid=True), rows)[1:]
    assert_allclose([np.add(s.setpoint, s.error) for s in states], wanted, atol=1e-12)


def test_a_rigid_rig_goes_where_the_mechanism_says() -> None:
    profile, rows = profile_of("paper"), commands(500)
    q = trajectories.eq15(np.arange(1, 501) * profile.drives.period)
    reached = np.array([state.bodies.lower for state in ran(Rig(profile, rigid=True), rows)[1:]])
    assert np.abs(reached - q).max() < 2e-5


def test_an_elastic_rig_follows_the_rigid_one() -> None:
    profile, rows = profile_of("paper"), commands(500)
    rigid, elastic = (ran(Rig(profile, rigid=which), rows)[-1] for which in (True, False))
    assert_allclose(elastic.bodies.lower, rigid.bodies.lower, atol=1e-4)


def test_faults_are_a_function_of_their_seed() -> None:
    budget = replace(PAPER, encoder=1e-6, force=0.05, sensor_delay=2)
    rows = commands(50)

    def once(seed: int) -> tuple[RigState, list[float]]:
        rig = Rig(profile_of("paper"), Faults.drawn(seed, budget))
        state = ran(rig, rows)[-1]
        return state, [*rig.sensed(state).slider, *rig.sensed(state).tension]

    assert once(1) == once(1)
    assert once(1) != once(2)


def test_sensors_are_late_by_their_delay() -> None:
    profile, rows = profile_of("paper"), commands(40)
    rig = Rig(profile, replace(FAULTLESS, budget=Budget(sensor_delay=3)), rigid=True)
    states = ran(rig, rows)
    heard = rig.sensed(states[30]).slider
    then = np.add(states[27].setpoint, states[27].error)
    assert_allclose(heard, then, atol=4e-9)


def test_lost_motion_and_run_out_stay_within_their_budget() -> None:
    faults = Faults.drawn(5, Budget(play=1e-4, run_out=2e-4))
    assert faults.lagging((0.0,) * 6, (5e-5,) * 6) == (0.0,) * 6
    assert_allclose(faults.lagging((0.0,) * 6, (3e-4,) * 6), 2e-4)
    assert_allclose(faults.lagging((2e-4,) * 6, (1.5e-4,) * 6), 2e-4)
    ran_out = np.array([faults.run_out((x,) * 6, 0.011) for x in np.linspace(-0.2, 0.2, 999)])
    assert np.abs(ran_out - np.linspace(-0.2, 0.2, 999)[:, None]).max() <= 4e-4
    assert faults.run_out((0.0,) * 6, 0.011) == (0.0,) * 6


def test_noise_does_not_depend_on_the_order() -> None:
    later = normal(1, 2, 5000, 3)
    assert (normal(1, 2, 5000, 3) == later).all()
    assert (normal(1, 3, 5000, 3) != later).all()
    draws = np.array([uniform(1, 0, n, 2) for n in range(2000)])
    assert abs(draws.mean() - 0.5) < 0.03


def test_the_gradient_of_a_swivelling_pulley_is_its_direction() -> None:
    profile = profile_of("paper")
    cables, strands = Cables.from_profile(profile), Strands.from_profile(profile)
    q = poses(4, 10)
    slopes = jacobian(cables, q, q)
    for n, place in enumerate(q.tolist()):
        top = np.add(strands.upper, place)
        assert_allclose([strands.wrapped[i](*top)[1:] for i in (6, 7, 8)], -slopes[n, 3:], atol=1e-12)
