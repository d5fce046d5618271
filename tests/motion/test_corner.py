"""Corners with shapes: what their path promises, by looking at the path alone."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_tracks import distance_to, moves, norm

from cdhr_host.motion import swings
from cdhr_host.motion.beside import Allowance
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.shapes import Shapes, measured, table
from cdhr_host.motion.smooth_path import smooth
from cdhr_host.motion.swings import Corners, Swings, swung

H, A, J = 0.75e-3, 0.5, 5.0


def corner(degrees, lengths, feeds, share=(1.0, 1.0)):
    angle = math.radians(degrees)
    ends = np.array([[-lengths[0], 0, 0], [0, 0, 0], [0, 0, 0]], dtype=float)
    ends[2] = lengths[1] * np.array([math.cos(angle), math.sin(angle), 0.0])
    allowed = Allowance(np.array(feeds), np.array(share), A, J)
    return ends, smooth(ends, H, passed=0.0, closes=True, allowed=allowed)


def full_speed(path):
    """Pieces of the corner, and the greatest s' that limits and feeds allow on all of them."""
    (pieces,) = (np.flatnonzero(path.gear[0]),)
    third = norm(path.coefficients[3][:, pieces].T)
    return pieces, np.cbrt(J / third.max())


CORNER = st.tuples(
    st.floats(15, 179),
    st.tuples(*[st.floats(2e-3, 0.05)] * 2),
    st.tuples(*[st.floats(0.01, 0.12)] * 2),
)


@given(CORNER)
def test_a_corner_keeps_limits_feeds_and_tolerance_at_full_speed(drawn):
    degrees, lengths, feeds = drawn
    points, path = corner(degrees, lengths, feeds)
    if not path.gear.any():
        return
    pieces, v = full_speed(path)
    end = path.start[pieces[-1]] + path.lengths()[pieces[-1]]
    s = np.linspace(path.start[pieces[0]] + 1e-12, end - 1e-12, 1200)
    piece, position, slope, bend = path.at(s)
    assert (norm(slope) <= path.steep[piece] * (1 + 1e-9)).all()
    assert path.steep.max() <= 1 + 1e-12
    assert norm(bend).max() * v**2 <= A * (1 + 1e-6)
    assert distance_to(position, points).max() <= H / 3 * (1 + 1e-6)
    assert (norm(slope) * v <= np.array(feeds)[path.segment[piece]] * (1 + 1e-6)).all()
    assert norm(position).min() <= H / 3 * (1 + 2e-4)


@given(CORNER)
def test_the_path_joins_its_straights_in_place_and_direction(drawn):
    points, path = corner(*drawn)
    borders = path.start[1:]
    below, above = path.at(borders - 1e-11), path.at(borders + 1e-11)
    assert norm(below[1] - above[1]).max() < 1e-9
    gear = [
        np.where(path.gear[0, each[0]] > 0, *gears)
        for each, gears in zip(
            (below, above), ((path.gear[1, below[0]], 1.0), (path.gear[0, above[0]], 1.0)), strict=True
        )
    ]
    within = path.gear[0, below[0]] * path.gear[0, above[0]] > 0
    scale = np.where(within, 1.0, 1 / gear[0]), np.where(within, 1.0, 1 / gear[1])
    assert norm(below[2] * scale[0][:, None] - above[2] * scale[1][:, None]).max() < 1e-6
    assert path.at(np.array([path.end]))[1][0] == pytest.approx(points[-1], abs=1e-12)
    assert path.at(np.array([0.0]))[1][0] == pytest.approx(points[0], abs=1e-12)


def test_curvature_is_zero_where_a_corner_begins_and_ends():
    _, path = corner(75, (0.03, 0.03), (0.06, 0.03))
    pieces, _ = full_speed(path)
    ends = path.start[pieces[0]] + 1e-12, path.start[pieces[-1] + 1] - 1e-12
    assert norm(path.at(np.array(ends))[3]).max() < 1e-5


def test_a_corner_begins_at_one_feed_and_ends_at_the_other():
    _, path = corner(90, (0.05, 0.05), (0.1, 0.03))
    pieces, v = full_speed(path)
    assert path.gear[:, pieces[0]] * v == pytest.approx([0.1, 0.03], rel=0.1)


def test_no_corner_gets_a_shape_where_the_air_bounds_the_flow():
    points, path = corner(90, (0.02, 0.02), (0.05, 0.05), share=(0.3, 0.6))
    assert not path.gear.any()
    assert distance_to(path.at(np.linspace(0, path.end, 999))[1], points).max() <= H / 3 * (1 + 1e-6)


def test_no_corner_gets_a_shape_without_need_or_room():
    assert not corner(10, (0.02, 0.02), (0.02, 0.02))[1].gear.any()
    assert not corner(90, (1e-3, 0.02), (0.06, 0.06))[1].gear.any()
    assert corner(90, (0.02, 0.02), (0.06, 0.06))[1].gear.all(axis=0).any()


@pytest.mark.parametrize(("degrees", "most"), [(45, 0.06), (60, 0.08), (90, 0.09), (120, 0.11)])
def test_a_fast_corner_costs_less_than_with_leaps_of_velocity(degrees, most):
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


def test_shapes_are_what_they_are_measured_to_be():
    """Against sums of many small steps, for shapes of the table at angles between its own."""
    rng = np.random.default_rng(5)
    held = table()
    for _ in range(40):
        n = rng.integers(len(held.angle) - 1)
        i, j = rng.integers(held.rows.shape[2], size=2)
        shape = Shapes.of(held.rows[1, n, i, j])
        angle = rng.uniform(held.angle[n], held.angle[n + 1])
        found = measured(shape, angle, np.True_)
        if found.off > 1e5:
            continue
        t, places, speeds, changes = _stepped(shape, angle, found)
        size = norm(speeds)
        before = t <= shape.duration[:3].sum()
        assert found.duration == pytest.approx(t[-1])
        assert size[[0, -1]] == pytest.approx(found.speed, rel=1e-3, abs=1e-3)
        assert -places[0, 0] == pytest.approx(found.reach[0], abs=1e-2)
        assert (size[before].max(), size[~before].max()) <= tuple(found.peak * 1.001 + 1e-3)
        assert norm(changes).max() <= found.acceleration * (1 + 1e-3)
        away = 10 * found.reach.max() * np.array([[-1, 0], [0, 0], [math.cos(angle), math.sin(angle)]])
        away = np.column_stack((away, np.zeros(3)))
        off = distance_to(np.column_stack((places, np.zeros(len(t)))), away).max()
        middle = norm(places[[np.flatnonzero(before)[-1]]])[0]
        assert 0.94 * found.off <= max(off, middle) <= found.off + 2e-3


def around(room, feed, count=1, degrees=45.0):
    """Corners alike, between straights too short for changing speed."""
    pair = np.ones((2, count))
    limits = pair * np.array([[A], [J]])
    turn = np.full(count, 2 * math.sin(math.radians(degrees) / 2))
    wide, out = np.full(count, H), np.ones(count, dtype=np.bool_)
    return Corners(turn, room * pair, feed * pair, feed * pair, limits, wide, out, pair > 0)


@pytest.mark.parametrize(("room", "degrees"), [(5e-3, 45.0), (2e-3, 90.0), (1e-3, 120.0)])
def test_a_corner_that_is_the_same_both_ways_gets_a_shape_that_is(room, degrees):
    found = swung(around(room, 0.06, degrees=degrees))
    assert np.isfinite(found.duration).all()
    assert found.speed[0] == pytest.approx(found.speed[1], rel=2e-3)
    assert found.reach[0] == pytest.approx(found.reach[1], rel=2e-3)


@pytest.mark.parametrize("met", [0.02, 0.03, 0.04])
def test_a_corner_ends_no_faster_than_it_is_met(met):
    corners = around(5e-3, 0.06)
    found = swung(replace(corners, met=corners.met * np.array([[1.0], [met / 0.06]])))
    assert found.speed[1, 0] <= met * (1 + 1e-9)
    assert found.speed[0, 0] > 0.03


def test_what_is_known_of_kinds_of_corners_is_what_would_be_found(monkeypatch):
    corners = around(np.linspace(1e-3, 9e-3, 7), 0.06, count=7)
    monkeypatch.setattr(swings, "_KNOWN", {})
    first = swung(corners)
    assert len(swings._KNOWN) == 7
    monkeypatch.setattr(swings, "_searched", None)
    again = swung(corners)
    for name in Swings.__slots__:
        assert np.array_equal(getattr(first, name), getattr(again, name))


def test_what_another_thread_forgets_meanwhile_is_not_missed(monkeypatch):
    """A file is proven in one thread while another plans what is printed."""
    known, corners = {}, around(np.linspace(1e-3, 9e-3, 7), 0.06, count=7)
    monkeypatch.setattr(swings, "_KNOWN", known)
    whole, searched = swung(corners), swings._searched

    def forgetful(some):
        known.clear()
        return searched(some)

    for key in list(known)[::2]:
        del known[key]
    monkeypatch.setattr(swings, "_searched", forgetful)
    assert np.array_equal(swung(corners).duration, whole.duration)


def test_no_more_kinds_are_kept_than_the_memory_is_meant_for(monkeypatch):
    monkeypatch.setattr(swings, "_KNOWN", {})
    monkeypatch.setattr(swings, "MOST_KNOWN", 3)
    for room in np.linspace(1e-3, 9e-3, 12):
        swung(around(room, 0.06))
        assert len(swings._KNOWN) <= 4


def test_sides_of_an_octagon_are_driven_at_one_speed():
    """Neighbours that are alike meet at the speed that each has by itself."""
    angle = np.pi / 4 * np.arange(25)
    ways = 0.01 * np.column_stack((np.cos(angle), np.sin(angle), 0 * angle))
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(ways, axis=0)))
    planner = Planner(MotionLimits(0.1, A, J, H, math.pi), points[0])
    legs = [*planner.stretches(moves(points, 0.06)), *planner.close()]
    corner_time = swung(around(5e-3, 0.06)).duration.sum()
    assert sum(leg.duration for leg in legs) < 24 * corner_time + 0.45


def _stepped(shape, angle, found, count=20000):
    """Times, places, speeds and accelerations (N, 2) of a shape; places from its end on the line."""
    ends = np.cumsum(shape.duration)
    t = np.linspace(0.0, ends[-1], count)
    piece = np.minimum(np.searchsorted(ends, t, side="right"), 5)
    d0, d1 = np.array([1.0, 0.0]), np.array([math.cos(angle), math.sin(angle)])
    jerk = (shape.before[piece, None] * d0 + shape.after[piece, None] * d1) / found.jerk
    assert norm(jerk).max() == pytest.approx(1.0, rel=5e-3)
    step = t[1]
    changes = np.cumsum(jerk, axis=0) * step
    speeds = found.speed[0] * d0 + np.cumsum(changes, axis=0) * step
    places = np.cumsum(speeds, axis=0) * step
    return t, places - places[-1] + found.reach[1] * d1, speeds, changes
