"""Laws of both controllers, over poses of the whole workspace."""

import math
from dataclasses import replace

import numpy as np
from hypothesis import event, given, settings
from hypothesis import strategies as st

from cdhr_host.control import (
    Funnel,
    Gains,
    Mode,
    Outer,
    OuterSettings,
    Plan,
    PoseSample,
    Prescribed,
    PrescribedState,
    Seen,
)
from cdhr_host.mechanism import Cables, Loads, accelerations
from cdhr_host.profile import find, read_table, validate
from cdhr_host.values import Array

PROFILES = {name: validate(read_table(find(name)))[0] for name in ("paper", "paper-simulation", "paper-wide")}
DT = 0.004
ZERO = np.zeros(6)

names = st.sampled_from(sorted(PROFILES))
seeds = st.integers(0, 2**32 - 1)


@st.composite
def machines(draw: st.DrawFn) -> tuple[str, Array]:
    """A machine and a pose (6,) m: within 250 mm of the axis, over the whole height of the bed."""
    name = draw(names)
    r, turn = draw(st.floats(0.0, 0.25)), draw(st.floats(0.0, 6.3))
    place = [r * math.cos(turn), r * math.sin(turn), draw(st.floats(0.0, PROFILES[name].bed.height))]
    return name, np.array(place * 2)


@st.composite
def gains(draw: st.DrawFn) -> Gains:
    """All that keep the identity: not the printed restoring of the vertical, not J at the plan."""
    return Gains(
        slope=draw(st.floats(0.5, 30.0)),
        reach=draw(st.floats(0.0, 1.0)),
        layer=draw(st.sampled_from([0.0, 1e-3, 1e-2])),
        lag=draw(st.floats(0.0, 20.0)),
        lag_rate=draw(st.floats(0.0, 20.0)),
        integral=draw(st.floats(0.0, 20.0)),
        weight=draw(st.sampled_from([None, 1.0, 30.0])),
    )


sizes = st.sampled_from([0.0, 1e-6, 1e-4, 3e-3, 0.02])
"""m the pose is off the plan; of rates five times as much"""


def moment(pose: Array, seed: int, size: float) -> tuple[PrescribedState, Plan, Seen]:
    rng = np.random.default_rng(seed)

    def drawn(scale: float) -> Array:
        return scale * rng.standard_normal(6)

    plan = Plan(1.0, pose, drawn(0.05), drawn(0.3))
    seen = Seen(pose + drawn(size), plan.velocity + drawn(5.0 * size))
    return PrescribedState(drawn(size), drawn(5.0 * size), drawn(size)), plan, seen


@settings(max_examples=200, deadline=None)
@given(machines(), gains(), seeds, sizes)
def test_the_surface_falls_as_prescribed_saturated_or_not(
    machine: tuple[str, Array], chosen: Gains, seed: int, size: float
) -> None:
    """s' = -eta sgn(s), or -eta s / phi in the layer, on the platforms as the mechanism has them."""
    name, pose = machine
    profile = PROFILES[name]
    state, plan, seen = moment(pose, seed, size)
    law = Prescribed(profile, chosen).law(state, plan, seen)
    lower, upper = seen.position[None, :3], seen.position[None, 3:]
    found = accelerations(
        Cables.from_profile(profile), Loads.from_profile(profile), lower, upper, law.given[None]
    )
    real = np.concatenate([found[0][0], found[1][0]])
    rate = seen.velocity - plan.velocity - law.lag_slope
    second = real - plan.acceleration - (law.lag_rate_slope - chosen.lag * law.lag_slope)
    falling = chosen.slope * rate + second + chosen.integral * law.error
    surface = chosen.slope * law.error + rate + chosen.integral * state.total
    event(f"saturated {law.saturated}")
    hard = chosen.layer == 0.0
    switched = np.sign(law.surface) if hard else np.clip(law.surface / chosen.layer, -1.0, 1.0)
    assert np.abs(law.surface - surface).max() < 1e-12
    assert np.abs(falling + chosen.reach * switched).max() < 1e-9


@settings(max_examples=40, deadline=None)
@given(machines(), gains(), st.booleans(), st.booleans(), seeds, st.sampled_from([1e-6, 3e-3, 0.02, 0.1]))
def test_commands_are_inside_the_force_windows(
    machine: tuple[str, Array], chosen: Gains, auxiliary: bool, at_plan: bool, seed: int, size: float
) -> None:
    """Step after step, however wrong the machine is."""
    name, pose = machine
    window = PROFILES[name].forces
    controller = Prescribed(PROFILES[name], replace(chosen, auxiliary=auxiliary, at_plan=at_plan))
    state = controller.start()
    for n in range(6):
        _, plan, seen = moment(pose, seed + n, size)
        state, action = controller.step(state, plan, seen, DT)
        lower, upper = action.tension[:3], action.tension[3:]
        assert window.lower_min <= lower.min()
        assert lower.max() <= window.lower_max
        assert window.upper_min <= upper.min()
        assert upper.max() <= window.upper_max


@settings(max_examples=60, deadline=None)
@given(machines(), gains(), seeds)
def test_forces_inside_their_windows_are_given_as_wanted(
    machine: tuple[str, Array], chosen: Gains, seed: int
) -> None:
    """And then nothing drives the auxiliary system, which keeps what it had."""
    name, pose = machine
    controller = Prescribed(PROFILES[name], chosen)
    state, plan, seen = moment(pose, seed, 1e-5)
    law = controller.law(state, plan, seen)
    free = not controller.at_bound(law.wanted)
    event(f"free {free}")
    if free:
        assert (law.given == law.wanted).all()
        assert np.abs(law.lag_rate_slope + chosen.lag_rate * state.lag_rate).max() < 1e-15
    after, _ = controller.step(state, plan, seen, DT)
    assert ((after.total == state.total).all()) == (law.saturated or not law.error.any())


@st.composite
def outers(draw: st.DrawFn) -> OuterSettings:
    first = draw(st.floats(1e-3, 8e-3))
    return OuterSettings(
        gain=draw(st.floats(0.1, 20.0)),
        rate=draw(st.floats(1e-4, 5e-3)),
        range=draw(st.floats(1e-5, 1e-3)),
        funnel=Funnel(first, first * draw(st.floats(0.1, 1.0)), draw(st.floats(0.1, 5.0))),
        patience=draw(st.integers(1, 5)),
        tension_gain=draw(st.floats(0.0, 5.0)),
        tension_range=draw(st.floats(1e-4, 5e-3)),
    )


@settings(max_examples=60, deadline=None)
@given(machines(), outers(), seeds, st.sampled_from([0.1, 0.3, 0.5, 5.0]))
def test_the_correction_keeps_its_rate_and_its_range(
    machine: tuple[str, Array], chosen: OuterSettings, seed: int, share: float
) -> None:
    """Whatever camera and force sensors say, late, twice or not at all; and a stop is for good."""
    name, pose = machine
    outer, rng = Outer(PROFILES[name], chosen), np.random.default_rng(seed)
    state, shift, mode, sample = outer.start(), np.zeros(6), Mode.OPEN, None
    size = share * chosen.funnel.last
    for n in range(40):
        position = pose + n * DT * 0.02
        if rng.random() < 0.7:
            late = min(n, int(rng.integers(0, 12)))
            sample = PoseSample(
                (n - late) * DT, position[:3] + size * (0.5 + 0.5 * rng.standard_normal(3)), n
            )
        felt = rng.uniform(0.0, 20.0, 6) if rng.random() < 0.9 else None
        plan, seen = Plan(n * DT, position, ZERO, ZERO), Seen(position, ZERO, felt, sample)
        state, action = outer.step(state, plan, seen, DT)
        moved = action.shift - shift
        most = chosen.rate * DT * (1 + 1e-9) + 1e-15
        assert np.linalg.norm(moved[:3]) <= most
        assert np.linalg.norm(moved[3:]) <= most
        assert (action.shift[3:5] == action.shift[:2]).all()
        assert np.linalg.norm(action.shift[:3]) <= chosen.range
        assert abs(state.rise) <= chosen.tension_range
        assert bool(action.notice) == (action.mode is not mode)
        if mode is Mode.STOP:
            assert action.mode is Mode.STOP
            assert not moved.any()
        shift, mode = action.shift, action.mode


@settings(max_examples=60, deadline=None)
@given(machines(), outers(), seeds)
def test_the_funnel_stops_after_its_patience_and_not_before(
    machine: tuple[str, Array], chosen: OuterSettings, seed: int
) -> None:
    """Errors about the wall, which narrows: counted here as the machine must count them."""
    name, pose = machine
    outer, rng = Outer(PROFILES[name], replace(chosen, range=10.0)), np.random.default_rng(seed)
    state, outside, stopped, began = outer.start(), 0, False, None
    for n in range(60):
        t, fresh = n * DT, rng.random() < 0.8
        if fresh:
            began = t if began is None else began
            radius = chosen.funnel.radius(t - began)
            away = rng.standard_normal(3)
            away *= radius * rng.choice([0.3, 0.999, 1.001, 3.0]) / np.linalg.norm(away)
            outside = outside + 1 if np.linalg.norm(away) >= radius else 0
            sample = PoseSample(t, pose[:3] + away, n)
            stopped = stopped or outside >= chosen.patience
        if began is None:
            continue
        state, action = outer.step(state, Plan(t, pose, ZERO, ZERO), Seen(pose, ZERO, None, sample), DT)
        assert (action.mode is Mode.STOP) == stopped


@settings(max_examples=25, deadline=None)
@given(machines(), st.floats(0.5, 10.0), st.floats(0.0, 0.999), st.floats(0.0, 6.3))
def test_an_error_inside_a_funnel_slower_than_the_rate_stays_inside(
    machine: tuple[str, Array], gain: float, share: float, turn: float
) -> None:
    """The wall comes in at most at 0.7 mm/s, the correction may do 2: closed to the end, never larger."""
    name, pose = machine
    chosen = OuterSettings(gain=gain)
    outer = Outer(PROFILES[name], chosen)
    offset = (
        share * chosen.funnel.first * np.array([math.cos(turn), 0.6 * math.sin(turn), 0.8 * math.sin(turn)])
    )
    state, error = outer.start(), offset
    for n in range(250):
        t, before = n * DT, float(np.linalg.norm(error))
        assert before < chosen.funnel.radius(t)
        plan = Plan(t, pose, ZERO, ZERO)
        state, action = outer.step(
            state, plan, Seen(pose, ZERO, None, PoseSample(t, pose[:3] + error, n)), DT
        )
        error = offset + action.shift[:3]
        assert action.mode is Mode.CLOSED
        assert float(np.linalg.norm(error)) <= before + 1e-15
