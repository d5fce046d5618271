"""The law of ``Prescribed``: its identity, its optimum, its accuracy on an ideal plant."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from plant_machines import profile_of
from scipy.optimize import lsq_linear

from cdhr_host.control import Gains, Plan, Prescribed, PrescribedState, Seen
from cdhr_host.control.allocation import nearest
from cdhr_host.control.platforms import Platforms
from cdhr_host.mechanism import Cables, tensions
from cdhr_host.mechanism.cables import Loads
from cdhr_host.report.paper.controlled import Loop, followed

SIMULATION = profile_of("paper-simulation")


def random_state(rng: np.random.Generator, size: float) -> tuple[PrescribedState, Plan, Seen]:
    def draw(scale: float) -> np.ndarray:
        return scale * rng.standard_normal(6)

    position = np.tile(rng.uniform([-0.15, -0.15, 0.0], [0.15, 0.15, 0.15]), 2)
    plan = Plan(1.0, position, draw(0.02), draw(0.01))
    seen = Seen(position + draw(size), plan.velocity + draw(5.0 * size))
    return PrescribedState(draw(size), draw(5.0 * size), draw(size)), plan, seen


@given(seed=st.integers(0, 2**32 - 1), size=st.sampled_from([1e-6, 1e-4, 3e-3]), hard=st.booleans())
@settings(max_examples=150, deadline=None)
def test_the_surface_falls_as_designed_saturated_or_not(seed: int, size: float, hard: bool) -> None:
    """s' = -eta sgn(s), or -eta s / phi in the layer, with the plant driven by the clipped forces."""
    gains = Gains(reach=0.3, layer=0.0 if hard else 0.01, integral=5.0)
    controller = Prescribed(SIMULATION, gains)
    state, plan, seen = random_state(np.random.default_rng(seed), size)
    law = controller.law(state, plan, seen)
    real = Platforms(SIMULATION).at(seen.position).acceleration(law.given)
    rate = seen.velocity - plan.velocity - law.lag_slope
    lag_second = law.lag_rate_slope - gains.lag * law.lag_slope
    falling = gains.slope * rate + (real - plan.acceleration - lag_second) + gains.integral * law.error
    switched = np.sign(law.surface) if hard else np.clip(law.surface / gains.layer, -1.0, 1.0)
    assert np.abs(falling + gains.reach * switched).max() < 1e-9


def test_the_identity_is_met_while_saturated() -> None:
    state, plan, seen = random_state(np.random.default_rng(1), 3e-3)
    law = Prescribed(SIMULATION).law(state, plan, seen)
    assert law.saturated
    assert Prescribed(SIMULATION).at_bound(law.given)


def test_at_rest_it_asks_for_the_static_forces() -> None:
    nothing = np.zeros(6)
    plan, seen = Plan(0.0, nothing, nothing, nothing), Seen(nothing, nothing)
    controller = Prescribed(SIMULATION)
    _, action = controller.step(controller.start(), plan, seen, 1e-3)
    home = np.zeros((1, 3))
    wanted = tensions(Cables.from_profile(SIMULATION), Loads.from_profile(SIMULATION), home, home)[0]
    assert action.tension is not None
    assert_allclose(action.tension, wanted, rtol=1e-9)


def test_circle_with_a_boundary_layer_on_an_ideal_plant() -> None:
    """Acceptance row 16."""
    run = followed(SIMULATION, Loop(Gains(reach=0.1, layer=0.01)))
    assert run.saturated == 0
    assert run.worst.max() < 1e-3


def test_integral_takes_a_constant_disturbance_away() -> None:
    """Two per cent more mass than planned, against the same with an integral."""
    masses = SIMULATION.platforms.model_copy(update={"lower_mass": 1.02, "upper_mass": 1.02})
    heavy = SIMULATION.model_copy(update={"platforms": masses})
    errors = []
    for integral in (0.0, 20.0):
        gains = Gains(reach=0.1, layer=0.01, integral=integral)
        errors.append(held_against(heavy, gains))
    assert errors[0] > 2e-4
    assert errors[1] < 0.2 * errors[0]


def held_against(heavy: object, gains: Gains) -> float:
    """m the nozzle is off after 4 s of standing still with a wrong model of its weight."""
    plant, controller = Platforms(heavy), Prescribed(SIMULATION, gains)
    dt, position, velocity = 2e-3, np.zeros(6), np.zeros(6)
    nothing, state = np.zeros(6), controller.start()
    for n in range(2000):
        plan = Plan(n * dt, nothing, nothing, nothing)
        state, action = controller.step(state, plan, Seen(position, velocity), dt)
        velocity = velocity + dt * plant.at(position).acceleration(action.tension)
        position = position + dt * velocity
    return float(np.abs(position[:3]).max())


def test_without_the_auxiliary_system_its_state_stays_empty() -> None:
    controller = Prescribed(SIMULATION, Gains(auxiliary=False))
    _, plan, seen = random_state(np.random.default_rng(2), 3e-3)
    state, _ = controller.step(controller.start(), plan, seen, 1e-3)
    assert not state.lag_rate.any()
    assert not state.total.any()


def test_optimised_forces_trade_the_plane_for_the_height() -> None:
    clip, weighted = (
        followed(SIMULATION, Loop(Gains(reach=0.43, layer=0.0, weight=weight), 2e-3, seconds=6.0)).worst
        for weight in (None, 30.0)
    )
    assert weighted[2] < 0.5 * clip[2]
    assert weighted[:2].min() > 2.0 * clip[:2].max()


def test_restored_height_leaves_the_windows() -> None:
    run = followed(SIMULATION, Loop(Gains(reach=0.43, layer=0.0, vertical=True), 1e-3, seconds=2.0))
    window = SIMULATION.forces
    assert run.tension[:, :3].min() < window.lower_min - 0.01 or run.tension[:, :3].max() > window.lower_max


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_nearest_is_the_bounded_optimum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pull = rng.standard_normal((3, 3)) + 2.0 * np.eye(3)
    wanted, low, high = rng.uniform(0.0, 12.0, 3), np.full(3, 3.0), np.full(3, 9.0)
    rows = np.diag([1.0, 1.0, 30.0]) @ pull
    best = lsq_linear(rows, rows @ wanted, (low, high), method="bvls").x
    ours = nearest(pull, wanted, low, high, 30.0)
    assert ((ours >= low) & (ours <= high)).all()
    assert np.linalg.norm(rows @ (ours - wanted)) <= np.linalg.norm(rows @ (best - wanted)) + 1e-7


def test_state_is_not_changed_in_place() -> None:
    controller = Prescribed(SIMULATION, Gains(integral=1.0))
    state, plan, seen = random_state(np.random.default_rng(3), 1e-5)
    before = replace(state, lag=state.lag.copy(), total=state.total.copy())
    controller.step(state, plan, seen, 1e-3)
    assert (state.lag == before.lag).all()
    assert (state.total == before.total).all()


@pytest.mark.parametrize(("delay", "greatest", "least"), [(5, 6e-2, 4e-2), (15, 0.2, 0.1), (30, 1e3, 2.0)])
def test_delay_costs_speed_times_delay_until_it_costs_stability(
    delay: int, greatest: float, least: float
) -> None:
    """10, 30 and 60 ms at 500 Hz on the circle of 6.28 mm/s."""
    worst = followed(SIMULATION, Loop(Gains(), 2e-3, delay=delay, seconds=6.0)).worst.max()
    assert least < worst < greatest
