"""Straight ways to sharp corners: nothing moves further than promised, and time is saved."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from motion_tracks import distance_to, moves, norm

from cdhr_host.motion import approach, beside, corner, leg
from cdhr_host.motion.approach import SPENT, straightened
from cdhr_host.motion.beside import Allowance
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.smooth_path import smooth

H, A, J = 0.747e-3, 0.5, 5.0
LIMITS = MotionLimits(0.1, A, J, H, math.radians(179))


def curves(turns, radii, chords):
    """Arcs of chords that meet in corners."""
    points, heading = [np.zeros(2)], 0.0
    for turn, radius, chord in zip(turns, radii, chords, strict=True):
        heading += turn
        for _ in range(8):
            heading += chord / radius
            points.append(points[-1] + chord * np.array([math.cos(heading), math.sin(heading)]))
    return np.column_stack((points, np.zeros(len(points))))


CURVES = st.integers(2, 6).flatmap(
    lambda n: st.tuples(
        st.lists(st.floats(-3.1, 3.1), min_size=n, max_size=n),
        st.lists(st.sampled_from([0.004, 0.02, 0.1, -0.02, -0.1]), min_size=n, max_size=n),
        st.lists(st.sampled_from([1e-4, 4e-4, 1.2e-3, 2e-3, 6e-3]), min_size=n, max_size=n),
    )
)


@settings(max_examples=40, deadline=None)
@given(CURVES, st.integers(0, 9))
def test_the_path_stays_within_the_tolerance_of_what_was_drawn(drawn, seed):
    points = curves(*drawn)
    feed = (
        np.random.default_rng(seed)
        .choice([0.002, 0.03, 0.1], 9)
        .repeat(len(points) // 9 + 1)[1 : len(points)]
    )
    driven = checked(points, feed, feed > 0)
    assert norm(driven - points).max() <= SPENT * H * (1 + 1e-9)
    assert np.array_equal(driven[[0, -1]], points[[0, -1]])


def checked(points, feed, lays, count=3000):
    """Where it is driven; that and the path keep to what was drawn, and what was drawn to them."""
    driven, moved = straightened(points, feed, lays, H)
    assert distance_to(driven, points).max() <= SPENT * H * (1 + 1e-9)
    assert distance_to(points, driven).max() <= SPENT * H * (1 + 1e-9)
    assert (norm(np.diff(driven, axis=0)) > 0).all()
    path = smooth(driven, H, passed=0.0, closes=True, allowed=Allowance(feed, feed / feed, A, J), moved=moved)
    _, position, slope, _ = path.at(np.linspace(0, path.end, count))
    assert distance_to(position, points).max() <= H / 3 * (1 + 1e-6)
    assert distance_to(points, position).max() <= H / 3 + path.end / count
    assert norm(slope).max() <= 1 + 1e-9
    return driven


STEPS = st.lists(
    st.tuples(
        st.floats(-3.14, 3.14), st.sampled_from([5e-5, 1e-4, 2e-4, 5e-4, 9e-4, 1.4e-3, 3e-3, 8e-3, 0.02])
    ),
    min_size=3,
    max_size=14,
)


@settings(max_examples=150, deadline=None)
@given(STEPS, st.booleans(), st.integers(0, 9))
@example([(0.0, 5e-5), (0.0, 3e-3), (2.8125, 5e-4), (2.875, 3e-3)], False, 0)  # there and back and on
def test_steps_between_sharp_corners_stay_within_the_tolerance(steps, zigzag, seed):
    turns, lengths = np.array(steps).T
    heading = np.cumsum(np.abs(turns) * (-1.0) ** np.arange(len(turns)) if zigzag else turns)
    ways = lengths[:, None] * np.stack((np.cos(heading), np.sin(heading), 0.1 * np.sin(3 * heading)), axis=1)
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(ways, axis=0)))
    feed = np.random.default_rng(seed).choice([0.03, 0.03, 0.03, 0.06], len(ways))
    checked(points, feed, feed < 0.05)


def test_what_has_no_sharp_corner_is_left_as_it_is():
    points = curves([0.0], [0.02], [1e-3])
    driven, moved = straightened(points, np.ones(len(points) - 1), np.ones(len(points) - 1) > 0, H)
    assert driven is points
    assert not moved.spent.any()


def test_two_corners_at_a_speck_become_one():
    points = np.array([[-0.02, 0, 0], [0, 0, 0], [0, 1e-4, 0], [-0.02, 1e-4, 0]])
    driven, moved = straightened(points, np.array([0.06, 0.06, 0.03]), np.ones(3) > 0, H)
    assert np.allclose(driven[2], [0, 5e-5, 0])
    assert norm(driven[1:2] - driven[2:3]) == pytest.approx(1e-6)
    assert moved.spent[2] == pytest.approx(5.1e-5)


def test_a_corner_between_curves_takes_less_time(monkeypatch):
    points = curves([0.0, 0.0, 1.5, 0.0], [0.05] * 4, [1e-3] * 4)
    better = _time(points)
    for room in (approach, beside):
        monkeypatch.setattr(room, "SHARP", 9.0)
    assert better < _time(points) - 0.05


def test_three_corners_at_a_speck_become_one_on_the_side_that_is_driven_alike():
    points = np.array([[-0.02, 0, 0], [0, 0, 0], [0, -2e-4, 0], [1e-4, -2e-4, 0], [0.01, -0.01, 0]])
    driven, moved = straightened(points, np.array([0.03, 0.06, 0.06, 0.06]), np.ones(4) > 0, H)
    assert np.allclose(driven[1], [5e-5, -1e-4, 0])
    assert norm(np.diff(driven[1:4], axis=0)).max() < 1e-5
    assert moved.spent[1:4].min() > norm(driven[1:4] - points[1:4]).max() * (1 - 1e-9)


def test_a_corner_just_after_a_change_of_feed_takes_little_more_time_than_without():
    turned = [[0.02, 0, 0], [0.0202, 0, 0], [0.0202, 0.02, 0]]
    points = np.array([[0, 0, 0], *turned])
    changed, same = _time(points, np.array([0.03, 0.06, 0.06])), _time(points, np.array([0.03, 0.03, 0.06]))
    assert changed < same + 0.01


def test_a_corner_beside_a_chord_before_a_long_one_takes_no_more_time_than_without_the_chord():
    with_chord = np.array([[0, 0, 0], [0.02, 0, 0], [0.0203, 5e-4, 0], [0.0238, 6.4e-3, 0], [0.03, 0.02, 0]])
    assert _time(with_chord) < _time(np.delete(with_chord, 2, axis=0)) + 0.01


@pytest.mark.parametrize(("turn", "back"), [(1.57, -1.57), (1.57, 1.57), (1.1, -1.15)])
def test_corners_with_a_millimetre_between_them_take_less_time_than_kernels_that_overlap(
    monkeypatch, turn, back
):
    heading = np.array([0.0, turn, turn + back])
    ways = np.array([0.015, 9e-4, 0.015])[:, None] * np.stack(
        (np.cos(heading), np.sin(heading), 0 * heading), 1
    )
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(ways, axis=0)))
    monkeypatch.setattr(leg, "hastened", lambda law, *_: law)
    together = _time(points)
    monkeypatch.setattr(corner, "ROW", 1)
    monkeypatch.setattr(approach, "SLANTS", ())
    assert together < _time(points) - 0.05


def test_a_step_to_the_side_is_drawn_slanted_where_all_around_is_driven_alike(monkeypatch):
    heading = np.array([0.0, 0.4, 0.0])
    ways = np.array([0.015, 1.3e-3, 0.015])[:, None] * np.stack(
        (np.cos(heading), np.sin(heading), 0 * heading), 1
    )
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(ways, axis=0)))
    driven, _ = straightened(points, np.full(3, 0.03), np.ones(3) > 0, H)
    assert norm(driven - points)[1:3].min() > 0.5 * H
    assert not norm(driven[:2] - points[:2])[0]
    other, _ = straightened(points, np.full(3, 0.03), np.array([True, True, False]), H)
    assert other is points
    slanted = _time(points)
    monkeypatch.setattr(approach, "SLANTS", ())
    assert slanted < _time(points) - 0.03


def _time(points, feed=0.03):
    planner = Planner(LIMITS, points[0])
    return sum(leg.duration for leg in [*planner.stretches(moves(points, feed)), *planner.close()])
