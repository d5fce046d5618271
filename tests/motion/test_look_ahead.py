"""Closed forms against ruckig and against each other."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdhr_host.errors import MotionError
from cdhr_host.motion.limits import Cells
from cdhr_host.motion.look_ahead import border_speeds, change_distance, peak_speeds, reachable
from cdhr_host.motion.speed_change import speed_change

SPEED = st.floats(1e-4, 0.3)


def distance(v0, v1, a, j):
    return float(change_distance(np.array([v0]), np.array([v1]), np.array([a]), np.array([j]))[0])


def cells(length, speed, a, j):
    length = np.asarray(length, float)
    start = np.concatenate(([0.0], np.cumsum(length)[:-1]))
    bent = np.zeros(len(length), bool)
    columns = (np.broadcast_to(np.asarray(x, float), len(length)) for x in (speed, a, j))
    return Cells(start, length, *columns, float(length.sum()), bent)


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
    found = cells(length, speed, a, 10 * a)
    speeds, forward = border_speeds(found, None, None)
    assert (speeds <= forward).all()
    needed = change_distance(speeds[:-1], speeds[1:], found.acceleration, found.jerk)
    assert (needed <= found.length * (1 + 1e-9)).all()
    assert (speeds[:-1] <= speed).all()
    assert (speeds[1:] <= speed).all()
    peaks = peak_speeds(found, speeds)
    assert (peaks <= speed * (1 + 1e-12)).all()
    there = change_distance(speeds[:-1], peaks, found.acceleration, found.jerk)
    back = change_distance(peaks, speeds[1:], found.acceleration, found.jerk)
    assert (there + back <= found.length * (1 + 1e-9)).all()


def test_given_entry_and_exit_are_kept():
    speeds, forward = border_speeds(cells([0.1, 0.1], 0.1, 0.5, 5.0), 0.03, 0.0)
    assert speeds[0] == 0.03
    assert speeds[-1] == 0.0
    assert forward[-1] == 0.1


def test_impossible_change_names_its_input():
    with pytest.raises(MotionError, match=r"0\.1 to 0\.2"):
        speed_change(0.1, 0.2, -1.0, 5.0)
