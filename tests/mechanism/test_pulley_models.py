"""The four pulley models: stored lengths, slopes, rates, round trips, and how far they are apart."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mechanism_oracle import COLUMNS, Machine, machine, workspace
from numpy.testing import assert_allclose

from cdhr_host.mechanism import (
    Cables,
    cable_state,
    forward,
    jacobian,
    lengths,
    mistaken_error,
    model_errors,
    tensions,
    trajectories,
    uncompensated_error,
)
from cdhr_host.mechanism.kinematics import components, six_wraps
from cdhr_host.mechanism.pulley import PULLEYS
from cdhr_host.profile import find, read_table, validate
from cdhr_host.units import MM

VECTORS = json.loads((Path(__file__).parent / "vectors.json").read_text(encoding="utf-8"))
COUNT = 200
MODELS = pytest.mark.parametrize("model", PULLEYS)


def poses(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    lower = workspace(rng, COUNT, 0.4, -0.3, 0.7)
    return lower, lower + rng.uniform(-0.02, 0.02, (COUNT, 3))


def ring(step: float = 0.01) -> np.ndarray:
    return trajectories.eq15(np.arange(0.0, 200.0, step))


@pytest.mark.parametrize(("model", "key"), [("fixed-plane", "l_fixed_plane"), ("caster", "l_caster")])
def test_stored_lengths(model: str, key: str) -> None:
    for row in VECTORS["static"]:
        cables = machine(COLUMNS[row["column"]]).cables.with_pulley(PULLEYS[model])
        q = np.array(row["q"], dtype=float) * MM
        found = lengths(cables, q[None, :3], q[None, 3:])[0]
        assert_allclose(found / MM, np.array(row[key], dtype=float), rtol=0, atol=1e-9)


@MODELS
def test_direction_is_the_gradient(any_machine: Machine, model: str) -> None:
    cables, step = any_machine.cables.with_pulley(PULLEYS[model]), 1e-5
    lower, upper = poses(41)
    slope = jacobian(cables, lower, upper)
    for axis in range(3):
        move = step * np.eye(3)[axis]
        rise = lengths(cables, lower + move, upper + move) - lengths(cables, lower - move, upper - move)
        assert_allclose(slope[:, :, axis], rise / (2 * step), rtol=0, atol=1e-9)


@MODELS
def test_a_wider_groove_makes_the_cable_longer(any_machine: Machine, model: str) -> None:
    cables, step = any_machine.cables.with_pulley(PULLEYS[model]), 1e-6
    lower, upper = poses(47)
    places = [components(part, slice(0, COUNT)) for part in (lower, upper)]
    slopes = np.array([wrap.per_radius() for wrap in six_wraps(cables, *places)]).T
    wide, narrow = (
        lengths(replace(cables, pulley_radius=cables.pulley_radius + way), lower, upper)
        for way in (step, -step)
    )
    assert_allclose(slopes, (wide - narrow) / (2 * step), rtol=0, atol=1e-8)


@MODELS
def test_only_the_fixed_plane_pulls_off_its_line(any_machine: Machine, model: str) -> None:
    """Gradient against the unit vector along BC: equal, or up to 2e-4 apart where the edge reacts."""
    cables = any_machine.cables.with_pulley(PULLEYS[model])
    q = workspace(np.random.default_rng(42), COUNT, 0.186, 0.0, 0.15)
    off = []
    for wrap in six_wraps(cables, *(components(q, slice(0, COUNT)),) * 2):
        line = np.array(wrap.straight())
        off.append(np.abs(wrap.direction() - line / np.linalg.norm(line, axis=0)).max())
    if model == "fixed-plane":
        assert 2e-5 < max(off) < 3e-4
    else:
        assert max(off) < 1e-14


@MODELS
def test_length_is_arc_and_straight_part(any_machine: Machine, model: str) -> None:
    cables = any_machine.cables.with_pulley(PULLEYS[model])
    lower, upper = poses(43)
    rows = slice(0, COUNT)
    for wrap in six_wraps(cables, components(lower, rows), components(upper, rows)):
        straight = np.linalg.norm(wrap.straight(), axis=0)
        assert_allclose(cables.pulley_radius * wrap.angle() + straight, wrap.length(), rtol=1e-14)
        assert (wrap.angle() >= 0.0).all()


@MODELS
def test_rates_are_derivatives_along_a_curve(any_machine: Machine, model: str) -> None:
    cables, loads = any_machine.cables.with_pulley(PULLEYS[model]), any_machine.loads
    rng, h = np.random.default_rng(44), 2e-3
    starts = poses(44)
    v, a = rng.uniform(-0.1, 0.1, (2, COUNT, 3)), rng.uniform(-0.5, 0.5, (2, COUNT, 3))

    def at(t: float) -> np.ndarray:
        return lengths(cables, *(starts[k] + v[k] * t + 0.5 * a[k] * t * t for k in range(2)))

    state = cable_state(cables, loads, *starts, v[0], a[0], upper_velocity=v[1], upper_acceleration=a[1])
    rate = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)
    second = (16 * (at(h) + at(-h)) - (at(2 * h) + at(-2 * h)) - 30 * at(0.0)) / (12 * h * h)
    assert_allclose(state.rate, rate, rtol=0, atol=1e-11)
    assert_allclose(state.acceleration, second, rtol=0, atol=2e-8)


@MODELS
def test_round_trip(any_machine: Machine, model: str) -> None:
    """Row 4: a machine commanded by its own model goes where it was meant to go."""
    cables = any_machine.cables.with_pulley(PULLEYS[model])
    lower, upper = poses(45)
    found = forward(cables, lengths(cables, lower, upper))
    assert_allclose(found, [lower, upper], rtol=0, atol=1e-9 * MM)
    path = ring(0.5)
    error = mistaken_error(cables, PULLEYS[model], path, path)
    assert np.abs(error).max() < 1e-9 * MM
    moved = any_machine.loads
    assert_allclose(
        tensions(cables, moved, path + error[0], path + error[1]),
        tensions(cables, moved, path, path),
        atol=1e-9,
    )


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        ("swivel", [0.97296, 0.89166, 1.18217]),
        ("fixed-plane", [0.94512, 0.89429, 1.20205]),
        ("caster", [0.95617, 0.89309, 1.19416]),
    ],
)
def test_uncompensated_ring(simulation: Machine, model: str, expected: list[float]) -> None:
    """Rows 5 and 6."""
    path = ring()
    error, _ = uncompensated_error(simulation.cables.with_pulley(PULLEYS[model]), path, path)
    assert_allclose(np.abs(error).max(axis=0) / MM, expected, rtol=0, atol=5e-4)


def test_uncompensated_upper_platform_and_spring(simulation: Machine) -> None:
    """Row 7: the 3T platform, and the least vertical spring force, 1 N/mm."""
    path = ring()
    lower, upper = uncompensated_error(simulation.cables, path, path)
    assert_allclose(np.abs(upper).max(axis=0) / MM, [0.87432, 0.80459, 1.51215], rtol=0, atol=5e-4)
    span = np.array([0.0, 0.0, simulation.loads.separation]) + upper - lower
    size = np.linalg.norm(span, axis=1)
    force = simulation.loads.stiffness * (size - simulation.loads.rest_length) * span[:, 2] / size
    assert force.min() == pytest.approx(29.6696, abs=5e-4)


@pytest.mark.parametrize(
    ("believed", "actual", "radius", "expected"),
    [
        ("swivel", "fixed-plane", 98.3, (0.044, 0.046)),
        ("swivel", "fixed-plane", 186.0, (0.177, 0.193)),
        ("swivel", "fixed-plane", 250.0, (0.349, 0.390)),
        ("swivel", "caster", 98.3, (0.027, 0.025)),
        ("swivel", "caster", 250.0, (0.214, 0.217)),
        ("point", "swivel", 98.3, (1.52, 2.60)),
        ("point", "swivel", 250.0, (3.00, 3.43)),
    ],
)
def test_models_apart(believed: str, actual: str, radius: float, expected: tuple[float, float]) -> None:
    turn, z = np.meshgrid(np.linspace(0, 2 * np.pi, 181), np.linspace(0, 0.15, 16))
    for column, value in zip(COLUMNS, expected, strict=True):
        r = radius * MM
        q = np.column_stack([(r * np.cos(turn)).ravel(), (r * np.sin(turn)).ravel(), z.ravel()])
        cables = machine(COLUMNS[column]).cables.with_pulley(PULLEYS[actual])
        error, _ = mistaken_error(cables, PULLEYS[believed], q, q)
        assert np.linalg.norm(error, axis=1).max() / MM == pytest.approx(value, rel=0.04)


def test_errors_of_every_pair_of_models(simulation: Machine) -> None:
    path = ring(1.0)
    found = model_errors(simulation.cables, path, path)
    assert set(found) == {(a, b) for a in PULLEYS for b in PULLEYS}
    for (believed, actual), error in found.items():
        assert error.shape == (3,)
        assert bool(error.max() < 1e-9 * MM) is (believed == actual)


@MODELS
def test_the_profile_chooses(model: str) -> None:
    table: dict[str, Any] = read_table(find("paper"))
    table["geometry"]["pulley_model"] = model
    profile, problems = validate(table)
    assert problems == []
    assert Cables.from_profile(profile).pulley is PULLEYS[model]
