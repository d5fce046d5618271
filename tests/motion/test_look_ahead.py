"""Closed forms against ruckig and against each other."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdhr_host.errors import MotionError
from cdhr_host.motion.cells import Cells
from cdhr_host.motion.choice import chosen
from cdhr_host.motion.look_ahead import border_speeds, change_distance, inside, needed, reachable, stoppable
from cdhr_host.motion.speed_change import speed_change
from cdhr_host.motion.time_law import time_law

SPEED = st.floats(1e-4, 0.3)


def distance(v0, v1, a, j):
    return float(change_distance(np.array([v0]), np.array([v1]), np.array([a]), np.array([j]))[0])


def cells(length, speed, a, j, gear=None):
    """Cells with one way each, or M where the limits are given as (M, K)."""
    length = np.asarray(length, float)
    start = np.concatenate(([0.0], np.cumsum(length)[:-1]))
    bent = np.zeros(len(length), bool)
    limits = [np.atleast_1d(np.asarray(x, float)) for x in (speed, a, j)]
    ways = max(x.shape[0] if x.ndim == 2 else 1 for x in limits)
    columns = (np.broadcast_to(x, (ways, len(length))) for x in limits)
    gear = np.ones((2, len(length))) if gear is None else np.asarray(gear, float)
    apart = np.full(len(length), -1)
    return Cells(start, length, *columns, float(length.sum()), bent, gear, apart)


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
    assert (speeds[:-1] <= speed).all()
    assert (speeds[1:] <= speed).all()
    one, peaks = chosen(found, speeds)
    assert (peaks <= speed * (1 + 1e-12)).all()
    assert (driven(one, speeds, peaks) <= found.length * (1 + 1e-9)).all()


def driven(one, speeds, peaks):
    """(K,) m: way up to the peaks and down again in cells with one way each."""
    a, j = one.acceleration[0], one.jerk[0]
    return change_distance(speeds[:-1], peaks, a, j) + change_distance(peaks, speeds[1:], a, j)


WAYS = np.array([0.9, 0.5, 0.2, 0.03])
"""Shares of the limits, and the faster the less is left for changing speed."""


@given(st.lists(st.tuples(st.floats(1e-4, 0.05), SPEED), min_size=1, max_size=20))
def test_of_several_ways_one_is_driven(rows):
    length, speed = (np.array(column) for column in zip(*rows, strict=True))
    speeds = np.multiply.outer(np.sqrt(1 - WAYS**2), speed)
    a = np.multiply.outer(WAYS, np.full(len(speed), 0.5))
    found = cells(length, speeds, a, 10 * a)
    borders, forward = border_speeds(found, 0.0, 0.0)
    assert (borders <= forward).all()
    one, peaks = chosen(found, borders)
    assert (driven(one, borders, peaks) <= found.length * (1 + 1e-9) + 1e-12).all()
    assert (peaks <= one.speed[0] * (1 + 1e-12)).all()
    assert (np.maximum(borders[:-1], borders[1:]) <= one.speed[0]).all()


def test_a_long_bend_is_entered_slowly_and_run_through_fast():
    # A quarter of the limits goes to changing speed first, next to nothing of them in the middle.
    speeds = np.multiply.outer(np.sqrt(1 - WAYS**2), np.full(7, 0.07))
    a = np.multiply.outer(WAYS, np.full(7, 0.5))
    found = cells(np.full(7, 0.012), speeds, a, 10 * a)
    borders, _ = border_speeds(found, 0.0, 0.0)
    one, peaks = chosen(found, borders)
    assert one.acceleration[0, 0] > one.acceleration[0, 1] > one.acceleration[0, 3] == 0.03 * 0.5
    assert peaks[3] == speeds[-1, 3]
    durations = [time_law(only, border_speeds(only, 0.0, 0.0)[0]).duration for only in each_way(found)]
    assert time_law(found, borders).duration < min(durations)


def each_way(found):
    """The same cells with only one of their ways."""
    for way in range(len(found.speed)):
        limits = found.speed[way], found.acceleration[way], found.jerk[way]
        yield cells(found.length, *limits)


GEAR = st.floats(0.05, 1.0)


@given(st.lists(st.tuples(st.floats(1e-3, 0.05), SPEED, SPEED, GEAR, GEAR), min_size=2, max_size=9))
def test_straights_between_corners_with_gears_can_be_driven(rows):
    """Corners run through at one s', which stands for another speed of the nozzle at either end."""
    length, speed, corner, *gears = (np.array(column) for column in zip(*rows, strict=True))
    a, j, none = 0.5, 5.0, np.zeros(len(rows))
    columns = (length, none + 1e-3), (speed, corner), (none + a, none), (none + j, none)
    rows = [np.column_stack(pair).ravel()[:-1] for pair in columns]
    gear = np.stack([np.column_stack((none + 1, each)).ravel()[:-1] for each in gears])
    found = cells(*rows, gear)
    speeds, forward = border_speeds(found, 0.0, 0.0)
    assert (speeds <= forward * (1 + 1e-12)).all()
    assert (speeds[1:-1] > 0.0).all()
    begin, end = inside(found, speeds)
    assert np.array_equal(begin[1::2], end[1::2])
    assert begin * gear[0] == pytest.approx(speeds[:-1], rel=1e-10)
    assert end * gear[1] == pytest.approx(speeds[1:], rel=1e-10)
    _, peaks = chosen(found, speeds)
    assert (needed((begin, end), peaks, found)[0] <= found.length * (1 + 1e-9) + 1e-12).all()
    assert (peaks <= found.speed[0] * (1 + 1e-9)).all()
    law = time_law(found, speeds)
    after = np.diff(law.t, append=law.duration)
    s, v, change, jerk = law.state
    assert (np.abs(change) <= a * (1 + 1e-6)).all()
    assert (np.abs(jerk) <= j * (1 + 1e-9)).all()
    assert (v > -1e-12).all()
    end = s + after * (v + after * (change / 2 + after * jerk / 6))
    assert np.abs(end - np.append(s[1:], law.end)).max() < 1e-8


def test_what_is_slowed_down_to_through_gears_can_be_stopped_from():
    # Twenty changes from one gear to another must not look slower than what they were, by rounding.
    gear = np.tile([[1.0, 0.3], [1.0, 0.7]], 20)
    found = cells(np.tile([0.05, 1e-3], 20), 0.1, np.tile([0.5, 0.0], 20), np.tile([5.0, 0.0], 20), gear)
    _, forward = border_speeds(found, 0.0, 0.1)
    assert stoppable(found, forward)[:-2].all()


def test_given_entry_and_exit_are_kept():
    speeds, forward = border_speeds(cells([0.1, 0.1], 0.1, 0.5, 5.0), 0.03, 0.0)
    assert speeds[0] == 0.03
    assert speeds[-1] == 0.0
    assert forward[-1] == 0.1


def test_impossible_change_names_its_input():
    with pytest.raises(MotionError, match=r"0\.1 to 0\.2"):
        speed_change(0.1, 0.2, -1.0, 5.0)


def test_a_change_of_speed_for_which_there_is_no_way_is_refused():
    with pytest.raises(MotionError, match="mm more than the path has"):
        time_law(cells([1e-3], 0.1, 0.5, 5.0), np.array([0.1, 0.0]))
