"""Corners that are braked into: what their path promises, by looking at the path alone."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_tracks import distance_to, moves, norm

from cdhr_host.motion.beside import Allowance
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.smooth_path import smooth

H, A, J = 0.75e-3, 0.5, 5.0


def corner(degrees, lengths, feeds, share=(1.0, 1.0)):
    angle = math.radians(degrees)
    ends = np.array([[-lengths[0], 0, 0], [0, 0, 0], [0, 0, 0]], dtype=float)
    ends[2] = lengths[1] * np.array([math.cos(angle), math.sin(angle), 0.0])
    allowed = Allowance(np.array(feeds), np.array(share), A, J)
    return ends, smooth(ends, H, passed=0.0, closes=True, allowed=allowed)


def swing(path):
    """Pieces of the braked corner, places on them, and the speed it is made for."""
    (pieces,) = (np.flatnonzero(path.brake.any(axis=0)),)
    third = norm(path.coefficients[3][:, pieces].T)
    return pieces, np.cbrt(J / third.max())


CORNER = st.tuples(
    st.floats(20, 149),
    st.tuples(*[st.floats(2e-3, 0.05)] * 2),
    st.tuples(*[st.floats(0.02, 0.1)] * 2),
)


@given(CORNER)
def test_a_braked_corner_keeps_limits_and_tolerance_at_its_own_speed(drawn):
    degrees, lengths, feeds = drawn
    points, path = corner(degrees, lengths, feeds)
    if not path.brake.any():
        return
    pieces, v = swing(path)
    end = path.start[pieces[-1]] + path.lengths()[pieces[-1]]
    s = np.linspace(path.start[pieces[0]] + 1e-12, end - 1e-12, 400)
    _, position, slope, bend = path.at(s)
    assert norm(slope).max() <= 1 + 1e-9
    assert norm(bend).max() * v**2 <= A * (1 + 1e-6)
    assert distance_to(position, points).max() <= H / 3 * (1 + 1e-6)
    assert v <= min(feeds) * (1 + 1e-9)
    before, after = path.brake[:, pieces[0]] * v**2
    assert v + before**2 / (2 * J) <= feeds[0] * (1 + 1e-6)
    assert v + after**2 / (2 * J) <= feeds[1] * (1 + 1e-6)


@given(CORNER)
def test_the_path_joins_its_straights_in_place_and_direction(drawn):
    points, path = corner(*drawn)
    borders = path.start[1:]
    below, above = path.at(borders - 1e-11), path.at(borders + 1e-11)
    assert norm(below[1] - above[1]).max() < 1e-9
    assert norm(below[2] - above[2]).max() < 1e-6
    assert path.at(np.array([path.end]))[1][0] == pytest.approx(points[-1], abs=1e-12)
    assert path.at(np.array([0.0]))[1][0] == pytest.approx(points[0], abs=1e-12)


def test_no_corner_is_braked_into_where_the_air_bounds_the_flow():
    points, path = corner(90, (0.02, 0.02), (0.05, 0.05), share=(0.3, 0.6))
    assert not path.brake.any()
    assert distance_to(path.at(np.linspace(0, path.end, 999))[1], points).max() <= H / 3 * (1 + 1e-6)


def test_no_corner_is_braked_into_without_need_or_room():
    assert not corner(10, (0.02, 0.02), (0.02, 0.02))[1].brake.any()
    assert not corner(90, (1e-3, 0.02), (0.06, 0.06))[1].brake.any()
    assert corner(90, (0.02, 0.02), (0.06, 0.06))[1].brake.all(axis=0).any()


@pytest.mark.parametrize(("degrees", "most"), [(45, 0.11), (60, 0.12), (90, 0.13), (120, 0.12)])
def test_a_fast_corner_costs_little_more_than_with_leaps_of_velocity(degrees, most):
    """Against never slowing down; 0.10 to 0.11 s with leaps of 5 mm/s, 0.19 to 0.26 s with kernels alone."""
    limits = MotionLimits(0.1, A, J, H, math.radians(150))
    ends, _ = corner(degrees, (0.05, 0.05), (0.06, 0.06))
    bent, straight = (
        sum(leg.duration for leg in _legs(limits, points))
        for points in (ends, np.array([[0, 0, 0], [0.1, 0, 0]]))
    )
    assert bent - straight < most


def _legs(limits, points):
    planner = Planner(limits, points[0])
    return [*planner.stretches(moves(points, 0.06)), *planner.close()]


def test_the_path_is_the_same_with_any_feed_override():
    from cdhr_host.motion.leg import FeedOverride, LegPlanner, Segments

    ends, _ = corner(90, (0.02, 0.02), (0.04, 0.04))
    drawn = Segments(ends, np.array([1, 2]), np.array([0.04, 0.04]), np.zeros(2), np.zeros(2), np.ones(2))
    limits = MotionLimits(0.1, A, J, H, math.radians(150))
    paths = []
    for factor in (1.0, 1.7):
        planner = LegPlanner(limits, 0, FeedOverride(factor))
        planner.add(drawn)
        paths.append(planner.plan(closes=True).path)
    assert np.array_equal(paths[0].coefficients, paths[1].coefficients)
