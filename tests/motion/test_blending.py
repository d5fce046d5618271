"""G61, G64: exact stops, tolerances, and the way back to the profile's."""

import copy

import numpy as np
import pytest
from motion_tracks import PERIOD, differences, distance_to, joined, moves, norm

from cdhr_host.motion.limits import CHORD_ERROR
from cdhr_host.motion.planner import Planner, all_tracks
from cdhr_host.motion.sampling import Timeline
from cdhr_host.values import Arc, Blend, Plane, Spline

CORNERS = np.array([[0, 0, 0], [20, 0, 0], [20, 20, 0], [20, 20, 5], [0, 20, 5]]) * 1e-3
STRAIGHT_ON = np.array([[0, 0, 0], [10, 0, 0], [20, 0, 0]]) * 1e-3
EXACT = Blend(1, None, True)
USUAL = Blend(1, None, False)


def within(tolerance):
    return Blend(1, tolerance, False)


def deviation(track, points):
    """m: from the drawn path, and from its farthest corner to the track."""
    return distance_to(track.position_G, points).max(), distance_to(points, track.position_G).max()


def stops(track):
    """(K, 3) m: where the nozzle stands still between its start and its end."""
    still = norm(track.velocity) < 2e-4
    runs = np.flatnonzero(np.diff(still.astype(int)) == 1) + 1
    return track.position_G[runs[:-1]]


def test_exact_stops_reach_every_corner(run, limits):
    track = run([EXACT, moves(CORNERS, 0.04)])
    assert len(stops(track)) == len(CORNERS) - 2
    assert max(deviation(track, CORNERS)) < 1e-7
    _, acceleration, jerk = differences(track)
    assert acceleration <= limits.acceleration * 1.001
    assert jerk <= limits.jerk * 1.001


def test_exact_stops_are_at_every_end_of_a_move_but_not_inside_a_curve(run):
    arc = Arc(2, CORNERS[0], np.array([0.02, 0, 0]), np.array([0.01, 0]), np.pi, 0.03, 0.0, 0.0, Plane.XY)
    ahead = np.array([[20, 0, 0], [20, 10, 0], [30, 10, 0], [30, 20, 0]]) * 1e-3
    curve = Spline(3, ahead, 0.03, 0.0, 0.0)
    track = run([EXACT, arc, curve, moves([ahead[-1], ahead[-1] + [0, 0.01, 0]], 0.03, line=[4])])
    assert stops(track) == pytest.approx(np.array([arc.end_G, ahead[-1]]), abs=5e-6)
    assert len(stops(run([EXACT, moves(STRAIGHT_ON, 0.03)]))) == 1
    assert len(stops(run([moves(STRAIGHT_ON, 0.03)]))) == 0


def test_exact_stops_do_not_depend_on_how_moves_are_batched(run):
    whole = run([EXACT, moves(CORNERS, 0.04)])
    parts = [moves(CORNERS[k : k + 2], 0.04, line=[k + 1]) for k in range(len(CORNERS) - 1)]
    assert np.array_equal(run([EXACT, *parts]).position_G, whole.position_G)


@pytest.mark.parametrize("tolerance", [1e-5, 5e-5, 1e-3, 4e-3])
def test_corners_are_taken_within_the_tolerance(tolerance, run, limits):
    track = run([within(tolerance), moves(CORNERS, 0.04)], period=PERIOD / 4)
    off, cut = deviation(track, CORNERS)
    assert off <= tolerance
    assert cut <= tolerance
    assert max(off, cut) > 0.4 * tolerance
    assert norm(track.velocity)[5:-5].min() > 0.0


def test_a_wider_tolerance_is_faster(run):
    lasting = [len(run([within(tolerance), moves(CORNERS, 0.05)]).tick) for tolerance in (2.5e-4, 5e-4, 2e-3)]
    exact = len(run([EXACT, moves(CORNERS, 0.05)]).tick)
    assert exact > lasting[0] > lasting[1] > lasting[2]


def test_blending_changes_at_rest_and_comes_back(run, limits):
    there = CORNERS + np.array([0, 0, 0.01])
    way = [
        moves(CORNERS, 0.04),
        moves(np.array([CORNERS[-1], there[0], *there[1:]]), 0.04, line=range(11, 16)),
    ]
    track = run([way[0], within(1e-3), way[1]])
    assert CORNERS[-1] == pytest.approx(stops(track)[0], abs=1e-6)
    before = track.line <= 4
    usual = run([way[0]])
    assert np.allclose(track.position_G[before][:800], usual.position_G[:800][: before.sum()], atol=1e-9)
    back = run([EXACT, within(1e-3), USUAL, way[0]])
    assert np.array_equal(back.position_G, usual.position_G)


def test_the_same_again_stops_nothing(run, limits):
    halves = [moves(STRAIGHT_ON[:2], 0.03), moves(STRAIGHT_ON[1:], 0.03, line=[2])]
    same = within(limits.half_width / 3 + CHORD_ERROR)
    assert len(stops(run([halves[0], USUAL, halves[1]]))) == 0
    assert len(stops(run([within(1e-3), halves[0], within(1e-3), halves[1]]))) == 0
    assert len(stops(run([halves[0], same, halves[1]]))) <= 1


def test_curves_follow_the_tolerance(run):
    arc = Arc(2, np.array([2e-3, 0, 0]), np.array([2e-3, 0, 0]), np.zeros(2), 2 * np.pi, 0.01, 0.0, 0.0)
    shrunk = []
    for tolerance in (2e-5, 1e-3):
        radius = norm(run([within(tolerance), arc], start=arc.start_G).position_G)
        assert np.abs(radius - 2e-3).max() <= tolerance
        shrunk.append(np.abs(radius - 2e-3).max())
    assert shrunk[0] < 2e-6 < 1e-4 < shrunk[1]


def test_the_widest_tolerance_keeps_the_limits(run, limits):
    points = np.cumsum(np.random.default_rng(8).normal(size=(60, 3)) * 0.02, axis=0)
    track = run([within(0.05), moves(points, 0.1)], start=points[0])
    _, acceleration, jerk = differences(track)
    assert acceleration <= limits.acceleration * 1.001
    assert jerk <= limits.jerk * 1.001
    assert distance_to(track.position_G, points).max() <= 0.05
    assert np.allclose(track.position_G[-1], points[-1], atol=1e-9)


@pytest.mark.parametrize("mode", [EXACT, within(1e-3), USUAL])
def test_a_planner_moved_elsewhere_takes_corners_as_before(mode, limits):
    planner = Planner(limits, np.zeros(3))
    list(planner.stretches(mode))
    list(planner.stretches(moves(CORNERS + 0.1)))
    moved, copied = planner.moved_to(np.zeros(3)), copy.deepcopy(planner)
    fresh = Planner(limits, np.zeros(3))
    found, wanted = (
        joined(list(all_tracks(each, Timeline(PERIOD), [*first, moves(CORNERS, 0.04)])))
        for each, first in ((moved, []), (fresh, [mode]))
    )
    assert np.array_equal(found.position_G, wanted.position_G)
    assert copied._exact == mode.exact
