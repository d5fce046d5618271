"""Lengths to pose: exact everywhere in the workspace, refused outside."""

import numpy as np
import pytest
from mechanism_oracle import Machine, workspace

from cdhr_host.errors import MotionError
from cdhr_host.mechanism import forward, lengths, reachable, tensions, uncompensated_error
from cdhr_host.mechanism.cables import LOWER, UPPER
from cdhr_host.mechanism.kinematics import wraps_of
from cdhr_host.mechanism.pulley import PointWrap
from cdhr_host.units import MM

HOME = np.zeros((1, 3))


def test_round_trip_over_the_workspace(experiment: Machine) -> None:
    """r < 500 mm, z from -380 to 900 mm: below 1e-9 mm, mirror solutions never."""
    rng = np.random.default_rng(11)
    lower, upper = (workspace(rng, 100_000, 0.5, -0.38, 0.9) for _ in range(2))
    found = forward(experiment.cables, lengths(experiment.cables, lower, upper))
    assert np.abs(found[0] - lower).max() < 1e-9 * MM
    assert np.abs(found[1] - upper).max() < 1e-9 * MM


def test_round_trip_between_the_planes(any_machine: Machine) -> None:
    """From 2 mm above the lower pulleys to 2 mm below the upper ones."""
    shape, rng = any_machine.profile.geometry, np.random.default_rng(12)
    low = 2 * MM - shape.reference_height
    high = shape.upper_pulley_height - shape.reference_height - shape.reference_separation - 2 * MM
    q = workspace(rng, 20_000, 0.5, low, high)
    found = forward(any_machine.cables, lengths(any_machine.cables, q, q))
    assert np.abs(np.array(found) - q).max() < 1e-9 * MM


def test_round_trip_without_pulleys(simulation: Machine) -> None:
    cables = simulation.cables.with_pulley(PointWrap)
    q = workspace(np.random.default_rng(13), 5_000, 0.4, -0.38, 0.8)
    assert np.abs(forward(cables, lengths(cables, q, q))[0] - q).max() < 1e-9 * MM


@pytest.mark.parametrize("platform", [0, 1])
@pytest.mark.parametrize(
    "change",
    [
        pytest.param([-0.6, -0.6, -0.6], id="too short to meet"),
        pytest.param([-0.9, 0.9, 0.9], id="triangle that does not close"),
        pytest.param([-2.0, 0.0, 0.0], id="negative length"),
        pytest.param([np.nan, 0.0, 0.0], id="not a number"),
        pytest.param([np.inf, 0.0, 0.0], id="infinite"),
    ],
)
def test_lengths_without_a_pose_are_refused(simulation: Machine, platform: int, change: list[float]) -> None:
    wanted = np.tile(simulation.cables.reference_lengths, (3, 1))
    wanted[1, 3 * platform : 3 * platform + 3] += change
    with pytest.raises(MotionError, match=r"no pose of the (lower|upper) platform") as refusal:
        forward(simulation.cables, wanted)
    problem = refusal.value.problems[0]
    assert ("cables 4-6" if platform else "cables 1-3") in problem.message
    assert "sample 1" in problem.message
    assert problem.kind == "reach"


def test_random_lengths_are_solved_or_refused(simulation: Machine) -> None:
    """Whatever comes back has the lengths asked for and lies between the pulleys."""
    rng, outcomes = np.random.default_rng(14), []
    for _ in range(60):
        wanted = simulation.cables.reference_lengths + rng.uniform(-0.7, 0.7, (1, 6))
        try:
            found = forward(simulation.cables, wanted)
        except MotionError:
            outcomes.append(False)
            continue
        outcomes.append(True)
        assert reachable(simulation.cables, *found).all()
        assert np.abs(lengths(simulation.cables, *found) - wanted).max() < 1e-12
    assert 5 < sum(outcomes) < 55


@pytest.mark.parametrize(("which", "depth"), [(LOWER, 5 * MM), (UPPER, -5 * MM)], ids=["lower", "upper"])
def test_a_solution_beyond_the_pulley_plane_is_refused(
    experiment: Machine, which: tuple[int, int, int], depth: float
) -> None:
    """Lengths of a platform 5 mm past its pulleys' plane, where the formulas still have values."""
    cables = experiment.cables
    rise = float(cables.anchors[which[0], 2] - cables.attachments[which[0], 2]) - depth
    q = np.zeros(1), np.zeros(1), np.array([rise])
    wanted = np.array([cables.reference_lengths])
    wanted[0, list(which)] = [wrap.length()[0] for wrap in wraps_of(cables, which, q)]
    with pytest.raises(MotionError, match="they meet only beyond the plane"):
        forward(cables, wanted)


def test_uncompensated_error_vanishes_at_the_reference(any_machine: Machine) -> None:
    lower, upper = uncompensated_error(any_machine.cables, HOME, HOME)
    assert np.abs([lower, upper]).max() < 1e-12


@pytest.mark.parametrize(
    ("move", "cable"),
    [
        pytest.param([0.0, 0.0, -0.44], 1, id="below the lower pulleys"),
        pytest.param([0.0, 0.0, 1.31], 4, id="above the upper pulleys"),
        pytest.param([0.835, 0.0, 0.3], 1, id="over a pulley"),
        pytest.param([np.nan, 0.0, 0.0], 1, id="not a number"),
    ],
)
def test_poses_out_of_reach_are_refused(experiment: Machine, move: list[float], cable: int) -> None:
    q = np.zeros((5, 3))
    q[3] = move
    assert reachable(experiment.cables, q, q).tolist() == [True, True, True, False, True]
    with pytest.raises(MotionError, match=rf"cable {cable} cannot reach .* at sample 3") as refusal:
        lengths(experiment.cables, q, q)
    assert refusal.value.exit_code == 5
    with pytest.raises(MotionError, match="sample 3"):
        tensions(experiment.cables, experiment.loads, q, q)


def test_platforms_that_meet_are_refused(experiment: Machine) -> None:
    upper = np.array([[0.0, 0.0, -experiment.loads.separation]])
    with pytest.raises(MotionError, match="platforms meet at sample 0"):
        tensions(experiment.cables, experiment.loads, HOME, upper)


def test_cables_in_one_plane_are_refused(experiment: Machine) -> None:
    """Point ends a picometre above their pulleys' plane cannot carry weight."""
    cables = experiment.cables.with_pulley(PointWrap)
    q = HOME - np.array([0.0, 0.0, experiment.profile.geometry.reference_height - 1e-13])
    with pytest.raises(MotionError, match="in one plane at sample 0"):
        tensions(cables, experiment.loads, q, HOME)
