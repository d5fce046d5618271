"""All limits at a pose: margins, acceleration reserve, travel and angles, printable radii."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mechanism_oracle import Machine, machine, workspace
from numpy.testing import assert_allclose

from cdhr_host.mechanism import POLICIES, Windows, Workspace, angles, cable_state, nine_tensions, printable
from cdhr_host.profile import Profile
from cdhr_host.units import DEG

HOME = np.zeros((1, 3))


def changed(profile: Profile, section: str, **values: Any) -> Profile:
    part = getattr(profile, section).model_copy(update=values)
    return profile.model_copy(update={section: part})


def pairs_only(space: Workspace) -> Workspace:
    """Windows of the six equivalent cables, as in Table A1."""
    low, high = space.windows.low.copy(), space.windows.high.copy()
    low[3:9], high[3:9] = -1e9, 1e9
    return replace(space, windows=Windows(low, high))


@pytest.mark.parametrize(
    ("name", "place", "expected"),
    [
        ("paper", [0.0, 0.0, 0.0], 2.310),
        ("paper", [0.098299, 0.0, 0.149156], 0.786),
        ("paper", [0.150, 0.0, 0.0], 0.926),
        ("paper-simulation", [0.0, 0.0, 0.0], 0.678),
    ],
)
def test_acceleration_reserve(name: str, place: list[float], expected: float) -> None:
    """physics.md section 4."""
    space = pairs_only(Workspace.from_profile(machine(name).profile))
    assert space.acceleration_reserve(np.array([place]))[0] == pytest.approx(expected, abs=2e-3)


def test_the_simulation_column_has_no_reserve_off_its_circle() -> None:
    space = pairs_only(Workspace.from_profile(machine("paper-simulation").profile))
    assert space.acceleration_reserve(np.array([[0.05, 0.0, 0.075]]))[0] < 0.0


@pytest.mark.parametrize("policy", POLICIES)
def test_reserve_is_where_the_margin_ends(any_machine: Machine, policy: Any) -> None:
    space = Workspace.from_profile(any_machine.profile, policy)
    q = workspace(np.random.default_rng(81), 400, 0.2, 0.0, 0.2)
    reserve = space.acceleration_reserve(q)
    for pose, a in zip(q[::20], reserve[::20], strict=True):
        if a > 0.0:
            assert space.margin(pose[None], float(a) * 0.999)[0] > 0.0
            assert space.margin(pose[None], float(a) * 1.001)[0] < 0.0
    assert_allclose(np.sign(space.margin(q)), np.sign(reserve))


def test_margin_is_of_the_plain_forces(experiment: Machine) -> None:
    """At rest, and for random accelerations never below what the reserve promises."""
    space = Workspace.from_profile(experiment.profile)
    rng = np.random.default_rng(82)
    q, way = workspace(rng, 500, 0.18, 0.0, 0.15), rng.normal(size=(500, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    forces = nine_tensions(space.cables, space.loads, space.pairs, q, q)
    assert_allclose(space.margin(q), space.windows.least_margin(forces), rtol=0, atol=1e-12)
    a = 0.2 * way
    forces = nine_tensions(space.cables, space.loads, space.pairs, q, q, a, a)
    assert (space.windows.least_margin(forces) >= space.margin(q, 0.2) - 1e-12).all()
    state = cable_state(space.cables, space.loads, q, q, 0 * q, a)
    assert_allclose(forces[:, :3] + forces[:, 3:6], state.tension[:, :3], rtol=1e-12)


def test_out_of_reach_is_infeasible_and_not_an_error(experiment: Machine) -> None:
    space = Workspace.from_profile(experiment.profile)
    q = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.6], [0.0, 0.0, 1.6], [np.nan, 0.0, 0.0]])
    assert space.margin(q)[0] > 0.0
    assert (space.margin(q)[1:] == -np.inf).all()
    assert space.within_limits(q).tolist() == [True, False, False, False]
    assert space.feasible(q).tolist() == [True, False, False, False]


@pytest.mark.parametrize(
    ("radius", "lower", "upper"), [(0.0983, 6.7, 6.3), (0.186, 12.8, 11.9), (0.25, 17.3, 16.1)]
)
def test_fleet_angles(experiment: Machine, radius: float, lower: float, upper: float) -> None:
    """physics.md section 1.3."""
    turn = np.linspace(0, 2 * np.pi, 721)
    q = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn])
    found = angles(experiment.cables, q, q).fleet.max(axis=0) / DEG
    assert_allclose(found, [lower] * 3 + [upper] * 3, rtol=0, atol=0.1)


def test_wrap_is_the_elevation(simulation: Machine) -> None:
    found = angles(simulation.cables, HOME, HOME)
    assert_allclose(found.wrap[0], [0.81209867] * 3 + [0.77971789] * 3, rtol=0, atol=1e-8)
    assert found.fleet.max() < 1e-15


@pytest.mark.parametrize(
    ("section", "limit"),
    [
        ("geometry", {"wrap_max": 0.95}),
        ("geometry", {"fleet_max": 0.1}),
        ("sliders", {"travel_max": 0.05}),
        ("sliders", {"travel_min": -0.05}),
    ],
)
def test_each_limit_is_looked_at(experiment: Machine, section: str, limit: dict[str, float]) -> None:
    q = workspace(np.random.default_rng(83), 500, 0.18, 0.0, 0.15)
    assert Workspace.from_profile(experiment.profile).within_limits(q).all()
    kept = Workspace.from_profile(changed(experiment.profile, section, **limit)).within_limits(q)
    assert 0.02 < kept.mean() < 0.98


def test_printable_radii_by_height() -> None:
    """The figure: every policy at least as good as the one before, but for preload against fixed."""
    found = printable(machine("paper-wide").profile, np.arange(0.25, 1.3, 0.15))
    radius = found.radius
    assert list(radius) == list(POLICIES)
    assert (radius["vertical"] >= np.maximum(radius["fixed"], radius["preload"]) - 0.0101).all()
    assert (radius["free"] >= radius["vertical"] - 0.0101).all()
    assert radius["free"].max() >= 0.39
    assert 2.0 < found.volume("free") / found.volume("vertical") < 3.5
    assert found.clear[0] == np.inf
    assert (np.diff(found.clear[1:]) < 0.0).all()


def test_an_acceleration_costs_radius() -> None:
    profile, height = machine("paper-wide").profile, np.array([0.6, 0.7])
    still, moving = printable(profile, height), printable(profile, height, acceleration=5.0)
    assert (moving.radius["free"] <= still.radius["free"]).all()
    assert moving.volume("free") < still.volume("free")


def test_no_height_is_printable_where_the_windows_are_empty(experiment: Machine) -> None:
    profile = changed(experiment.profile, "forces", lower_min=9.9, upper_max=5.1)
    found = printable(profile, np.array([0.4, 0.5]))
    assert not any(radius.any() for radius in found.radius.values())
