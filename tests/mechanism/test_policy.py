"""Where the upper platform stands: smooth, symmetric, and as good as a linear program says is possible."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from mechanism_oracle import Machine, machine, workspace
from numpy.testing import assert_allclose
from scipy.optimize import linprog

from cdhr_host.errors import MotionError
from cdhr_host.mechanism import (
    POLICIES,
    Pairs,
    Policy,
    PolicyName,
    Windows,
    cable_state,
    jacobian,
    nine_tensions,
    spring_fit,
    tensions,
    trajectories,
)
from cdhr_host.mechanism.policy import _fitted
from cdhr_host.mechanism.spring_field import ROWS
from cdhr_host.profile import Profile
from cdhr_host.units import DEG, MM

GRAVITY = 9.81
EVERY = pytest.mark.parametrize("name", POLICIES)


@cache
def single_minimum(name: str, newton: float) -> Profile:
    profile = machine(name).profile
    return profile.model_copy(update={"forces": profile.forces.model_copy(update={"single_min": newton})})


def rings(radii: np.ndarray, azimuths: int, heights: np.ndarray, base: float) -> np.ndarray:
    """(R, A, H, 3) m: displacements over the 60° sector that symmetry repeats."""
    r, turn, z = np.meshgrid(radii, np.linspace(0, 60, azimuths) * DEG, heights - base, indexing="ij")
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=-1)


def reach_by_height(
    profile: Profile, name: PolicyName, radii: np.ndarray, heights: np.ndarray, azimuths: int
):
    """(H,) largest radius up to which the plain force function stays in every window; poses inside."""
    made = machine("paper")
    loads = replace(made.loads, rest_length=profile.spring.rest_length)
    grid = rings(radii, azimuths, heights, profile.geometry.reference_height)
    q = grid.reshape(-1, 3)
    upper = Policy.from_profile(profile, name).upper(q)
    nine = nine_tensions(made.cables, loads, Pairs.from_profile(profile), q, upper)
    good = np.all(
        [
            *inside(nine[:, :3] + nine[:, 3:6], profile.forces.lower_min, profile.forces.lower_max),
            *inside(nine[:, :6], profile.forces.single_min, profile.forces.single_max),
            *inside(nine[:, 6:], profile.forces.upper_min, profile.forces.upper_max),
        ],
        axis=0,
    ).reshape(grid.shape[:3])
    far = np.cumprod(good.all(axis=1), axis=0).sum(axis=0)
    kept = np.arange(len(radii))[:, None, None] < far[None, None]
    poses = q.reshape(grid.shape)[np.broadcast_to(kept, grid.shape[:3])]
    return np.where(far > 0, radii[np.maximum(far - 1, 0)], 0.0), poses


def inside(force: np.ndarray, low: float, high: float) -> Iterator[np.ndarray]:
    yield (force >= low).all(axis=1)
    yield (force <= high).all(axis=1)


def litres(radius: np.ndarray, step: float) -> float:
    return float(np.pi * (radius**2).sum() * step * 1e3)


def oracle_margin(profile: Profile, q: np.ndarray, upper: np.ndarray) -> float:
    """Linear program: spring vector and nine forces in balance, the smallest margin as large as can be.

    Unknowns: six single cables, three upper ones, the spring, the margin. Equations: three forces
    and three moments of the lower platform, three forces of the upper one, cable by cable.
    """
    made, pairs, forces = machine("paper"), Pairs.from_profile(profile), profile.forces
    pulls = -jacobian(made.cables, q[None], upper[None])[0]
    balance, wanted = np.zeros((9, 13)), np.zeros(9)
    for i in range(3):
        for k, arm in ((i, pairs.left[i]), (i + 3, pairs.right[i])):
            balance[:3, k], balance[3:6, k] = pulls[i], np.cross(arm, pulls[i])
        balance[6:, 6 + i] = pulls[3 + i]
    balance[:3, 9:12], balance[6:, 9:12] = np.eye(3), -np.eye(3)
    wanted[2], wanted[8] = made.loads.lower_mass * GRAVITY, made.loads.upper_mass * GRAVITY
    rows, ends = [], []
    for picked, low, high in (
        *(([i, i + 3], forces.lower_min, forces.lower_max) for i in range(3)),
        *(([i], forces.single_min, forces.single_max) for i in range(6)),
        *(([i], forces.upper_min, forces.upper_max) for i in range(6, 9)),
    ):
        row = np.zeros(13)
        row[picked] = 1.0
        row[12] = half = 0.5 * (high - low)
        rows += [row, np.append(-row[:12], half)]
        ends += [high, -low]
    cost = np.append(np.zeros(12), -1.0)
    found = linprog(cost, A_ub=rows, b_ub=ends, A_eq=balance, b_eq=wanted, bounds=(None, None))
    assert found.status == 0
    return float(found.x[12])


def test_free_reaches_390_mm_and_590_litres() -> None:
    """3-60 N, single cables at least 1.5 N: the grid of physics.md section 6, then a finer one."""
    profile = machine("paper-wide").profile
    assert profile.forces.single_min == 1.5
    heights = np.arange(0.2, 1.4501, 0.05)
    radius, poses = reach_by_height(profile, "free", np.arange(0, 0.4151, 0.03), heights, 5)
    assert radius.max() == pytest.approx(0.39)
    assert litres(radius, 0.05) >= 590.0
    fine, _ = reach_by_height(profile, "free", np.arange(0, 0.4151, 0.01), heights, 13)
    assert litres(fine, 0.05) >= 610.0
    upright, _ = reach_by_height(profile, "vertical", np.arange(0, 0.4151, 0.03), heights, 5)
    assert upright.max() == pytest.approx(0.24)
    assert litres(upright, 0.05) == pytest.approx(227, abs=2)
    prove(profile, poses)


def edges(
    profile: Profile, name: PolicyName, heights: np.ndarray, azimuths: int, most: float
) -> tuple[np.ndarray, np.ndarray]:
    """(A, H) m: where each ray from the axis first leaves a window, by bisection; (A, H, 3) these places."""
    made, policy = machine("paper"), Policy.from_profile(profile, name)
    loads = replace(made.loads, rest_length=profile.spring.rest_length)
    pairs, windows = Pairs.from_profile(profile), Windows.from_profile(profile)
    base, turn = profile.geometry.reference_height, np.linspace(0, 60, azimuths) * DEG

    def places(radius: np.ndarray) -> np.ndarray:
        x, y = radius * np.cos(turn)[:, None], radius * np.sin(turn)[:, None]
        return np.stack([x, y, np.broadcast_to(heights - base, radius.shape)], axis=-1)

    def good(radius: np.ndarray) -> np.ndarray:
        q = places(radius).reshape(-1, 3)
        nine = nine_tensions(made.cables, loads, pairs, q, policy.upper(q))
        return (windows.least_margin(nine) >= 0.0).reshape(radius.shape)

    steps = np.arange(0.0, most, 0.004)
    kept = np.array([good(np.full((azimuths, len(heights)), r)) for r in steps])
    far = np.cumprod(kept, axis=0).sum(axis=0)
    low, high = 0.004 * np.maximum(far - 1, 0), 0.004 * far
    for _ in range(14):
        middle = 0.5 * (low + high)
        inside_there = good(middle) & (far > 0)
        low, high = np.where(inside_there, middle, low), np.where(inside_there, high, middle)
    return low, places(low)


@pytest.mark.parametrize(
    ("name", "low", "high", "most", "expected"),
    [("paper", 0.2, 1.05, 0.26, 52.0), ("paper-wide", 0.2, 1.45, 0.45, 625.9)],
)
def test_converged_volume_of_free(name: str, low: float, high: float, most: float, expected: float) -> None:
    """No grid in the radius; heights halved twice and azimuths halved change 0.05 %: litres, worst azimuth.

    Table A1's windows, 3-10 / 5-12 N, single cables at least 1.5 N: well over 49 l. The edge itself
    is proven by linear programs.
    """
    profile, found = single_minimum(name, 1.5), []
    for count, azimuths in ((17, 25), (34, 25), (68, 25), (34, 13)):
        step = (high - low) / count
        radius, places = edges(profile, "free", low + step * (np.arange(count) + 0.5), azimuths, most)
        found.append(litres(radius.min(axis=0), step))
    assert found[:3] == pytest.approx([expected] * 3, rel=5e-4)
    assert found[3] == pytest.approx(expected, rel=1e-3)
    if name == "paper":
        assert min(found) >= 49.0
        prove(profile, places.reshape(-1, 3)[::3] * [1.0 - 1e-5, 1.0 - 1e-5, 1.0])


def prove(profile: Profile, poses: np.ndarray) -> None:
    """Every pose kept has a solution by the program, and no margin beats the program's."""
    policy, windows = Policy.from_profile(profile, "free"), Windows.from_profile(profile)
    upper = policy.upper(poses)
    loads = replace(machine("paper").loads, rest_length=profile.spring.rest_length)
    nine = nine_tensions(machine("paper").cables, loads, Pairs.from_profile(profile), poses, upper)
    found = windows.least_margin(nine)
    best = np.array([oracle_margin(profile, q, above) for q, above in zip(poses, upper, strict=True)])
    assert (best >= 0.0).all()
    assert (found <= best + 1e-7).all()
    assert np.mean(best - found) < 0.1


def test_preload_of_60_newton() -> None:
    profile = machine("paper-wide").profile
    assert profile.spring.preload == 60.0
    radius, _ = reach_by_height(
        profile, "preload", np.arange(0, 0.4151, 0.03), np.arange(0.2, 1.4501, 0.05), 5
    )
    assert radius.max() == pytest.approx(0.24)
    assert litres(radius, 0.05) == pytest.approx(183.0, abs=3)


@EVERY
def test_derivatives_are_differences(any_machine: Machine, name: PolicyName) -> None:
    policy, h = Policy.from_profile(any_machine.profile, name), 1e-4
    rng = np.random.default_rng(71)
    q = workspace(rng, 300, 0.35, -0.15, 0.6)
    v, a = rng.uniform(-0.1, 0.1, q.shape), rng.uniform(-0.5, 0.5, q.shape)

    def at(t: float) -> np.ndarray:
        return policy.upper(q + v * t + 0.5 * a * t * t)

    moved = policy.follow(q, v, a)
    assert_allclose(moved.place, at(0.0), rtol=0, atol=1e-15)
    assert_allclose(moved.velocity, (at(h) - at(-h)) / (2 * h), rtol=1e-6, atol=1e-8)
    second = (at(h * 10) + at(-h * 10) - 2 * at(0.0)) / (h * 10) ** 2
    assert_allclose(moved.acceleration, second, rtol=1e-4, atol=1e-4)
    slope, bend = policy.slope(q), policy.curvature(q)
    assert_allclose(np.einsum("nij,nj->ni", slope, v), moved.velocity, rtol=0, atol=1e-12)
    turned = np.einsum("nijk,nj,nk->ni", bend, v, v) + np.einsum("nij,nj->ni", slope, a)
    assert_allclose(turned, moved.acceleration, rtol=0, atol=1e-10)


@EVERY
def test_policies_have_the_symmetry_of_the_machine(experiment: Machine, name: PolicyName) -> None:
    policy = Policy.from_profile(experiment.profile, name)
    q = workspace(np.random.default_rng(72), 300, 0.35, -0.15, 0.6)
    cos, sin = np.cos(2 * np.pi / 3), np.sin(2 * np.pi / 3)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    mirror = np.diag([1.0, -1.0, 1.0])
    for way in (turn, mirror):
        assert_allclose(policy.upper(q @ way.T), policy.upper(q) @ way.T, rtol=0, atol=1e-13)


def test_fixed_is_the_papers_constant_offset(any_machine: Machine) -> None:
    policy = Policy.from_profile(any_machine.profile, "fixed")
    q = workspace(np.random.default_rng(73), 100, 0.3, -0.1, 0.5)
    for moved, given in zip(policy.follow(q, 2 * q, 3 * q), (q, 2 * q, 3 * q), strict=True):
        assert_allclose(moved, given, rtol=0, atol=0)


def test_preload_keeps_the_spring_force(any_machine: Machine) -> None:
    profile, loads = any_machine.profile, any_machine.loads
    q = workspace(np.random.default_rng(74), 100, 0.3, -0.1, 0.5)
    offset = Policy.from_profile(profile, "preload").upper(q) - q
    assert not offset[:, :2].any()
    force = loads.stiffness * (loads.separation + offset[:, 2] - loads.rest_length)
    assert_allclose(force, profile.spring.preload, rtol=1e-12)


def test_vertical_is_vertical_and_free_leans_outward() -> None:
    profile = machine("paper-wide").profile
    q = workspace(np.random.default_rng(75), 2000, 0.35, 0.0, 0.6)
    assert not (Policy.from_profile(profile, "vertical").upper(q) - q)[:, :2].any()
    offset = Policy.from_profile(profile, "free").upper(q) - q
    far = np.hypot(q[:, 0], q[:, 1]) > 0.25
    aside = np.hypot(offset[far, 0], offset[far, 1])
    assert np.mean(np.einsum("nk,nk->n", offset[far, :2], q[far, :2]) > 0.0) > 0.9
    assert 5 * MM < aside.mean() < aside.max() < 35 * MM


@pytest.mark.parametrize("name", ["vertical", "free"])
def test_sliders_follow_within_their_limits(name: PolicyName) -> None:
    """50 mm/s and 0.5 m/s² in random directions over the bed of paper-wide."""
    made = machine("paper-wide")
    limits, rng = made.profile.sliders, np.random.default_rng(76)
    q = workspace(rng, 20_000, 0.32, 0.0, 0.8)
    v, a = (rng.normal(size=q.shape) for _ in range(2))
    v *= 0.05 / np.linalg.norm(v, axis=1)[:, None]
    a *= 0.5 / np.linalg.norm(a, axis=1)[:, None]
    moved = Policy.from_profile(made.profile, name).follow(q, v, a)
    state = cable_state(
        made.cables,
        made.loads,
        q,
        moved.place,
        v,
        a,
        upper_velocity=moved.velocity,
        upper_acceleration=moved.acceleration,
    )
    assert np.abs(state.rate).max() < 0.5 * limits.speed_max
    assert np.abs(state.acceleration).max() < limits.acceleration_max


@pytest.mark.parametrize(("path", "preloads"), [("eq15", (13.75, 16.9)), ("eq36", (13.65, 14.9))])
def test_feasible_preloads_of_the_papers_paths(path: str, preloads: tuple[float, float]) -> None:
    """Row 11: vertical springs that keep the six equivalent cables in Table A1's windows."""
    made = machine("paper")
    law, end = {"eq15": (trajectories.eq15, 200.0), "eq36": (trajectories.eq36, 150.0)}[path]
    q, forces = law(np.arange(0.0, end, 0.25)), made.profile.forces

    def fits(newton: float) -> bool:
        upper = q + np.array([0.0, 0.0, newton / made.loads.stiffness + 0.0407 - 0.055])
        force = tensions(made.cables, made.loads, q, upper)
        below = force[:, :3].min() >= forces.lower_min and force[:, :3].max() <= forces.lower_max
        return bool(
            below and force[:, 3:].min() >= forces.upper_min and force[:, 3:].max() <= forces.upper_max
        )

    good = [newton for newton in np.arange(11.0, 20.0, 0.05) if fits(newton)]
    assert (good[0], good[-1]) == (pytest.approx(preloads[0], abs=0.1), pytest.approx(preloads[1], abs=0.1))


def test_fits_are_kept_while_nothing_they_need_changes() -> None:
    profile = machine("paper-wide").profile
    before = _fitted.cache_info().misses
    first = Policy.from_profile(profile, "free")
    moved = profile.model_copy(update={"bed": profile.bed.model_copy(update={"origin_x": 0.01})})
    assert Policy.from_profile(moved, "free").field is first.field
    assert _fitted.cache_info().misses <= before + 1
    other = Policy.from_profile(single_minimum("paper-wide", 2.0), "free")
    assert other.field is not first.field


def test_a_fit_without_a_better_step_stays_where_it_began(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spring_fit, "DAMPINGS", 0)
    made = machine("paper-wide")
    windows, rows = Windows.from_profile(made.profile), np.ones(ROWS, dtype=np.bool_)
    pairs = Pairs.from_profile(made.profile)
    field = spring_fit.best_field(made.cables, made.loads, pairs, windows, rows)
    still = (np.zeros(3),) * 3
    x, y, z = field.along((np.array([0.0, 0.1, -0.2]), np.zeros(3), np.zeros(3)), still, still)
    assert not x.value.any()
    assert not y.value.any()
    assert_allclose(z.value, 40.0, rtol=1e-12)


def test_windows_wider_than_the_machine_are_refused() -> None:
    profile = machine("paper-wide").profile
    wide = {"lower_max": 1e5, "upper_max": 1e5, "single_max": 1e5}
    profile = profile.model_copy(update={"forces": profile.forces.model_copy(update=wide)})
    with pytest.raises(MotionError, match="take the upper platform out of reach") as refusal:
        Policy.from_profile(profile, "free")
    assert refusal.value.problems[0].key == "spring.policy"
