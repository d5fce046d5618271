"""Two right angles in a row that are run through as one: what their path promises."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_tracks import distance_to, moves, norm

from cdhr_host.motion import paired
from cdhr_host.motion.beside import Allowance
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.pair_shapes import Pairs, table
from cdhr_host.motion.pairs import INSIDE, Ways, passed
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.smooth_path import smooth

H, A, J = 0.75e-3, 0.5, 5.0
LIMITS = MotionLimits(0.2, A, J, H, math.pi)
TOLERANCE = H / 3 * (1 + 1e-6)
SHORT = st.floats(1e-3, 11e-3)
LONG = st.tuples(*[st.floats(12e-3, 60e-3)] * 2)
FEEDS = st.tuples(*[st.floats(4e-3, 0.12)] * 3)
TURN = st.floats(0.0, 180.0)


def hop(degrees, length, beside=(0.04, 0.04), *, falls=False):
    """Along, up, and on at an angle to where it came from; or the same the other way round."""
    angle = math.radians(degrees)
    ways = np.array([[1.0, 0, 0], [0, 0, 1.0], [math.cos(angle), math.sin(angle), 0]])
    points = np.vstack((np.zeros(3), np.cumsum(ways * [[beside[0]], [length], [beside[1]]], axis=0)))
    return points[::-1] if falls else points


def bend(length, beside=(0.04, 0.04), *, back=True, heading=0.0):
    """Along, to the side, and back, or on."""
    turns = np.radians(heading + np.array([0.0, 90.0, 180.0 if back else 0.0]))
    ways = np.column_stack((np.cos(turns), np.sin(turns), 0 * turns))
    return np.vstack((np.zeros(3), np.cumsum(ways * [[beside[0]], [length], [beside[1]]], axis=0)))


def path_of(points, feeds):
    allowed = Allowance(np.array(feeds), np.ones(len(feeds)), A, J)
    return smooth(points, H, passed=0.0, closes=True, allowed=allowed)


def is_pair(path):
    """Whether all its shapes are one, over three segments."""
    shaped = np.flatnonzero(path.gear[0])
    return len(set(path.segment[shaped])) > 2 and (np.diff(shaped) == 1).all()


def duration(points, feeds):
    planner = Planner(LIMITS, points[0])
    return sum(leg.duration for leg in [*planner.stretches(moves(points, feeds)), *planner.close()])


def rates(leg, step=2e-4):
    """Places (N, 3) m, and m/s, m/s² and m/s³ by the chain rule; the piece of each."""
    t = np.arange(0.0, leg.duration, step)
    s, v, a = leg.law.at(t)
    j = leg.law.state[3, np.searchsorted(leg.law.t, t, side="right") - 1][:, None]
    piece, place, slope, bend = leg.path.at(s)
    third, v, a = leg.path.coefficients[3][:, piece].T, v[:, None], a[:, None]
    jerk = third * v**3 + 3 * bend * v * a + slope * j
    return piece, place, (slope * v, bend * v**2 + slope * a, jerk)


def look(points, feeds):
    """Plans a program of one leg and checks it; whether it has a pair."""
    planner = Planner(LIMITS, points[0])
    (leg,) = [*planner.stretches(moves(points, feeds)), *planner.close()]
    piece, place, (speed, change, jerk) = rates(leg)
    allowed = np.minimum(np.array(feeds)[leg.path.segment[piece]], LIMITS.speed)
    assert (norm(speed) <= allowed * (1 + 1e-6)).all()
    assert norm(change).max() <= A * (1 + 1e-6)
    assert norm(jerk).max() <= J * (1 + 1e-6)
    assert distance_to(place, points).max() <= TOLERANCE
    for corner in points[1:3]:
        assert norm(place - corner).min() <= TOLERANCE + 1e-5
    assert place[:, 2].min() >= points[:, 2].min() - INSIDE
    assert leg.path.steep.max() <= 1 + 1e-12
    return is_pair(leg.path)


@given(TURN, SHORT, LONG, FEEDS, st.booleans())
@settings(max_examples=150, deadline=None)
def test_a_hop_keeps_limits_feeds_and_tolerance_and_stays_above(degrees, length, beside, feeds, falls):
    look(hop(degrees, length, beside, falls=falls), feeds[::-1] if falls else feeds)


@given(SHORT, LONG, FEEDS, st.booleans(), st.floats(0, 360))
@settings(max_examples=100, deadline=None)
def test_the_end_of_a_line_keeps_limits_feeds_and_tolerance(length, beside, feeds, back, heading):
    look(bend(length, beside, back=back, heading=heading), feeds)


@pytest.mark.parametrize("falls", [False, True])
@pytest.mark.parametrize("degrees", [0, 42, 90, 137, 180])
@pytest.mark.parametrize("length", [2.5e-3, 4e-3, 5e-3, 7.5e-3])
def test_hops_of_slicers_are_pairs(degrees, length, falls):
    feeds = (0.06, 0.06, 0.03) if falls else (0.03, 0.06, 0.06)
    assert look(hop(degrees, length, falls=falls), feeds)


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("length", [2e-3, 5e-3, 8e-3])
def test_ends_of_lines_of_infill_are_pairs(length, back):
    assert look(bend(length, back=back, heading=45.0), (0.05, 0.05, 0.05))


@given(TURN, SHORT, LONG, FEEDS, st.booleans())
@settings(max_examples=60, deadline=None)
def test_the_path_joins_its_straights_in_place_and_direction(degrees, length, beside, feeds, falls):
    points = hop(degrees, length, beside, falls=falls)
    path = path_of(points, feeds)
    borders = path.start[1:]
    below, above = path.at(borders - 1e-11), path.at(borders + 1e-11)
    assert norm(below[1] - above[1]).max() < 1e-9
    way = [rows[2] / norm(rows[2])[:, None] for rows in (below, above)]
    assert norm(way[0] - way[1]).max() < 1e-5
    assert path.at(np.array([0.0, path.end]))[1] == pytest.approx(points[[0, -1]], abs=1e-12)


def test_a_pair_the_other_way_round_is_the_same_backwards():
    feeds = (0.03, 0.06, 0.05)
    up, down = (
        path_of(hop(60, 3e-3, falls=falls), feeds[::step]) for falls, step in ((False, 1), (True, -1))
    )
    assert is_pair(up)
    assert down.end == pytest.approx(up.end, abs=1e-12)
    s = np.linspace(0.0, up.end, 2000)
    assert up.at(s)[1] == pytest.approx(down.at(down.end - s)[1], abs=1e-9)


@pytest.mark.parametrize(
    ("degrees", "gain"), [(0, 10e-3), (42, 15e-3), (90, 30e-3), (138, 35e-3), (180, 30e-3)]
)
def test_a_pair_is_sooner_than_two_corners(degrees, gain, monkeypatch):
    points, feeds = hop(degrees, 2.5e-3), np.array([0.03, 0.06, 0.06])
    together = duration(points, feeds)
    monkeypatch.setattr(paired, "passed", lambda pairs: Ways.none(len(pairs.length)))
    assert duration(points, feeds) - together > gain


def test_what_is_no_pair_is_none():
    """Obtuse or acute, too far apart, leading below on both sides, or with another corner near."""
    feeds, slanted = (0.04, 0.05, 0.05), hop(40, 4e-3)
    assert is_pair(path_of(slanted, feeds))
    slanted[2:] += [0.5e-3, 0, 0]
    assert not is_pair(path_of(slanted, feeds))
    assert not is_pair(path_of(hop(40, 30e-3), feeds))
    assert not is_pair(path_of(-hop(40, 4e-3)[::-1][:, [2, 1, 0]], feeds))
    row = np.array([[0, 0, 0], [40, 0, 0], [40, 4, 0], [36, 4, 0], [36, 8, 0], [80, 8, 0]]) * 1e-3
    path = path_of(row, [0.05] * 5)
    shaped = np.flatnonzero(path.gear[0])
    shapes = np.split(shaped, np.flatnonzero(np.diff(shaped) > 1) + 1)
    assert [len(set(path.segment[each])) for each in shapes] == [2] * 4


def test_a_change_of_feed_between_both_corners_leaves_them_alone():
    points = np.insert(hop(60, 4e-3), 2, [0.04, 0, 2e-3], axis=0)
    assert is_pair(path_of(points, (0.03, 0.05, 0.05, 0.05)))
    assert not is_pair(path_of(points, (0.03, 0.05, 0.02, 0.05)))


def test_the_tables_own_shapes_keep_the_limits():
    for rows in (table().floor, table().flat):
        assert np.isfinite(rows).all()
        assert norm(rows[..., 4:].reshape(-1, 3)).max() <= 1.001


@pytest.mark.parametrize("rises", [False, True])
def test_what_is_between_the_tables_own_shapes_needs_little_slowing_down(rises):
    """Jerk or acceleration is at its limit or nearly, and the nozzle begins nearly at its feed."""
    rng, count = np.random.default_rng(3), 300
    angle = rng.uniform(0, np.pi, count) if rises else np.pi * rng.integers(2, size=count)
    one, none = np.ones(count), np.zeros(count)
    direction = np.array([[one, none, none], [none, none, one], [np.cos(angle), np.sin(angle), none]])
    feed = np.stack((rng.uniform(4e-3, 0.1, count), 1.0 * one, rng.uniform(4e-3, 0.1, count)))
    limits, floor = np.stack((A * one, J * one)), np.full(count, rises)
    length, room = rng.uniform(2e-3, 10e-3, count), np.ones((2, count))
    ways = passed(Pairs(direction, length, room, feed, limits, H / 3 * one, floor, np.zeros_like(floor)))
    assert np.isfinite(ways.duration).all()
    assert np.median(ways.speed / feed[[0, 2]]) > 0.985
    assert np.quantile(ways.speed / feed[[0, 2]], 0.05) > 0.9
    assert (ways.speed <= feed[[0, 2]] * (1 + 1e-9)).all()
