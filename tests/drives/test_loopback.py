"""The simulated far side: faults, underruns, stops at any moment."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from trajectories import (
    PAPER,
    PERIOD,
    changed,
    cut,
    distance_from_curve,
    loopback,
    run_of,
    setpoints,
    sliders,
    wave,
    within_limits,
)

from cdhr_host.drives import LinkState, Loopback, MonotonicClock
from cdhr_host.drives.rows import joined
from cdhr_host.errors import DriveError
from cdhr_host.plant.disturbances import Slipped, Stuck

ZERO = np.zeros(6)
DEEP = 40.0
"""speed of a clock for which the buffer holds a whole run"""
ENDS = (LinkState.STOPPED, LinkState.FAULT)


def _run(link, clock, rows, breath=0.1):
    """Feed rows and collect until the drives refuse or have executed all; feedback and fault."""
    link.arm(ZERO)
    parts = []
    try:
        while len(rows) or link.buffered:
            if len(rows):
                rows = rows[link.feed(rows) :]
            clock.wait_until(clock.now() + breath)
            parts.append(link.feedback())
    except DriveError as fault:
        return parts, fault
    return parts, None


def _to_rest(link, clock, parts):
    while link.state not in ENDS:
        clock.wait_until(clock.now() + 0.1)
        parts.append(link.feedback())
    return joined([*parts, link.feedback()])


def _dense(rows):
    """The planned slider curve, ten samples a tick, from its closed form."""
    t = np.arange(0, len(rows) - 1, 0.1) * PERIOD
    size = np.arange(len(rows)) * PERIOD
    raw = wave(size, (len(rows) - 2) * PERIOD, 2, 0.1)
    share = within_limits(raw)[400, 0] / raw[400, 0]
    return sliders(share * wave(t, (len(rows) - 2) * PERIOD, 2, 0.1))


@pytest.mark.parametrize("breath", [PERIOD, 0.1, 0.37])
def test_stuck_slider_trips_at_the_right_tick_and_stops_on_the_path(breath):
    rows = run_of(3000, seed=2)
    stuck = 900
    link, clock = loopback(disturbance=Stuck(2, stuck))
    parts, fault = _run(link, clock, rows, breath)
    window = PAPER.drives.following_error_max
    feedback = _to_rest(link, clock, parts)
    away = np.abs(feedback.slider - feedback.setpoint)
    trip = int(np.flatnonzero((away > window).any(axis=1))[0])
    held = feedback.slider[stuck - 1, 2]
    assert trip == stuck + int(np.flatnonzero(np.abs(rows.slider[stuck:, 2] - held) > window)[0])
    problem = fault.problems[0]
    assert f"slider 3 is {away[trip, 2] * 1e3:.3f} mm" in problem.message
    assert f"at tick {trip} (limit 1 mm)" in problem.message
    assert (problem.kind, problem.line) == ("following-error", rows.line[trip])
    assert link.state is LinkState.FAULT
    assert link.stop_tick == trip + 1
    assert (feedback.setpoint[: trip + 1] == rows.slider[: trip + 1]).all()
    stop = slice(trip + 1, None)
    assert distance_from_curve(feedback.setpoint[stop], _dense(rows)).max() < 1e-8
    free = [0, 1, 3, 4, 5]
    assert np.abs(feedback.slider[stop][:, free] - feedback.setpoint[stop][:, free]).max() < 1e-4
    assert (feedback.setpoint[-1] == feedback.setpoint[-2]).all()
    decay = np.exp(-PERIOD / PAPER.drives.regulator_lag)
    pressures = feedback.pressure[trip:]
    assert pressures[1:] == pytest.approx(pressures[:-1] * decay)


def test_fault_is_raised_once_then_feed_refuses_and_arming_needs_closing():
    link, clock = loopback(disturbance=Stuck(0, 300))
    rows = run_of(3000)
    parts, fault = _run(link, clock, rows)
    assert fault is not None
    assert link.state is LinkState.STOPPING
    with pytest.raises(DriveError, match="the drives are stopping"):
        link.feed(rows)
    _to_rest(link, clock, parts)
    for call in (lambda: link.feed(rows), lambda: link.arm(ZERO)):
        with pytest.raises(DriveError, match="slider 1 is"):
            call()
    link.stop()
    assert link.state is LinkState.FAULT
    link.close()
    link.open()
    assert link.state is LinkState.OPEN


def test_slip_trips_in_its_own_tick():
    link, clock = loopback(disturbance=Slipped(5, 777, -2e-3))
    parts, fault = _run(link, clock, run_of(3000))
    assert "slider 6 is 2.00" in fault.problems[0].message
    assert "at tick 777 " in fault.problems[0].message
    assert link.stop_tick == 778
    assert _to_rest(link, clock, parts).tick[-1] > 778


def test_overload_trips_with_motor_and_limit():
    rows = run_of(1000)
    tension = rows.tension.copy()
    tension[400:, 3] = 2000.0
    link, clock = loopback()
    parts, fault = _run(link, clock, changed(rows, tension=tension))
    assert fault.problems[0].kind == "torque"
    assert "motor 4 needs 1.41" in fault.problems[0].message
    assert "at tick 400 (limit 1.27 N m)" in fault.problems[0].message
    _to_rest(link, clock, parts)
    assert link.state is LinkState.FAULT


def test_fault_in_the_very_last_row():
    link, clock = loopback(disturbance=Slipped(1, 199, 2e-3))
    _, fault = _run(link, clock, run_of(200))
    assert "at tick 199 " in fault.problems[0].message
    assert link.state is LinkState.FAULT
    assert link.stop_tick is None


def test_fault_while_stopping_ends_in_fault():
    link, clock = loopback(DEEP, Slipped(1, 610, 2e-3))
    rows = run_of(3000)
    link.arm(ZERO)
    link.feed(rows)
    clock.wait_until(clock.now() + 600.5 * PERIOD)
    link.stop()
    assert link.stop_tick == 600
    clock.wait_until(clock.now() + 2.0)
    with pytest.raises(DriveError, match="at tick 610"):
        link.feedback()
    assert link.state is LinkState.FAULT
    feedback = link.feedback()
    assert (feedback.setpoint[-1] == feedback.setpoint[-2]).all()


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 2900), st.integers(0, 50))
def test_stop_at_any_moment_stays_on_the_path_within_the_limits(moment, seed):
    rows = run_of(3000, seed=seed)
    link, clock = loopback(DEEP)
    link.arm(ZERO)
    link.feed(rows)
    clock.wait_until(clock.now() + (moment + 0.5) * PERIOD)
    link.stop()
    feedback = _to_rest(link, clock, [link.feedback()])
    assert link.state is LinkState.STOPPED
    acceleration = np.diff(feedback.setpoint, 2, axis=0) / PERIOD**2
    assert np.abs(acceleration).max() <= 1.01 * PAPER.sliders.acceleration_max
    near = rows.slider[max(moment - 5, 0) : moment + 260]
    chord = np.abs(np.diff(near, 2, axis=0)).max()
    assert distance_from_curve(feedback.setpoint[moment:], near).max() < 1e-9 + chord
    assert np.abs(feedback.slider - feedback.setpoint).max() < 1e-4
    assert (feedback.setpoint[-1] == feedback.setpoint[-2]).all()


def test_underrun_stops_on_the_path_with_the_reserve():
    rows = run_of(3000, seed=2)
    link, clock = loopback()
    parts, fault = _run(link, clock, rows[:1500])
    problem = fault.problems[0]
    assert problem.kind == "underrun"
    assert f"tick {link.stop_tick}" in problem.message
    feedback = _to_rest(link, clock, parts)
    assert link.state is LinkState.FAULT
    assert 1000 < link.stop_tick < 1500
    assert distance_from_curve(feedback.setpoint[link.stop_tick :], _dense(rows)).max() < 1e-8
    assert (feedback.setpoint[-1] == feedback.setpoint[-2]).all()


def test_dry_at_rest_waits_but_not_with_the_air_on():
    link, clock = loopback()
    link.arm(ZERO)
    still = setpoints(np.zeros((400, 3)))
    link.feed(still[:5])
    clock.wait_until(10.0)
    assert len(link.feedback()) == 5
    assert link.state is LinkState.RUNNING
    link.feed(still[5:395])
    clock.wait_until(20.0)
    with pytest.raises(DriveError, match="no setpoints in time"):
        link.feedback()
    clock.wait_until(30.0)
    feedback = link.feedback()
    assert link.state is LinkState.FAULT
    assert feedback.pressure[-1] < feedback.pressure.max()


def test_short_first_batch_in_motion_waits_for_more():
    link, clock = loopback()
    link.arm(ZERO)
    rows = run_of(3000)
    link.feed(rows[:60])
    clock.wait_until(5.0)
    assert len(link.feedback()) == 0
    assert link.state is LinkState.ARMED


def test_what_is_executed_does_not_depend_on_when_the_host_looks():
    rows = run_of(2500, seed=7)
    runs = []
    for breath in (PERIOD, 0.09, 1.3):
        link, clock = loopback(DEEP)
        parts, fault = _run(link, clock, rows, breath)
        assert fault is None
        runs.append(joined(parts))
    for name in ("tick", "setpoint", "slider", "counts", "torque", "pressure"):
        assert (getattr(runs[0], name) == getattr(runs[1], name)).all()
        assert (getattr(runs[0], name) == getattr(runs[2], name)).all()


def test_pressure_vents_while_it_is_not_armed():
    link, clock = loopback(DEEP)
    link.arm(ZERO)
    link.feed(run_of(1000))
    clock.wait_until(500 * PERIOD)
    link.stop()
    end = _to_rest(link, clock, [])
    clock.wait_until(clock.now() + 10.0)
    where = end.setpoint[-1]
    link.arm(where)
    link.feed(changed(setpoints(np.zeros((30, 3)), pressure=0.0), slider=np.tile(where, (30, 1))))
    clock.wait_until(clock.now() + 1.0)
    assert link.feedback().pressure.max() < 1e-6


def test_buffer_grows_with_the_speed_of_the_clock_within_bounds():
    sizes = []
    for speed in (1.0, 20.0, float("inf")):
        link, _ = loopback(speed)
        link.arm(ZERO)
        sizes.append(link.free)
    reserve = sizes[0] - 125
    assert [size - reserve for size in sizes] == [125, 2500, 20_000]


def test_real_clock_drives_the_loopback():
    link = Loopback(PAPER, MonotonicClock(speed=200.0))
    link.open()
    link.arm(ZERO)
    for batch in cut(run_of(300), [300]):
        link.feed(batch)
    seen = 0
    while link.buffered:
        seen += len(link.feedback())
    assert seen + len(link.feedback()) == 300
    link.close()
