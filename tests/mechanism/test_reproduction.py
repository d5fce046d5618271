"""Figures of the paper's trajectories as they come out of the corrected equations."""

import numpy as np
import pytest
from mechanism_oracle import Machine
from numpy.testing import assert_allclose

from cdhr_host.mechanism import cable_state, forward, lengths, tensions, trajectories, uncompensated_error
from cdhr_host.mechanism.kinematics import components
from cdhr_host.mechanism.statics import spring_force
from cdhr_host.units import MM

HOME = np.zeros((1, 3))


def worst_mm(errors: np.ndarray) -> np.ndarray:
    return np.abs(errors).max(axis=0) / MM


def test_uncompensated_ring_of_the_simulation(simulation: Machine) -> None:
    q = trajectories.eq15(np.arange(0.0, 200.0, 0.01))
    lower, upper = uncompensated_error(simulation.cables, q, q)
    assert_allclose(worst_mm(lower), [0.97296, 0.89166, 1.18217], atol=5e-4)
    assert_allclose(worst_mm(upper), [0.87432, 0.80459, 1.51215], atol=5e-4)
    rows = slice(0, len(q))
    spring = spring_force(simulation.loads, components(q + lower, rows), components(q + upper, rows))
    assert spring[2].min() == pytest.approx(29.6696, abs=5e-4)


def test_compensated_ring_is_exact(any_machine: Machine) -> None:
    q = trajectories.eq15(np.arange(0.0, 200.0, 0.05))
    lower, upper = forward(any_machine.cables, lengths(any_machine.cables, q, q))
    assert worst_mm(lower - q).max() < 1e-9
    assert worst_mm(upper - q).max() < 1e-9
    rows = slice(0, len(q))
    spring = np.array(spring_force(any_machine.loads, components(lower, rows), components(upper, rows)))
    preload = any_machine.loads.stiffness * (any_machine.loads.separation - any_machine.loads.rest_length)
    assert np.abs(spring - [[0.0], [0.0], [preload]]).max() < 1e-9


@pytest.mark.parametrize(
    ("path", "until", "plane", "height"),
    [
        (trajectories.eq15, 200.0, (-0.353, 0.634), (1.631, 2.521)),
        (trajectories.eq36, 150.0, (-0.721, 1.210), (0.167, 0.398)),
    ],
    ids=["eq15", "eq36"],
)
def test_uncompensated_experiment(
    experiment: Machine, path: object, until: float, plane: tuple[float, float], height: tuple[float, float]
) -> None:
    """Desired minus real, mean and greatest magnitude, of radius and height."""
    assert callable(path)
    q = path(np.arange(0.0, until, 0.05))
    error, _ = uncompensated_error(experiment.cables, q, q)
    real = q + error
    radial = (np.hypot(q[:, 0], q[:, 1]) - np.hypot(real[:, 0], real[:, 1])) / MM
    rise = -error[:, 2] / MM
    assert_allclose([radial.mean(), np.abs(radial).max()], plane, atol=2e-3)
    assert_allclose([rise.mean(), np.abs(rise).max()], height, atol=2e-3)


def test_forces_at_the_reference(simulation: Machine, experiment: Machine) -> None:
    of_simulation = tensions(simulation.cables, simulation.loads, HOME, HOME)[0]
    of_experiment = tensions(experiment.cables, experiment.loads, HOME, HOME)[0]
    assert_allclose(of_simulation, [9.273388] * 3 + [18.874128] * 3, rtol=0, atol=1e-6)
    assert_allclose(of_experiment, [4.814184] * 3 + [8.768472] * 3, rtol=0, atol=1e-6)


def test_forces_on_the_small_circle_stay_in_their_window(simulation: Machine) -> None:
    t = np.arange(0.0, 10.0, 0.01)
    q, v, a = (trajectories.eq35(t, order) for order in range(3))
    tension = cable_state(simulation.cables, simulation.loads, q, q, v, a).tension
    assert_allclose([tension[:, :3].min(), tension[:, :3].max()], [9.107, 9.438], atol=2e-3)
    assert_allclose([tension[:, 3:].min(), tension[:, 3:].max()], [18.561, 19.183], atol=2e-3)


def test_forces_on_the_ring_leave_their_window(simulation: Machine) -> None:
    t = np.arange(0.0, 200.0, 0.05)
    q, v, a = (trajectories.eq15(t, order) for order in range(3))
    tension = cable_state(simulation.cables, simulation.loads, q, q, v, a).tension
    window = simulation.profile.forces
    low, high = (
        [getattr(window, f"{group}_{end}") for group in ("lower", "upper")] for end in ("min", "max")
    )
    inside = ((tension >= np.repeat(low, 3)) & (tension <= np.repeat(high, 3))).all(axis=1)
    assert inside.mean() == pytest.approx(0.18, abs=0.01)
