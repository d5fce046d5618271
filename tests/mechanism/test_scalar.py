"""The arrays against one pose at a time, and the derivatives against differences."""

import numpy as np
import pytest
from mechanism_oracle import COLUMNS, Machine, cable_length, forces, machine, vector_ba, workspace
from numpy.testing import assert_allclose

from cdhr_host.mechanism import cable_state, jacobian, lengths, tensions, trajectories, uncompensated_lengths
from cdhr_host.mechanism.kinematics import BLOCK
from cdhr_host.mechanism.pulley import PointWrap
from cdhr_host.units import MM

COUNT = 300


def poses(seed: int, count: int = COUNT) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper displacements, m, the upper up to 20 mm away from where the lower one is."""
    rng = np.random.default_rng(seed)
    lower = workspace(rng, count, 0.5, -0.38, 0.8)
    return lower, lower + rng.uniform(-0.02, 0.02, (count, 3))


@pytest.mark.parametrize("column", COLUMNS)
def test_lengths_equal_the_scalar_equations(column: str) -> None:
    lower, upper = poses(1)
    expected = [
        [cable_length(*vector_ba(column, i, (below if i < 3 else above).tolist())) for i in range(6)]
        for below, above in zip(lower / MM, upper / MM, strict=True)
    ]
    found = lengths(machine(COLUMNS[column]).cables, lower, upper)
    assert_allclose(found / MM, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("column", COLUMNS)
def test_tensions_equal_the_scalar_equations(column: str) -> None:
    made, rng = machine(COLUMNS[column]), np.random.default_rng(3)
    lower, upper = poses(2)
    accelerations = rng.uniform(-2.0, 2.0, (2, COUNT, 3))
    q = np.hstack([lower, upper]) / MM
    a = np.hstack([accelerations[0], accelerations[1]]) / MM
    expected = [forces(column, *row) for row in zip(q.tolist(), a.tolist(), strict=True)]
    found = tensions(made.cables, made.loads, lower, upper, *accelerations)
    assert_allclose(found, expected, rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize("pulleys", ["swivel", "point"])
def test_jacobian_is_the_slope_of_the_lengths(any_machine: Machine, pulleys: str) -> None:
    cables = any_machine.cables if pulleys == "swivel" else any_machine.cables.with_pulley(PointWrap)
    lower, upper = poses(4)
    slope, step = jacobian(cables, lower, upper), 1e-5
    for axis in range(3):
        move = step * np.eye(3)[axis]
        rise = lengths(cables, lower + move, upper + move) - lengths(cables, lower - move, upper - move)
        assert_allclose(slope[:, :, axis], rise / (2 * step), rtol=0, atol=1e-9)
    assert_allclose(np.linalg.norm(slope, axis=2), 1.0, rtol=1e-13)


@pytest.mark.parametrize("pulleys", ["swivel", "point"])
def test_rates_are_derivatives_along_a_curve(any_machine: Machine, pulleys: str) -> None:
    """Both platforms on their own parabolas: l' and l'' by fourth-order differences in time."""
    cables = any_machine.cables if pulleys == "swivel" else any_machine.cables.with_pulley(PointWrap)
    rng, h = np.random.default_rng(5), 2e-3
    starts = poses(5)
    v, a = rng.uniform(-0.1, 0.1, (2, COUNT, 3)), rng.uniform(-0.5, 0.5, (2, COUNT, 3))

    def at(t: float) -> np.ndarray:
        return lengths(cables, *(starts[k] + v[k] * t + 0.5 * a[k] * t * t for k in range(2)))

    state = cable_state(
        cables, any_machine.loads, *starts, v[0], a[0], upper_velocity=v[1], upper_acceleration=a[1]
    )
    far, near = (at(2 * h), at(-2 * h)), (at(h), at(-h))
    rate = (8 * (near[0] - near[1]) - (far[0] - far[1])) / (12 * h)
    second = (16 * (near[0] + near[1]) - (far[0] + far[1]) - 30 * at(0.0)) / (12 * h * h)
    assert_allclose(state.rate, rate, rtol=0, atol=1e-11)
    assert_allclose(state.acceleration, second, rtol=0, atol=2e-8)


def test_uncompensated_lengths_are_the_distances(any_machine: Machine) -> None:
    cables = any_machine.cables
    lower, upper = poses(6)
    both = np.concatenate(
        [np.repeat(lower[:, None], 3, axis=1), np.repeat(upper[:, None], 3, axis=1)], axis=1
    )
    distance = np.linalg.norm(cables.anchors - cables.attachments - both, axis=2)
    assert_allclose(uncompensated_lengths(cables, lower, upper), distance, rtol=1e-15)


@pytest.mark.parametrize("count", [0, 1, BLOCK, BLOCK + 1])
def test_blocks_join_without_a_seam(simulation: Machine, count: int) -> None:
    lower, upper = poses(7, count)
    made = simulation
    state = cable_state(made.cables, made.loads, lower, upper, lower, upper)
    assert state.length.shape == (count, 6)
    pick = slice(max(0, count - 2), count)
    part = cable_state(made.cables, made.loads, lower[pick], upper[pick], lower[pick], upper[pick])
    for name in ("length", "rate", "acceleration", "tension"):
        assert_allclose(getattr(state, name)[pick], getattr(part, name), rtol=1e-13, atol=1e-15)


def test_the_upper_platform_moves_with_the_lower_unless_told(simulation: Machine) -> None:
    lower, upper = poses(8, 5)
    v, a = np.full((5, 3), 0.01), np.full((5, 3), 0.2)
    shared = cable_state(simulation.cables, simulation.loads, lower, upper, v, a)
    told = cable_state(
        simulation.cables, simulation.loads, lower, upper, v, a, upper_velocity=v, upper_acceleration=a
    )
    assert_allclose(shared.rate, told.rate, rtol=0, atol=0)
    assert_allclose(shared.tension, told.tension, rtol=0, atol=0)


@pytest.mark.parametrize("path", [trajectories.eq15, trajectories.eq35, trajectories.eq36])
def test_trajectories_have_their_derivatives(path: object) -> None:
    assert callable(path)
    t, h = np.linspace(1.0, 149.0, 60), 1e-4
    for order in (0, 1):
        slope = (path(t + h, order) - path(t - h, order)) / (2 * h)
        assert_allclose(path(t, order + 1), slope, rtol=0, atol=1e-9)
