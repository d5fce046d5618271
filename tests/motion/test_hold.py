"""The path-true stop on random plans within the limits, begun at any moment."""

from dataclasses import fields

import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.motion.hold import ends_at_rest, path_true_stop, rows_needed
from cdhr_host.profile import find, read_table, validate
from cdhr_host.values import Setpoints

PAPER, _ = validate(read_table(find("paper")))
PERIOD = PAPER.drives.period
NEEDED = rows_needed(PAPER)
MIX = np.array(
    [
        [1.0, 0.2, 0.1],
        [-0.5, 0.8, 0.1],
        [-0.5, -0.8, 0.2],
        [0.7, 0, -0.6],
        [-0.3, 0.6, -0.7],
        [-0.4, -0.6, -0.7],
    ]
)


def _rows(nozzle):
    count = len(nozzle)
    tick = 1000 + np.arange(count)
    return Setpoints(
        tick=tick,
        t=tick * PERIOD,
        line=5 + np.arange(count) // 7,
        nozzle_G=nozzle,
        upper=2.0 * nozzle,
        slider=nozzle @ MIX.T,
        tension=8.0 + 10.0 * nozzle @ MIX.T,
        flow=np.full(count, 1e-8),
        pressure=np.full(count, 5e4),
    )


class Waves:
    """A sum of sines in space, scaled to a share of the nozzle's limits; closed form in t."""

    def __init__(self, seed, share):
        rng = np.random.default_rng(seed)
        self._rate = rng.uniform(0.5, 8.0, size=5)
        self._phase = rng.uniform(0.0, 2 * np.pi, size=(5, 3))
        self._size = rng.normal(size=(5, 3)) / self._rate[:, None] ** 2
        limits = PAPER.limits
        bounds = (limits.speed_max, limits.acceleration_max, limits.jerk_max)
        dense = self(np.arange(3000) * PERIOD)
        peaks = [np.linalg.norm(np.diff(dense, k, axis=0), axis=1).max() / PERIOD**k for k in (1, 2, 3)]
        self._size *= share * min(b / p for b, p in zip(bounds, peaks, strict=True))

    def __call__(self, t):
        angle = self._rate[:, None] * np.asarray(t)[:, None, None] + self._phase
        return np.sum(self._size * np.sin(angle), axis=1)


def _polyline(seed, share):
    """Straight jerk-limited moves with exact stops between them, limits saturated to ``share``."""
    rng = np.random.default_rng(seed)
    at, parts = np.zeros(3), []
    for _ in range(6):
        direction = rng.normal(size=3)
        direction *= rng.choice([0.001, 0.005, 0.02, 0.05]) / np.linalg.norm(direction)
        length = float(np.linalg.norm(direction))
        parts.append(at + _profile(length, rng.choice([0.02, 0.05, 0.1]), share)[:, None] * direction)
        at = at + direction
    return np.vstack([*parts, at, at])


def _profile(length, speed, share):
    """Share of the way at each tick of one rest-to-rest move."""
    want = ruckig.InputParameter(1)
    want.target_position, want.max_velocity = [length], [speed]
    want.max_acceleration = [share * PAPER.limits.acceleration_max]
    want.max_jerk = [share * PAPER.limits.jerk_max]
    found = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(want, found)
    times = np.arange(int(np.ceil(found.duration / PERIOD))) * PERIOD
    return np.array([found.at_time(t)[0][0] for t in times]) / length


def _peaks(nozzle, slider):
    """Nozzle acceleration and jerk, slider acceleration, as shares of their limits."""
    limits = PAPER.limits
    second = np.linalg.norm(np.diff(nozzle, 2, axis=0), axis=1).max() / PERIOD**2
    third = np.linalg.norm(np.diff(nozzle, 3, axis=0), axis=1).max() / PERIOD**3
    sliders = np.abs(np.diff(slider, 2, axis=0)).max() / PERIOD**2
    return second / limits.acceleration_max, third / limits.jerk_max, sliders / PAPER.sliders.acceleration_max


def _peaks_with_history(plan, moment, stop):
    nozzle = np.vstack([plan.nozzle_G[max(moment - 3, 0) : moment], stop.nozzle_G])
    slider = np.vstack([plan.slider[max(moment - 3, 0) : moment], stop.slider])
    return _peaks(nozzle, slider) if len(nozzle) > 3 else (0.0, 0.0, 0.0)


def _off_curve(points, curve):
    begin, along = curve[:-1], np.diff(curve, axis=0)
    square = np.maximum(np.sum(along**2, axis=1), 1e-300)
    away = points[:, None, :] - begin
    share = np.clip(np.sum(away * along, axis=2) / square, 0.0, 1.0)
    return np.linalg.norm(away - share[..., None] * along, axis=2).min(axis=1).max()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.2, 0.5, 0.8, 0.9]), st.integers(0, 800))
def test_stop_keeps_the_limits_and_ends_at_rest(seed, share, moment):
    plan = _rows(Waves(seed, share)(np.arange(moment + NEEDED + 5) * PERIOD))
    stop = path_true_stop(plan[moment:], PAPER)
    assert max(_peaks_with_history(plan, moment, stop)) <= 1.015
    assert (stop.slider[-1] == stop.slider[-2]).all()
    assert (stop.nozzle_G[-1] == stop.nozzle_G[-2]).all()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.floats(0, 1))
def test_moves_that_leave_a_tenth_of_the_limits_are_stopped_within_them(seed, where):
    plan = _rows(_polyline(seed, 0.9))
    moment = int(where * (len(plan) - 2))
    stop = path_true_stop(plan[moment:], PAPER)
    assert max(_peaks_with_history(plan, moment, stop)) <= 1.02


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.floats(0, 1))
def test_moves_at_the_limits_are_stopped_near_them(seed, where):
    plan = _rows(_polyline(seed, 1.0))
    moment = int(where * (len(plan) - 2))
    stop = path_true_stop(plan[moment:], PAPER)
    acceleration, jerk, sliders = _peaks_with_history(plan, moment, stop)
    assert max(acceleration, sliders) <= 1.05
    assert jerk <= 1.25


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6))
def test_stop_stays_on_the_planned_curve(seed):
    waves = Waves(seed, 0.9)
    plan = _rows(waves(np.arange(NEEDED) * PERIOD))
    dense = waves(np.arange(0, NEEDED, 0.02) * PERIOD)
    stop = path_true_stop(plan, PAPER)
    assert _off_curve(stop.nozzle_G, dense) < 2e-9
    assert _off_curve(stop.slider, dense @ MIX.T) < 2e-9


def test_columns_stay_together_and_the_air_is_off():
    plan = _rows(Waves(4, 0.9)(np.arange(NEEDED) * PERIOD))
    stop = path_true_stop(plan, PAPER)
    assert (stop.tick == 1000 + np.arange(len(stop))).all()
    assert (stop.t == stop.tick * PERIOD).all()
    assert not stop.pressure.any()
    assert not stop.flow.any()
    assert stop.upper == pytest.approx(2.0 * stop.nozzle_G, abs=1e-15)
    assert stop.tension == pytest.approx(8.0 + 10.0 * stop.slider, abs=1e-12)
    assert set(stop.line) <= set(plan.line)
    assert (np.diff(stop.line) >= 0).all()
    assert (stop.slider[0] == plan.slider[0]).all()


def test_rows_beyond_those_needed_do_not_matter():
    plan = _rows(Waves(5, 0.9)(np.arange(2 * NEEDED) * PERIOD))
    one, other = path_true_stop(plan, PAPER), path_true_stop(plan[:NEEDED], PAPER)
    assert all((getattr(one, field.name) == getattr(other, field.name)).all() for field in fields(one))


def test_straight_cruise_stops_within_the_bound_of_the_docstring():
    nozzle = np.zeros((NEEDED, 3))
    nozzle[:, 0] = 0.05 * PERIOD * np.arange(NEEDED)
    stop = path_true_stop(_rows(nozzle), PAPER)
    bound = max(15 / 8 * 0.05 / 0.5, np.sqrt(10 / np.sqrt(3) * 0.05 / 5.0))
    assert len(stop) * PERIOD <= 1.01 * bound + 3 * PERIOD
    assert stop.nozzle_G[-1, 0] <= 0.05 * (bound / 2 + 2 * PERIOD)


def test_plan_that_rests_before_the_ramp_ends_is_played_to_its_rest():
    nozzle = np.zeros((30, 3))
    nozzle[:, 1] = 1e-4 * (1 - np.cos(np.pi * np.minimum(np.arange(30) / 25, 1.0)))
    stop = path_true_stop(_rows(nozzle), PAPER)
    assert len(stop) <= 60
    assert ends_at_rest(stop.slider, PAPER)


def test_standing_plan_stops_at_once():
    stop = path_true_stop(_rows(np.full((400, 3), 0.01)), PAPER)
    assert len(stop) <= 5
    assert stop.slider == pytest.approx(np.tile(np.full(3, 0.01) @ MIX.T, (len(stop), 1)))


@pytest.mark.parametrize("count", [0, 1])
def test_no_path_ahead(count):
    plan = _rows(np.full((count, 3), 0.01))
    stop = path_true_stop(plan, PAPER)
    assert (stop.slider == plan.slider).all()
    assert not stop.pressure.any()


@pytest.mark.parametrize("count", [2, 3, 20, 40])
def test_too_few_rows_give_the_gentlest_stop_there_is(count):
    nozzle = np.zeros((count, 3))
    nozzle[:, 0] = 0.1 * PERIOD * np.arange(count)
    stop = path_true_stop(_rows(nozzle), PAPER)
    assert (stop.slider[-1] == stop.slider[-2]).all()
    assert stop.nozzle_G[-1, 0] <= nozzle[-1, 0] + 1e-15
    assert stop.nozzle_G[-1, 0] >= 0.9 * nozzle[-1, 0]


def test_rest_is_slow_not_only_equal():
    slow, fast = np.zeros((2, 6)), np.zeros((2, 6))
    slow[1], fast[1] = 0.9e-4 * PERIOD, 1.1e-4 * PERIOD
    assert ends_at_rest(slow, PAPER)
    assert not ends_at_rest(fast, PAPER)
