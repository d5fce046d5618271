"""What holds for every machine and every pose between the pulleys."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.mechanism import (
    POLICIES,
    Cables,
    Loads,
    Pairs,
    Policy,
    PolicyName,
    accelerations,
    cable_state,
    forward,
    jacobian,
    lengths,
    shares,
    tensions,
)
from cdhr_host.mechanism.pulley import PULLEYS
from cdhr_host.profile import find, read_table, validate
from cdhr_host.values import Array

THIRD = 2 * np.pi / 3
PROFILES = {name: validate(read_table(find(name)))[0] for name in ("paper", "paper-simulation", "paper-wide")}
MACHINES = {name: (Cables.from_profile(one), Loads.from_profile(one)) for name, one in PROFILES.items()}

machines = st.sampled_from(sorted(MACHINES))
moves = st.lists(st.floats(-0.05, 0.05), min_size=3, max_size=3).map(lambda row: np.array([row]))


@st.composite
def poses(draw: st.DrawFn) -> Array:
    """(1, 3) m within 400 mm of the axis and -380 to 800 mm of the reference."""
    r, turn = draw(st.floats(0.0, 0.4)), draw(st.floats(0.0, 6.3))
    return np.array([[r * np.cos(turn), r * np.sin(turn), draw(st.floats(-0.38, 0.8))]])


@given(machines, poses(), poses())
def test_forward_inverts_lengths(name: str, lower: Array, upper: Array) -> None:
    cables, _ = MACHINES[name]
    found = forward(cables, lengths(cables, lower, upper))
    assert np.abs(found[0] - lower).max() < 1e-12
    assert np.abs(found[1] - upper).max() < 1e-12


@given(machines, poses(), moves, moves, moves)
def test_tensions_balance_loads(name: str, lower: Array, apart: Array, below: Array, above: Array) -> None:
    """Pull of the cables, spring and weight add up to mass times acceleration."""
    cables, loads = MACHINES[name]
    upper = lower + 0.5 * apart
    tension = tensions(cables, loads, lower, upper, 40 * below, 40 * above)[0]
    along = -jacobian(cables, lower, upper)[0]
    v = (upper - lower)[0] + [0.0, 0.0, loads.separation]
    spring = loads.stiffness * (1 - loads.rest_length / np.linalg.norm(v)) * v
    weight = np.array([0.0, 0.0, -9.81])
    for part, mass, pulled, a in (
        (slice(0, 3), loads.lower_mass, spring, 40 * below[0]),
        (slice(3, 6), loads.upper_mass, -spring, 40 * above[0]),
    ):
        total = tension[part] @ along[part] + pulled + mass * weight
        assert total == pytest.approx(mass * a, abs=1e-9)


@given(machines, poses(), moves)
def test_a_third_of_a_turn_renames_the_cables(name: str, q: Array, v: Array) -> None:
    cables, loads = MACHINES[name]
    c, s = np.cos(THIRD), np.sin(THIRD)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    before = cable_state(cables, loads, q, q, v, v)
    after = cable_state(cables, loads, q @ turn, q @ turn, v @ turn, v @ turn)
    for field in ("length", "rate", "acceleration", "tension"):
        renamed = getattr(before, field)[:, [2, 0, 1, 5, 3, 4]]
        assert getattr(after, field) == pytest.approx(renamed, rel=1e-9, abs=1e-9)


@given(machines, poses(), moves, moves)
def test_work_of_the_cables_is_work_on_the_platforms(name: str, q: Array, v: Array, a: Array) -> None:
    """Eq. (11) times velocity: -F·l' = (M a - G)·v, the spring taking no part when both move alike."""
    cables, loads = MACHINES[name]
    state = cable_state(cables, loads, q, q, v, a)
    mass = loads.lower_mass + loads.upper_mass
    work = mass * float((a[0] + [0.0, 0.0, 9.81]) @ v[0])
    assert -float(state.tension[0] @ state.rate[0]) == pytest.approx(work, abs=1e-9)


@given(machines, poses(), moves)
def test_no_cable_is_faster_than_the_nozzle(name: str, q: Array, v: Array) -> None:
    cables, loads = MACHINES[name]
    rate = cable_state(cables, loads, q, q, v, v).rate
    assert np.abs(rate).max() <= math.hypot(*v[0]) * (1 + 1e-12) + 1e-300


models = st.sampled_from(sorted(PULLEYS))


@given(machines, models, poses(), moves)
def test_every_pulley_model_is_undone_by_forward(name: str, model: str, lower: Array, apart: Array) -> None:
    cables = MACHINES[name][0].with_pulley(PULLEYS[model])
    found = forward(cables, lengths(cables, lower, lower + apart))
    assert np.abs(np.array(found) - [lower, lower + apart]).max() < 1e-12


@given(machines, poses(), st.lists(st.floats(0.0, 60.0), min_size=3, max_size=3), moves)
def test_shares_add_up_and_hold_the_platform_level(
    name: str, lower: Array, pair: list[float], moment: Array
) -> None:
    cables, pairs = MACHINES[name][0], Pairs.from_profile(PROFILES[name])
    found = shares(cables, pairs, lower, np.array([pair]), moment)
    pulls = -jacobian(cables, lower, lower)[0, :3]
    turning = np.cross(pairs.left, found.left.T * pulls) + np.cross(pairs.right, found.right.T * pulls)
    assert np.abs(found.left + found.right - pair).max() < 1e-10
    assert np.abs(turning.sum(axis=0) + moment).max() < 1e-10


@given(machines, poses(), moves, moves, moves)
def test_accelerations_undo_tensions(
    name: str, lower: Array, apart: Array, below: Array, above: Array
) -> None:
    cables, loads = MACHINES[name]
    force = tensions(cables, loads, lower, lower + apart / 2, below, above)
    found = accelerations(cables, loads, lower, lower + apart / 2, force)
    assert np.abs(np.array(found) - [below, above]).max() < 1e-9


@settings(deadline=None)
@given(machines, st.sampled_from(POLICIES), poses())
def test_policies_turn_with_the_machine(name: str, policy: PolicyName, lower: Array) -> None:
    rule = Policy.from_profile(PROFILES[name], policy)
    turn = np.array([[np.cos(THIRD), -np.sin(THIRD), 0], [np.sin(THIRD), np.cos(THIRD), 0], [0, 0, 1]])
    assert np.abs(rule.upper(lower @ turn.T) - rule.upper(lower) @ turn.T).max() < 1e-12
