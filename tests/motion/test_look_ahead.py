"""Closed forms against ruckig and against each other."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdhr_host.errors import MotionError
from cdhr_host.motion.cells import Cells
from cdhr_host.motion.look_ahead import (
    _below_peak,
    border_speeds,
    change_distance,
    end,
    ends,
    needed,
    peak_speeds,
    reachable,
)
from cdhr_host.motion.speed_change import speed_change
from cdhr_host.motion.time_law import time_law

SPEED = st.floats(1e-4, 0.3)


def distance(v0, v1, a, j):
    return float(change_distance(np.array([v0]), np.array([v1]), np.array([a]), np.array([j]))[0])


def cells(length, speed, a, j, pulls=None):
    length = np.asarray(length, float)
    start = np.concatenate(([0.0], np.cumsum(length)[:-1]))
    bent = np.zeros(len(length), bool)
    columns = (np.broadcast_to(np.asarray(x, float), len(length)) for x in (speed, a, j))
    pulls = np.zeros((2, len(length))) if pulls is None else np.asarray(pulls, float)
    return Cells(start, length, *columns, float(length.sum()), bent, pulls)


@given(SPEED, SPEED)
def test_closed_form_distance_is_ruckigs(v0, v1):
    durations, jerks = speed_change(v0, v1, 0.5, 5.0)
    s, v, a = 0.0, v0, 0.0
    for t, j in zip(durations, jerks, strict=True):
        s, v, a = s + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t
    assert s == pytest.approx(distance(v0, v1, 0.5, 5.0), rel=1e-9, abs=1e-12)
    assert v == pytest.approx(v1, rel=1e-9)


@given(SPEED | st.just(0.0), st.floats(1e-6, 1.0), st.floats(0.01, 5.0), st.floats(0.1, 50.0))
def test_reachable_speed_needs_exactly_the_length(v0, length, a, j):
    reached = reachable(v0, length, a, j)
    assert reached > v0
    assert distance(v0, reached, a, j) == pytest.approx(length, rel=1e-6, abs=1e-9)


def test_without_acceleration_the_speed_stays():
    assert reachable(0.02, 0.1, 0.0, 0.0) == 0.02
    assert reachable(0.02, 0.0, 0.5, 5.0) == 0.02
    assert math.isinf(distance(0.02, 0.03, 0.0, 0.0))
    assert distance(0.02, 0.02, 0.0, 0.0) == 0.0


@given(
    st.lists(
        st.tuples(st.floats(1e-4, 0.05), SPEED, st.sampled_from([0.0, 0.05, 0.5])), min_size=1, max_size=20
    )
)
def test_border_speeds_can_be_driven(rows):
    length, speed, a = (np.array(column) for column in zip(*rows, strict=True))
    # Nothing leaves a rest at constant speed.
    a[[0, -1]] = 0.5
    found = cells(length, speed, a, 10 * a)
    speeds, forward = border_speeds(found, 0.0, 0.0)
    assert (speeds <= forward).all()
    needed = change_distance(speeds[:-1], speeds[1:], found.acceleration, found.jerk)
    assert (needed <= found.length * (1 + 1e-9)).all()
    assert (speeds[:-1] <= speed).all()
    assert (speeds[1:] <= speed).all()
    peaks = peak_speeds(found, ends(found, speeds))
    assert (peaks <= speed * (1 + 1e-12)).all()
    there = change_distance(speeds[:-1], peaks, found.acceleration, found.jerk)
    back = change_distance(peaks, speeds[1:], found.acceleration, found.jerk)
    assert (there + back <= found.length * (1 + 1e-9)).all()


@given(
    st.lists(
        st.tuples(st.floats(1e-3, 0.05), SPEED, st.floats(0, 2e3), st.floats(0, 2e3)), min_size=1, max_size=9
    )
)
def test_straights_between_braked_corners_can_be_driven(rows):
    """Corners of constant speed between straights that must begin or end with s'' = pull s'²."""
    length, speed, before, after = (np.array(column) for column in zip(*rows, strict=True))
    a, j, none = 0.5, 5.0, np.zeros(len(rows))
    corner = np.full(len(rows), 0.03)
    # No pull exceeds the straight's acceleration at the speed the corner allows.
    pulls = np.minimum(np.stack((np.append(0.0, after[:-1]), before)), a / corner**2)
    pulls[1, -1] = 0.0
    columns = (length, none + 1e-3), (speed, corner), (none + a, none), (none + j, none)
    rows = [np.column_stack(pair).ravel()[:-1] for pair in columns]
    found = cells(*rows, [np.column_stack((pull, none)).ravel()[:-1] for pull in pulls])
    speeds, forward = border_speeds(found, 0.0, 0.0)
    both = ends(found, speeds)
    assert (speeds <= forward * (1 + 1e-12)).all()
    assert np.array_equal(speeds[1:-1:2], speeds[2::2])
    assert (speeds[1:-1] > 0.0).all()
    peaks = peak_speeds(found, both)
    assert (needed(both, peaks, found) <= found.length * (1 + 1e-9) + 1e-12).all()
    assert (peaks <= found.speed * (1 + 1e-9)).all()
    assert (np.maximum(both[0].peak, both[1].peak) <= peaks * (1 + 1e-9)).all()
    law = time_law(found, speeds)
    after = np.diff(law.t, append=law.duration)
    s, v, change, jerk = law.state
    assert (np.abs(change) <= a * (1 + 1e-6)).all()
    assert (np.abs(jerk) <= j * (1 + 1e-9)).all()
    assert (v > -1e-12).all()
    end = s + after * (v + after * (change / 2 + after * jerk / 6))
    assert np.abs(end - np.append(s[1:], law.end)).max() < 1e-8


def test_given_entry_and_exit_are_kept():
    speeds, forward = border_speeds(cells([0.1, 0.1], 0.1, 0.5, 5.0), 0.03, 0.0)
    assert speeds[0] == 0.03
    assert speeds[-1] == 0.0
    assert forward[-1] == 0.1


def test_impossible_change_names_its_input():
    with pytest.raises(MotionError, match=r"0\.1 to 0\.2"):
        speed_change(0.1, 0.2, -1.0, 5.0)


@given(st.floats(1e-6, 0.3), st.floats(0.0, 1e9))
def test_an_end_that_leads_to_a_peak_is_found_however_strongly_it_pulls(peak, pull):
    speed = _below_peak(np.array([peak]), np.array([pull]), np.array([5.0]))
    assert end(speed, np.array([pull]), np.array([5.0])).peak[0] == pytest.approx(peak, rel=1e-12)


def test_a_nozzle_all_but_at_rest_in_a_corner_needs_way_to_come_out_of_it():
    # From 1 mm/s with s'' = 0.39 m/s² the speed rises to 16 mm/s, whatever comes then.
    pulls = [[3.5e5, 0.0, 1300.0, 0.0], [0.0, 1300.0, 0.0, 0.0]]
    found = cells([1.4e-3, 1e-3, 4e-3, 5e-3], 0.03, 0.5, 5.0, pulls)
    speeds, _ = border_speeds(found, 1.06e-3, 0.0)
    both = ends(found, speeds)
    assert (needed(both, peak_speeds(found, both), found) <= found.length * (1 + 1e-9)).all()


def test_a_change_of_speed_for_which_there_is_no_way_is_refused():
    with pytest.raises(MotionError, match="mm more than the path has"):
        time_law(cells([1e-3], 0.1, 0.5, 5.0), np.array([0.1, 0.0]))
