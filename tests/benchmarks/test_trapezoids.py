"""The baseline is what it says: trapezoids of speed, and jumps of at most 5 mm/s between them."""

import math

import numpy as np
import pytest
from peers import Peaks
from trapezoids import Polyline, trapezoids

A, JUMP = 0.5, 0.005


def plan(points, feed):
    points = np.array([(*p, 0.0) for p in points])
    return trapezoids(Polyline(points, np.full(len(points) - 1, feed)), A, JUMP)


def test_single_move_takes_the_time_of_its_trapezoid():
    assert plan([(0, 0), (0.06, 0)], 0.05).duration == pytest.approx(0.06 / 0.05 + 0.05 / A)


def test_short_move_is_a_triangle():
    assert plan([(0, 0), (0.001, 0)], 0.1).duration == pytest.approx(2 * math.sqrt(0.001 / A))


def test_points_on_a_line_change_nothing():
    whole = plan([(0, 0), (0.06, 0)], 0.05)
    parts = plan([(0, 0), (0.01, 0), (0.0101, 0), (0.06, 0)], 0.05)
    assert parts.duration == pytest.approx(whole.duration)


@pytest.mark.parametrize("turn_deg", [5, 30, 90, 150, 180])
def test_velocity_at_a_corner_jumps_by_the_jump(turn_deg):
    turn = math.radians(turn_deg)
    law = plan([(0, 0), (0.05, 0), (0.05 + 0.05 * math.cos(turn), 0.05 * math.sin(turn))], 0.05)
    t = law.duration / 2 + np.array([-2e-6, -1e-6, 1e-6, 2e-6])
    before, _, after = np.diff(law.at(t), axis=0) / 1e-6
    assert np.linalg.norm(after - before) == pytest.approx(min(JUMP, 2 * 0.05 * math.sin(turn / 2)), rel=0.01)


def test_motion_keeps_speed_and_ends_at_the_last_point():
    rng = np.random.default_rng(3)
    points = np.cumsum(rng.uniform(-0.01, 0.01, (40, 2)), axis=0)
    law = plan(points, 0.05)
    position = law.at(np.arange(0.0, law.duration, 1e-4))
    assert np.linalg.norm(np.diff(position, axis=0), axis=1).max() <= 0.05 * 1e-4 * (1 + 1e-6)
    assert law.at(np.array([law.duration]))[0] == pytest.approx([*points[-1], 0.0])


def test_peaks_are_those_of_a_known_motion_in_any_blocks():
    t = np.arange(0, 400) * 1e-3
    position = np.column_stack((np.sin(10 * t) * 1e-2, np.zeros((400, 2))))
    peaks = Peaks()
    for block in np.array_split(position, [1, 2, 5, 200]):
        peaks.see(block)
    assert peaks.acceleration == pytest.approx(1.0, rel=1e-3)
    assert peaks.jerk == pytest.approx(10.0, rel=1e-3)
