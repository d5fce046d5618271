"""Lower cables over the bed and the print: radii, collisions named, nothing said where nothing is hit."""

import numpy as np
import pytest
from mechanism_oracle import COLUMNS, Machine, machine

from cdhr_host.errors import MotionError
from cdhr_host.mechanism import Clearance, Pairs, clear_radius, trajectories
from cdhr_host.mechanism.clearance import CABLES, cable_lines, depth_inside
from cdhr_host.mechanism.height_map import HeightMap
from cdhr_host.units import MM


@pytest.mark.parametrize(
    ("column", "height", "nozzle", "radius"),
    [
        ("exp", 438.5, 50, 85),
        ("exp", 588.5, 50, 70),
        ("exp", 438.5, 100, 140),
        ("exp", 588.5, 100, 110),
        ("exp", 438.5, 150, 205),
        ("exp", 588.5, 150, 155),
        ("exp", 438.5, 200, 280),
        ("exp", 588.5, 200, 205),
        ("exp", 588.5, 300, 320),
        ("sim", 868.0, 100, 85),
        ("sim", 868.0, 200, 140),
        ("sim", 868.0, 300, 210),
    ],
)
def test_clear_radius(column: str, height: float, nozzle: float, radius: float) -> None:
    """physics.md section 6, in steps of 5 mm."""
    made = machine(COLUMNS[column])
    pairs = Pairs.from_profile(made.profile)
    found = clear_radius(made.cables, pairs, nozzle * MM, height * MM, step=5 * MM)
    assert found / MM == pytest.approx(radius)


def test_a_long_nozzle_clears_everything(experiment: Machine) -> None:
    pairs = Pairs.from_profile(experiment.profile)
    assert clear_radius(experiment.cables, pairs, 0.3, 0.4385, step=5 * MM) == np.inf
    assert clear_radius(experiment.cables, pairs, 0.2, 0.4385, gap=0.02) < 0.28


def spot(r: float, azimuth: float, z: float, aside: float = 0.0) -> np.ndarray:
    """A short radial bead, ``aside`` of its azimuth."""
    along = np.linspace(r - 0.005, r + 0.005, 30)
    turn = np.radians(azimuth)
    x, y = along * np.cos(turn) - aside * np.sin(turn), along * np.sin(turn) + aside * np.cos(turn)
    return np.column_stack([x, y, np.full(30, z)])


def print_block(clear: Clearance, points: np.ndarray, line: int, clay: bool = True) -> list[str]:
    lines = np.full(len(points), line)
    return [problem.message for problem in clear.block(points, lines, np.full(len(points), clay))]


def test_a_wall_under_cable_2_is_hit_and_named(experiment: Machine) -> None:
    """Clay 150 mm high under the left cable of pair 2: the nozzle passes on the other side."""
    clear = Clearance.from_profile(experiment.profile)
    for k, z in enumerate(np.arange(0.0, 0.151, 0.01)):
        assert print_block(clear, spot(0.25, 120.0, float(z), 0.055), 10 + k) == []
    away = spot(0.1, 300.0, 0.0)
    problems = clear.block(away, np.full(len(away), 99), np.zeros(len(away), dtype=bool))
    assert {problem.line for problem in problems} == {99}
    assert {problem.kind for problem in problems} == {"clearance"}
    named = " ".join(problem.message for problem in problems)
    assert "cable 2 left" in named
    assert "cable 2 right" not in named
    assert "line 25 printed" in named
    assert "cable 1" not in named
    assert clear.block(away, np.full(len(away), 99), np.zeros(len(away), dtype=bool)) == []
    assert print_block(clear, away, 100) != []


def test_the_depth_told_is_the_depth_there_is(experiment: Machine) -> None:
    """One pose, one cell: the cable's height above it by hand, half a cell off at most."""
    clear = Clearance.from_profile(experiment.profile, gap=0.0)
    at = np.array([[0.28, 0.055, 0.12]])
    clear.block(at, np.array([1]), np.array([True]))
    pose = np.array([[-0.1, 0.0, 0.02]])
    problems = clear.block(pose, np.array([2]), np.array([False]))
    lines = cable_lines(clear.cables, clear.pairs, clear.nozzle_length, pose)
    left = CABLES.index("1 left")
    start, run = lines.start[0, left], lines.run[0, left]
    share = (0.28 - start[0]) / run[0]
    assert start[1] + share * run[1] == pytest.approx(0.055)
    assert problems
    told = {problem.message.split(" would")[0]: float(problem.value or 0) for problem in problems}
    slope = -run[2] / run[0]
    depth = 0.12 - (start[2] + share * run[2])
    assert told["cable 1 left"] * MM == pytest.approx(depth, abs=1.5 * 0.005 * slope + 0.002)


def test_what_is_below_every_cable_is_not_hit(experiment: Machine) -> None:
    clear = Clearance.from_profile(experiment.profile)
    assert print_block(clear, spot(0.25, 120.0, 0.0, 0.055), 1) == []
    assert print_block(clear, spot(0.1, 300.0, 0.05), 2) == []


def test_clay_laid_across_a_gap_between_samples_stands_on_the_way(experiment: Machine) -> None:
    """Two samples 100 mm apart, in two blocks: the wall between them is there."""
    clear = Clearance.from_profile(experiment.profile)
    turn = np.radians(120.0)
    way = np.array([np.cos(turn), np.sin(turn), 0.0])
    across = np.array([-way[1], way[0], 0.0])
    for side, line in ((-0.05, 1), (0.05, 2)):
        point = (0.25 * way + (0.055 + side) * across + [0.0, 0.0, 0.15])[None]
        clear.block(point, np.array([line]), np.array([line == 2]))
    assert any("line 2 printed" in text for text in print_block(clear, spot(0.1, 300.0, 0.0), 3, clay=False))


def test_a_short_nozzle_meets_the_bed(experiment: Machine) -> None:
    geometry = experiment.profile.geometry.model_copy(update={"nozzle_length": 0.05})
    clear = Clearance.from_profile(experiment.profile.model_copy(update={"geometry": geometry}))
    told = print_block(clear, spot(0.0, 0.0, 0.0), 7, clay=False)
    assert len(told) == 6
    assert all("the bed" in text for text in told)


@pytest.mark.parametrize("path", ["eq15", "eq35", "eq36"])
def test_the_papers_trajectories_are_clear(any_machine: Machine, path: str) -> None:
    law = {"eq15": trajectories.eq15, "eq35": trajectories.eq35, "eq36": trajectories.eq36}[path]
    clear = Clearance.from_profile(any_machine.profile)
    points = law(np.arange(0.0, 100.0, 0.02))
    for block in np.array_split(points, 5):
        assert print_block(clear, block, 1) == []


def test_an_empty_block_and_a_pose_out_of_reach(experiment: Machine) -> None:
    clear = Clearance.from_profile(experiment.profile)
    assert print_block(clear, np.zeros((0, 3)), 1) == []
    with pytest.raises(MotionError, match="cable 1 cannot reach"):
        print_block(clear, np.array([[0.0, 0.0, -0.5]]), 1)


def test_depth_inside_by_sampling(experiment: Machine) -> None:
    """Against ten thousand points on each cable."""
    rng = np.random.default_rng(91)
    turn, r = rng.uniform(0, 2 * np.pi, 200), 0.3 * np.sqrt(rng.random(200))
    nozzle = np.column_stack([r * np.cos(turn), r * np.sin(turn), rng.uniform(0, 0.2, 200)])
    lines = cable_lines(experiment.cables, Pairs.from_profile(experiment.profile), 0.1, nozzle)
    part = np.linspace(0.0, 1.0, 10_001)
    found = depth_inside(lines, 0.05, 0.2)
    for n in range(0, 200, 10):
        for i in range(6):
            points = lines.start[n, i] + part[:, None] * lines.run[n, i]
            below = points[points[:, 2] <= 0.05]
            expected = 0.2 - np.hypot(below[:, 0], below[:, 1]).min()
            assert found[n, i] == pytest.approx(expected, abs=2e-4)


def test_nothing_below_is_nowhere_inside(experiment: Machine) -> None:
    lines = cable_lines(experiment.cables, Pairs.from_profile(experiment.profile), 0.1, np.zeros((1, 3)))
    assert (depth_inside(lines, -1.0, 0.2) == -np.inf).all()


def test_the_map_keeps_the_highest_and_its_line() -> None:
    heights = HeightMap(0.1, 0.005)
    path = np.array([[0.0, 0.0, 0.02], [0.05, 0.0, 0.02]])
    heights.lay(path, np.array([5, 5]), np.array([True, True]))
    heights.lay(path - [0.0, 0.0, 0.01], np.array([6, 6]), np.array([True, True]))
    found, line = heights.at(np.array([0.025, 0.025, 0.09, 5.0]), np.array([0.0, 0.03, 0.0, 0.0]))
    assert found.tolist() == [0.02, 0.0, 0.0, 0.0]
    assert line.tolist() == [5, 0, 0, 0]
    assert heights.top == 0.02
    assert heights.radius == pytest.approx(0.065)


def test_the_rim_does_not_leak_into_what_is_beyond() -> None:
    heights = HeightMap(0.1, 0.005)
    heights.lay(np.array([[0.1, 0.0, 0.02]]), np.array([1]), np.array([True]))
    assert heights.at(np.array([0.1]), np.array([0.0]))[0][0] == 0.02
    assert heights.at(np.array([0.3, 0.12]), np.array([0.0, 0.0]))[0].tolist() == [0.0, 0.0]
