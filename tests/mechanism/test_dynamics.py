"""Forces and motion there and back, tensions affine in acceleration, their slopes, natural frequencies."""

from dataclasses import replace

import numpy as np
import pytest
from mechanism_oracle import Machine, workspace
from numpy.testing import assert_allclose

from cdhr_host.errors import MotionError
from cdhr_host.mechanism import (
    Give,
    Pairs,
    accelerations,
    affine_nine_tensions,
    affine_tensions,
    elastic_frequencies,
    lengths,
    nine_tensions,
    slider,
    stretch,
    stretch_doubt,
    stretched_forward,
    swinging_frequencies,
    tension_slopes,
    tensions,
)
from cdhr_host.mechanism.pulley import PULLEYS
from cdhr_host.units import MM

COUNT = 500
HOME = np.zeros((1, 3))


def states(seed: int, count: int = COUNT) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Displacements and accelerations of both platforms."""
    rng = np.random.default_rng(seed)
    lower = workspace(rng, count, 0.35, -0.2, 0.6)
    a, b = rng.uniform(-2, 2, (2, count, 3))
    return lower, lower + rng.uniform(-0.02, 0.02, (count, 3)), a, b


def test_tensions_give_the_accelerations_they_were_made_for(any_machine: Machine) -> None:
    lower, upper, a, b = states(61)
    force = tensions(any_machine.cables, any_machine.loads, lower, upper, a, b)
    found = accelerations(any_machine.cables, any_machine.loads, lower, upper, force)
    assert_allclose(found, [a, b], rtol=0, atol=1e-11)


def test_tensions_are_affine_in_the_accelerations(any_machine: Machine) -> None:
    lower, upper, a, b = states(62)
    cables, loads, pairs = any_machine.cables, any_machine.loads, Pairs.from_profile(any_machine.profile)
    six = affine_tensions(cables, loads, lower, upper)
    assert_allclose(six.at(a, b), tensions(cables, loads, lower, upper, a, b), rtol=1e-12, atol=1e-11)
    nine = affine_nine_tensions(cables, loads, pairs, lower, upper, moment=0.1 * lower)
    expected = nine_tensions(cables, loads, pairs, lower, upper, a, b, 0.1 * lower)
    assert nine.lower.shape == (COUNT, 6, 3)
    assert_allclose(nine.at(a, b), expected, rtol=1e-12, atol=1e-11)
    without = affine_nine_tensions(cables, loads, pairs, lower, upper)
    assert_allclose(without.at(a, b), nine_tensions(cables, loads, pairs, lower, upper, a, b), atol=1e-11)


@pytest.mark.parametrize("model", PULLEYS)
def test_slopes_are_differences(any_machine: Machine, model: str) -> None:
    cables, loads, step = any_machine.cables.with_pulley(PULLEYS[model]), any_machine.loads, 1e-5
    lower, upper, a, b = states(63, 100)
    found = tension_slopes(cables, loads, lower, upper, a, b)
    for axis in range(3):
        move = step * np.eye(3)[axis]
        for slope, way in zip(found, ((move, 0.0), (0.0, move)), strict=True):
            rise = tensions(cables, loads, lower + way[0], upper + way[1], a, b)
            rise -= tensions(cables, loads, lower - way[0], upper - way[1], a, b)
            assert_allclose(slope[:, :, axis], rise / (2 * step), rtol=1e-6, atol=2e-4)


def test_platforms_that_meet_have_no_motion(experiment: Machine) -> None:
    upper = np.array([[0.0, 0.0, -experiment.loads.separation]])
    with pytest.raises(MotionError, match="meet at sample 0"):
        accelerations(experiment.cables, experiment.loads, HOME, upper, np.ones((1, 6)))


def test_swinging(simulation: Machine, experiment: Machine) -> None:
    """physics.md section 5: pendulum, lateral and axial antiphase."""
    found = swinging_frequencies(simulation.cables, simulation.loads, HOME, HOME)[0]
    assert_allclose(found, [0.654, 0.803, 0.803, 5.318, 5.318, 7.148], rtol=0, atol=1e-3)
    found = swinging_frequencies(experiment.cables, experiment.loads, HOME, HOME)[0]
    assert_allclose(found, [0.53, 0.62, 0.62, 4.2, 4.2, 8.2], rtol=0, atol=0.02)


def test_swinging_is_what_the_accelerations_do(experiment: Machine) -> None:
    """The stiffness by differences of the forward dynamics with the tensions held."""
    made, step = experiment, 1e-5
    q = np.array([[0.08, -0.05, 0.1]])
    force = tensions(made.cables, made.loads, q, q)
    matrix = np.empty((6, 6))
    for k in range(6):
        move = np.zeros((2, 1, 3))
        move[k // 3, 0, k % 3] = step
        ahead = accelerations(made.cables, made.loads, *(q + move), force)
        back = accelerations(made.cables, made.loads, *(q - move), force)
        matrix[:, k] = -np.ravel(np.array(ahead) - back) / (2 * step)
    expected = np.sqrt(np.sort(np.linalg.eigvals(matrix).real)) / (2 * np.pi)
    assert_allclose(swinging_frequencies(made.cables, made.loads, q, q)[0], expected, rtol=1e-6)


@pytest.mark.parametrize(
    ("kilonewton", "least", "greatest"),
    [(5, 6.3, 14.4), (10, 8.4, 20.2), (30, 13.9, 34.7), (60, 19.4, 48.9), (100, 24.9, 63.1)],
)
def test_held_by_elastic_cables(
    experiment: Machine, kilonewton: float, least: float, greatest: float
) -> None:
    give = Give.from_profile(experiment.profile)
    give = replace(give, compliance=give.compliance * 30 / kilonewton)
    found = elastic_frequencies(experiment.cables, experiment.loads, give, HOME, HOME)[0]
    assert (found[0], found[-1]) == (pytest.approx(least, abs=0.06), pytest.approx(greatest, abs=0.06))
    if kilonewton == 30:
        assert_allclose(found, [13.9, 13.9, 26.7, 28.9, 34.7, 34.7], rtol=0, atol=0.06)


@pytest.mark.parametrize("stiffness", [1.0, 1 / 6])
def test_stretch_compensated_and_back(any_machine: Machine, stiffness: float) -> None:
    """EA = 30 kN and 5 kN: the corrected sliders bring the stretched machine to the pose, and only they."""
    made, give = any_machine, Give.from_profile(any_machine.profile)
    give = replace(
        give, compliance=give.compliance / stiffness, reference_stretch=give.reference_stretch / stiffness
    )
    lower, upper, *_ = states(64)
    upper = lower + 0.3 * (upper - lower)
    force = tensions(made.cables, made.loads, lower, upper)
    rigid = slider(made.cables, lengths(made.cables, lower, upper))
    found = stretched_forward(made.cables, made.loads, give, rigid + give.slider_correction(force))
    assert_allclose(found, [lower, upper], rtol=0, atol=1e-9 * MM)
    off = stretched_forward(made.cables, made.loads, give, rigid)
    assert 0.02 * MM < np.abs(np.array(off) - [lower, upper]).max() < 20 * MM


def test_stretch_vanishes_at_the_reference(any_machine: Machine) -> None:
    made, give = any_machine, Give.from_profile(any_machine.profile)
    force = tensions(made.cables, made.loads, HOME, HOME)
    assert_allclose(give.slider_correction(force), 0.0, atol=1e-18)
    assert_allclose(give.correction_rates(force), -give.reference_stretch[None], rtol=1e-14)


def test_doubt_bounds_what_another_stiffness_does(experiment: Machine) -> None:
    """Compensated for EA = 30 kN where the cables have 20 % more or less."""
    made, give = experiment, Give.from_profile(experiment.profile)
    lower = workspace(np.random.default_rng(65), COUNT, 0.2, 0.0, 0.3)
    force = tensions(made.cables, made.loads, lower, lower)
    rigid = slider(made.cables, lengths(made.cables, lower, lower))
    bound = stretch_doubt(made.cables, give, lower, lower, force)
    for part in (1 / 0.8, 1 / 1.2):
        real = replace(
            give, compliance=give.compliance * part, reference_stretch=give.reference_stretch * part
        )
        reached, _ = stretched_forward(made.cables, made.loads, real, rigid + give.slider_correction(force))
        assert (np.abs(reached - lower) <= 1.1 * bound + 1e-6 * MM).all()
    assert 0.005 * MM < bound.max() < 0.1 * MM


def test_a_pose_that_does_not_settle(experiment: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stretch, "ROUNDS", 1)
    give = Give.from_profile(experiment.profile)
    with pytest.raises(MotionError, match="still moves by") as refusal:
        stretched_forward(experiment.cables, experiment.loads, give, np.full((1, 6), -0.01))
    assert refusal.value.problems[0].kind == "unsettled"
