"""Eq. (13), (14) corrected: shares of the pairs against the stored ones, bounds, singular attachments."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mechanism_oracle import COLUMNS, Machine, machine, workspace
from numpy.testing import assert_allclose

from cdhr_host.errors import MotionError
from cdhr_host.mechanism import (
    Pairs,
    bounded_shares,
    condition,
    forward,
    jacobian,
    moment_matrix,
    nine_tensions,
    shares,
    tensions,
)
from cdhr_host.units import MM, MM3

VECTORS = json.loads((Path(__file__).parent / "vectors.json").read_text(encoding="utf-8"))
HOME = np.zeros((1, 3))


def stored(values: Any) -> np.ndarray:
    return np.array(values, dtype=np.float64)


def pairs_of(made: Machine) -> Pairs:
    return Pairs.from_profile(made.profile)


@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_stored_shares(kind: str) -> None:
    for row in VECTORS[kind]:
        made = machine(COLUMNS[row["column"]])
        q = stored(row["q"]) * MM
        a = stored(row.get("qdd", [0.0] * 6)) * MM
        nine = nine_tensions(
            made.cables, made.loads, pairs_of(made), q[None, :3], q[None, 3:], a[None, :3], a[None, 3:]
        )
        six = row["F" if kind == "dynamic" else "F_static"]
        # the vectors' mid-points are at 35√3 mm, Table A1 has 60.62: 30 ppm of the moments
        assert_allclose(nine[0], stored(row["f_l"] + row["f_r"] + six[3:]), rtol=0, atol=3e-4)
        exact = replace(pairs_of(made), **corrected_arms())
        found = shares(made.cables, exact, q[None, :3], stored(six[:3])[None])
        assert_allclose(found.left[0], stored(row["f_l"]), rtol=0, atol=1e-9)
        assert_allclose(found.right[0], stored(row["f_r"]), rtol=0, atol=1e-9)
        assert not found.moment.any()


def corrected_arms() -> dict[str, np.ndarray]:
    arms = VECTORS["meta"]["attach_corrected"]
    return {"left": stored(arms["r_il"]) * MM, "right": stored(arms["r_ir"]) * MM}


def test_attachments_of_the_profile(any_machine: Machine) -> None:
    made = pairs_of(any_machine)
    expected = corrected_arms()
    assert_allclose(made.left, expected["left"], rtol=0, atol=2e-6)
    assert_allclose(made.right, expected["right"], rtol=0, atol=2e-6)


@pytest.mark.parametrize(("column", "det", "cond"), [("sim", 1.25302e6, 1.34), ("exp", 6.83880e5, 2.63)])
def test_determinant_at_the_start(column: str, det: float, cond: float) -> None:
    """Row 12."""
    made = machine(COLUMNS[column])
    matrix = moment_matrix(made.cables, pairs_of(made), HOME)
    assert np.linalg.det(matrix)[0] / MM3 == pytest.approx(det, rel=1e-5)
    assert condition(made.cables, pairs_of(made), HOME)[0] == pytest.approx(cond, abs=5e-3)


@pytest.mark.parametrize(
    ("column", "expected"), [("sim", (9.273388, 18.874128)), ("exp", (4.814184, 8.768472))]
)
def test_start_forces(column: str, expected: tuple[float, float]) -> None:
    """Row 10."""
    made = machine(COLUMNS[column])
    nine = nine_tensions(made.cables, made.loads, pairs_of(made), HOME, HOME)[0]
    assert_allclose(nine[:6], expected[0] / 2, rtol=0, atol=1e-6)
    assert_allclose(nine[6:], expected[1], rtol=0, atol=1e-6)


def test_attachments_as_printed_are_singular(any_machine: Machine) -> None:
    """Table A1: y = 35√3 sin β ∓ 55 cos β, x = 35√3 cos β ∓ 55 sin β."""
    beta = 2 * np.pi * np.arange(3) / 3
    out = 35 * np.sqrt(3) * MM
    left = np.column_stack(
        [out * np.cos(beta) - 0.055 * np.sin(beta), out * np.sin(beta) - 0.055 * np.cos(beta), 0 * beta]
    )
    right = np.column_stack(
        [out * np.cos(beta) + 0.055 * np.sin(beta), out * np.sin(beta) + 0.055 * np.cos(beta), 0 * beta]
    )
    printed = replace(pairs_of(any_machine), left=left, right=right)
    assert condition(any_machine.cables, printed, HOME)[0] > 1e9
    q = np.array([[0.05, 0.02, 0.1], [0.05, -0.02, 0.1], [0.0, 0.0, 0.0]])
    with pytest.raises(MotionError, match=r"at sample 2: condition number \S+e\+1") as refusal:
        shares(any_machine.cables, printed, q, np.full((3, 3), 5.0))
    assert refusal.value.problems[0].kind == "singular"


def test_a_poorly_conditioned_pose_is_still_solved(experiment: Machine) -> None:
    """5 mm above the pulleys' plane the condition is in the hundreds: looked at, and let through."""
    q = np.array([[0.0, 0.0, 0.005 - experiment.profile.geometry.reference_height]])
    pairs = pairs_of(experiment)
    assert 50 < condition(experiment.cables, pairs, q)[0] < 1e4
    assert_allclose(shares(experiment.cables, pairs, q, np.full((1, 3), 6.0)).left, 3.0, atol=1e-9)


def balance(made: Machine, q: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Moments, N m, summed one cable at a time."""
    pairs, pulls = pairs_of(made), -jacobian(made.cables, q, q)[:, :3]
    total = np.zeros_like(q)
    for i in range(3):
        total += np.cross(pairs.left[i], left[:, i, None] * pulls[:, i])
        total += np.cross(pairs.right[i], right[:, i, None] * pulls[:, i])
    return total


def test_moments_balance_with_an_outside_one(any_machine: Machine) -> None:
    rng = np.random.default_rng(51)
    q = workspace(rng, 5_000, 0.3, -0.1, 0.5)
    force, moment = rng.uniform(3, 30, q.shape), rng.uniform(-0.2, 0.2, q.shape)
    found = shares(any_machine.cables, pairs_of(any_machine), q, force, moment)
    assert_allclose(found.left + found.right, force, rtol=1e-14)
    assert_allclose(balance(any_machine, q, found.left, found.right) + moment, 0.0, atol=1e-12)


def test_bounds_cost_a_moment_that_is_told(experiment: Machine) -> None:
    rng = np.random.default_rng(52)
    q = workspace(rng, 5_000, 0.35, -0.1, 0.5)
    pairs = replace(pairs_of(experiment), least=2.0, greatest=12.0)
    force = rng.uniform(4.5, 20.0, q.shape)
    found = bounded_shares(experiment.cables, pairs, q, force)
    free = shares(experiment.cables, pairs, q, force)
    for side in (found.left, found.right):
        assert side.min() >= 2.0 - 1e-12
        assert side.max() <= 12.0 + 1e-12
    assert_allclose(found.left + found.right, force, rtol=1e-14)
    assert_allclose(found.moment, balance(experiment, q, found.left, found.right), atol=1e-12)
    inside = ((free.left >= 2.0) & (free.right >= 2.0) & (free.left <= 12.0) & (free.right <= 12.0)).all(
        axis=1
    )
    assert 0.05 < inside.mean() < 0.95
    assert_allclose(found.left[inside], free.left[inside], rtol=0, atol=0)
    assert np.abs(found.moment[inside]).max() == 0.0
    assert np.linalg.norm(found.moment[~inside], axis=1).min() > 0.0


@pytest.mark.parametrize(("force", "limit"), [(3.0, 4.0), (25.0, 24.0)])
def test_a_pair_that_does_not_fit_its_cables(experiment: Machine, force: float, limit: float) -> None:
    pairs = replace(pairs_of(experiment), least=2.0, greatest=12.0)
    with pytest.raises(MotionError, match="pair 2 carries") as refusal:
        bounded_shares(experiment.cables, pairs, HOME, np.array([[6.0, force, 6.0]]))
    assert refusal.value.problems[0].limit == limit


def test_nine_add_up_to_six(any_machine: Machine) -> None:
    rng = np.random.default_rng(53)
    lower = workspace(rng, 5_000, 0.3, -0.1, 0.5)
    upper, a = lower + rng.uniform(-0.02, 0.02, lower.shape), rng.uniform(-1, 1, (2, *lower.shape))
    made = any_machine
    nine = nine_tensions(made.cables, made.loads, pairs_of(made), lower, upper, *a, moment=lower)
    six = tensions(made.cables, made.loads, lower, upper, *a)
    assert_allclose(nine[:, :3] + nine[:, 3:6], six[:, :3], rtol=0, atol=1e-12)
    assert_allclose(nine[:, 6:], six[:, 3:], rtol=0, atol=1e-12)
    assert_allclose(balance(made, lower, nine[:, :3], nine[:, 3:6]) + lower, 0.0, atol=1e-12)


def test_out_of_reach_is_refused(experiment: Machine) -> None:
    with pytest.raises(MotionError, match="cable 1 cannot reach"):
        shares(experiment.cables, pairs_of(experiment), np.array([[0.0, 0.0, -0.5]]), np.ones((1, 3)))
    with pytest.raises(MotionError):
        forward(experiment.cables, np.zeros((1, 6)))
