"""Ramps of the playback rate: smooth, landing where they should, and the motion they make of a plan."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.motion.playback import Beat, Pace, Start, landing, played, ramp
from cdhr_host.values import ToolTrack

RATES = st.floats(0.0, 1.0)


def starts(pace, tick):
    return pace.start(tick), pace.at(np.array([tick], dtype=float))


@settings(max_examples=100, deadline=None)
@given(RATES, RATES, st.integers(4, 600), st.integers(0, 700))
def test_a_ramp_ends_at_its_target_and_u_is_the_integral_of_the_rate(first, target, lasting, when):
    pace = Pace.of(u=3.25, rate=first).then(ramp(Start(100, 3.25 + 100 * first, first), lasting, target))
    t = np.arange(0, 100 + lasting + 50, 0.05)
    beat = pace.at(t)
    summed = beat.u[0] + np.concatenate(([0.0], np.cumsum((beat.rate[1:] + beat.rate[:-1]) / 2) * 0.05))
    assert np.abs(beat.u - summed).max() < 1e-2
    assert beat.rate[t >= 100 + lasting] == pytest.approx(target, abs=1e-12)
    assert (np.diff(beat.u) >= -1e-12).all()
    alone, one = starts(pace, float(when))
    assert (alone.u, alone.rate, alone.slope) == pytest.approx(
        (one.u[0], one.rate[0], one.slope[0]), abs=1e-9
    )


@settings(max_examples=100, deadline=None)
@given(st.floats(0.05, 0.95), st.integers(20, 300), st.integers(1, 299), st.integers(20, 300), RATES)
def test_a_ramp_begun_within_another_continues_rate_slope_and_bend(first, lasting, cut, then, target):
    pace = Pace.of(rate=first).then(ramp(Start(0, 0.0, first), lasting, 0.0))
    at = float(min(cut, lasting - 1))
    turned = pace.then(ramp(pace.start(at), then, target))
    before, after = pace.start(at), turned.start(at)
    assert (after.u, after.rate, after.slope) == pytest.approx(
        (before.u, before.rate, before.slope), abs=1e-12
    )
    assert after.bend == pytest.approx(before.bend, abs=1e-12)
    assert turned.at(np.arange(at)).u.tolist() == pace.at(np.arange(at)).u.tolist()
    assert turned.target == pytest.approx(target, abs=1e-12)


@settings(max_examples=200, deadline=None)
@given(st.floats(0, 1e6), st.floats(0.0, 0.99), st.integers(40, 500), st.integers(0, 10**6))
def test_a_landing_plays_whole_ticks_of_the_plan_afterwards(u, rate, lasting, tick):
    pace = Pace.of(tick=tick, u=u, rate=rate).then(landing(Start(tick, u, rate), lasting, 1.0))
    assert pace.whole(tick + lasting)
    later = pace.at(tick + lasting + np.arange(500.0)).u
    assert (later == np.round(later)).all()
    assert (np.diff(later) == 1.0).all()
    beat = pace.at(tick + np.arange(lasting + 1.0))
    assert beat.rate.max() <= 1.0 + 1e-12
    assert beat.rate.min() >= 0.0 if rate == 0.0 else beat.rate.min() > -1e-9
    assert abs(beat.u[-1] - later[0]) < 1e-5


def test_what_is_over_can_be_forgotten():
    pace = Pace.of().then(ramp(Start(10, 10.0, 1.0), 20, 0.5)).then(ramp(Start(100, 60.0, 0.5), 20, 0.25))
    late = np.arange(105.0, 200.0)
    assert pace.since(105).at(late).u.tolist() == pace.at(late).u.tolist()
    assert len(pace.since(150).ramps) == 1


def test_played_motion_is_what_its_positions_do():
    """Finite differences of x(u(t)) against the velocity and acceleration that ``played`` gives."""
    period, t = 0.004, np.arange(40.0, 260.0, 0.001)
    pace = Pace.of().then(ramp(Start(50, 50.0, 1.0), 150, 0.2))

    def plan(u):
        angle = 0.05 * u[:, None] + np.arange(3)
        rate = 0.05 / period
        position, speed, change = np.sin(angle), rate * np.cos(angle), -(rate**2) * np.sin(angle)
        zero = np.zeros(len(u))
        return ToolTrack(zero.astype(int), zero.astype(int), position, speed, change, 1e-7 + zero, zero)

    beat = pace.at(t)
    track = played(plan(beat.u), beat, period)
    step = 0.001 * period
    velocity = (track.position_G[2:] - track.position_G[:-2]) / (2 * step)
    acceleration = (track.velocity[2:] - track.velocity[:-2]) / (2 * step)
    assert np.abs(track.velocity[1:-1] - velocity).max() < 1e-5
    assert np.abs(track.acceleration[1:-1] - acceleration).max() < 1e-3
    assert track.flow == pytest.approx(1e-7 * beat.rate)
    still = played(plan(np.array([5.0])), Beat(np.array([5.0]), np.zeros(1), np.zeros(1)), period)
    assert not still.velocity.any()
    assert not still.flow.any()
