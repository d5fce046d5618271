"""A leg planned in parts, whenever and with whatever feed, has the path it has as a whole."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_tracks import moves

from cdhr_host.motion.leg import FeedOverride
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner

LIMITS = MotionLimits(0.1, 0.5, 5.0, 0.747e-3, math.radians(179))
SAME = 2e-8
"""m: sums along a bend of hundreds of chords differ by rounding"""


def program(rng):
    """Long lines, chords, specks, curves and corners, at several feeds: points (M+1, 3) m, feeds (M,) m/s."""
    points, feeds, heading = [np.zeros(2)], [], 0.0
    for _ in range(rng.integers(4, 12)):
        heading += rng.choice([0.0, rng.uniform(-3, 3), math.pi / 2, rng.uniform(-0.2, 0.2)])
        steps = (
            [rng.uniform(1e-3, 0.06)],
            [rng.choice([1e-4, 3e-4, 1e-3, 2e-3])] * int(rng.integers(2, 60)),
            rng.uniform(1e-5, 3e-3, rng.integers(1, 20)),
        )[rng.integers(3)]
        turn, chance = rng.choice([0, 0.02, 0.05, -0.1, 0.3, math.pi / 2]), rng.choice([0.0, 0.01, 0.3, 2.0])
        feed = rng.choice([0.005, 0.02, 0.03, 0.1, 0.1])
        for step in steps:
            points.append(points[-1] + step * np.array([math.cos(heading), math.sin(heading)]))
            feeds.append(feed)
            heading += turn + chance * rng.normal()
    return np.column_stack((points, np.zeros(len(points)))), np.array(feeds)


def sidesteps(rng):
    """Long lines and chords, and between them sharp corners at a few mm, some of them at another feed."""
    points, feeds, heading = [np.zeros(2)], [], 0.0
    for _ in range(rng.integers(4, 12)):
        size = rng.choice([1e-4, 3e-4, 1e-3, 3e-3])
        chords = [(rng.choice([2e-3, 7e-3]), rng.uniform(-0.1, 0.1)) for _ in range(rng.integers(1, 8))]
        corners = [(size * rng.uniform(0.3, 1.5), rng.uniform(-3.1, 3.1)) for _ in range(rng.integers(1, 9))]
        feed = rng.choice([0.02, 0.03, 0.1, 0.1])
        for step, turn in [(rng.uniform(1e-3, 0.06), rng.uniform(-3, 3)), *chords, *corners]:
            points.append(points[-1] + step * np.array([math.cos(heading), math.sin(heading)]))
            feeds.append(feed if rng.uniform() < 0.9 else 0.06)
            heading += turn
    return np.column_stack((points, np.zeros(len(points)))), np.array(feeds)


def hops(rng):
    """Lines between right angles, up, down or to the side, at a few mm or far apart, at several feeds."""
    points, feeds, heading, high = [np.zeros(3)], [], 0.0, False
    for _ in range(rng.integers(4, 16)):
        heading += rng.choice([0.0, math.pi / 2, math.pi, rng.uniform(-3, 3)])
        ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
        side = np.array([-ahead[1], ahead[0], 0.0])
        lift = np.array([0.0, 0.0, -1.0 if high else 1.0])
        high ^= bool(rng.uniform() < 0.6)
        between = lift if (lift[2] < 0) != high else side
        for way, length in (
            (ahead, rng.uniform(3e-3, 0.06)),
            (between, rng.choice([1e-3, 2.5e-3, 6e-3, 0.02])),
        ):
            points.append(points[-1] + length * way)
            feeds.append(rng.choice([0.02, 0.03, 0.06, 0.1]))
        heading += rng.choice([0.0, math.pi]) if between is side else 0.0
    return np.array(points), np.array(feeds)


def planned(points, feeds, size, factor=1.0):
    """Stretches, planned after every ``size`` moves with all feeds times a factor."""
    planner = Planner(LIMITS, points[0]).fork(FeedOverride(factor))
    found = []
    for k in range(0, len(feeds), size):
        part = feeds[k : k + size]
        found += planner.stretches(moves(points[k : k + size + 1], part, line=np.arange(len(part)) + k))
        found += planner.advance()
    return [*found, *planner.close()]


def path_of(legs, number, count=2000):
    """Places of a drawn leg and its length: (count, 3) m, m."""
    legs = [leg for leg in legs if leg.number == number]
    end = legs[-1].law.end + legs[-1].passed
    s = np.linspace(0.0, end * (1 - 1e-9), count)
    begins = np.array([leg.law.state[0, 0] + leg.passed for leg in legs])
    which = np.searchsorted(begins, s, side="right") - 1
    parts = [leg.path.at(s[which == k] - leg.passed)[1] for k, leg in enumerate(legs)]
    return np.concatenate(parts), end


@settings(max_examples=15, deadline=None)
@given(
    st.sampled_from([program, sidesteps, hops]),
    st.integers(0, 10**6),
    st.sampled_from([(1, 1.0), (2, 3.0), (7, 1.7)]),
)
def test_the_path_does_not_depend_on_when_it_is_planned_nor_on_the_override(drawn, seed, how):
    points, feeds = drawn(np.random.default_rng(seed))
    whole, parts = planned(points, feeds, 10**6), planned(points, feeds, *how)
    assert {leg.number for leg in parts} == {leg.number for leg in whole}
    for number in {leg.number for leg in whole}:
        (expected, end), (found, length) = path_of(whole, number), path_of(parts, number)
        assert length == pytest.approx(end, abs=1e-10)
        assert np.abs(found - expected).max() < SAME


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([(1, 1.0), (3, 2.0)]))
def test_stretches_join_in_place_speed_and_acceleration(seed, how):
    legs = planned(*program(np.random.default_rng(seed)), *how)
    for leg, following in pairwise(legs):
        if leg.number == following.number:
            before, after = state(leg, leg.duration - 1e-9), state(following, 1e-9)
            assert np.abs(before - after).max(axis=1) == pytest.approx(0.0, abs=1e-7)


def state(leg, t):
    """(3, 3): place, velocity and acceleration at a time."""
    s, speed, change = leg.law.at(np.array([t]))
    _, place, slope, bend = leg.path.at(s)
    return np.concatenate((place, slope * speed, bend * speed**2 + slope * change))
