import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from trajectories import PAPER, PERIOD, cut, run_of

from cdhr_host.plant.servo import MOVING_MASS, Servo, counts, measured, torque

W = 2 * math.pi * PAPER.drives.servo_bandwidth
ZETA = PAPER.drives.servo_damping
ZERO = np.zeros(6)


def _stepped(servo, rows, sizes):
    state = servo.standing(ZERO, ZERO)
    parts = []
    for batch in cut(rows, sizes):
        state, slider, acceleration = servo.step(state, batch.slider)
        parts.append(np.hstack([slider, acceleration]))
    return np.vstack(parts), state


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(1, 90), min_size=1, max_size=8))
def test_result_does_not_depend_on_the_batches(sizes):
    rows = run_of(300, seed=1)
    servo = Servo(PAPER.drives)
    whole, end = _stepped(servo, rows, [300])
    parts, last = _stepped(servo, rows, sizes)
    assert (whole == parts).all()
    assert (end.memory == last.memory).all()


@pytest.mark.parametrize("damping", [0.4, 1.0, 2.0])
def test_loop_agrees_with_its_differential_equation(damping):
    drives = PAPER.drives.model_copy(update={"servo_damping": damping})
    told = np.array([0.0, 0.3, 0.4, 0.4, 0.1, 0.0, 0.0, 0.0, 0.2, 0.2]) * 1e-3
    servo = Servo(drives)
    _, slider, _ = servo.step(servo.standing(ZERO, ZERO), np.repeat(told[1:, None], 6, axis=1))

    def loop(t, x, k):
        rate = (told[k + 1] - told[k]) / PERIOD
        reference = told[k] + rate * (t - k * PERIOD)
        return [x[1], W * W * (reference - x[0]) + 2 * damping * W * (rate - x[1])]

    x = [0.0, 0.0]
    for k in range(len(told) - 1):
        span = (k * PERIOD, (k + 1) * PERIOD)
        x = solve_ivp(loop, span, x, args=(k,), rtol=1e-10, atol=1e-15, method="DOP853").y[:, -1]
        assert slider[k] == pytest.approx(np.full(6, x[0]), abs=1e-12)


def test_start_of_a_ramp_has_the_closed_form_error():
    speed, n = 0.05, np.arange(1, 60)
    servo = Servo(PAPER.drives)
    told = np.repeat((speed * PERIOD * n)[:, None], 6, axis=1)
    _, slider, _ = servo.step(servo.standing(ZERO, ZERO), told)
    damped = W * math.sqrt(1 - ZETA**2)
    t = n * PERIOD
    error = -speed / damped * np.exp(-ZETA * W * t) * np.sin(damped * t)
    assert slider[:, 3] - told[:, 3] == pytest.approx(error, abs=1e-15)


def test_release_from_a_wrong_place_has_the_closed_form():
    away, n = 1e-4, np.arange(1, 40)
    servo = Servo(PAPER.drives)
    _, slider, _ = servo.step(servo.standing(ZERO, ZERO + away), np.zeros((39, 6)))
    damped = W * math.sqrt(1 - ZETA**2)
    t = n * PERIOD
    free = np.exp(-ZETA * W * t) * (np.cos(damped * t) + ZETA * W / damped * np.sin(damped * t))
    assert slider[:, 0] == pytest.approx(away * free, abs=1e-15)


def test_constant_speed_is_followed_without_error_and_acceleration_with_a_over_w_squared():
    n = np.arange(1, 2000)
    servo = Servo(PAPER.drives)
    told = np.repeat((0.5 * 0.1 * (n * PERIOD) ** 2)[:, None], 6, axis=1)
    _, slider, acceleration = servo.step(servo.standing(ZERO, ZERO), told)
    assert acceleration[50:] == pytest.approx(np.full((1949, 6), 0.1), rel=1e-6)
    lag = (told - slider)[-1]
    assert lag == pytest.approx(np.full(6, 0.1 / W**2), rel=0.1)


def test_counts_are_the_nearest_ones():
    lead, per_turn = 4e-3, 1000
    slider = np.array([[0.0, 4e-3, -4e-3, 5.9e-6, 6.1e-6, -6.1e-6]])
    assert counts(slider, lead, per_turn).tolist() == [[0, 1000, -1000, 1, 2, -2]]
    back = measured(counts(slider, lead, per_turn), lead, per_turn)
    assert np.abs(back - slider).max() <= 0.5 * lead / per_turn


def test_torque_of_a_screw():
    lead, efficiency = 4e-3, 0.9
    held = torque(np.full((1, 6), 10.0), np.zeros((1, 6)), lead, efficiency)
    assert held == pytest.approx(np.full((1, 6), 10.0 * 4e-3 / (2 * math.pi * 0.9)))
    winding_in = torque(np.zeros((1, 6)), np.full((1, 6), -0.5), lead, efficiency)
    assert winding_in == pytest.approx(np.full((1, 6), MOVING_MASS * 0.5 * 4e-3 / (2 * math.pi * 0.9)))
