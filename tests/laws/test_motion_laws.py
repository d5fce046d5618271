"""Laws of planned motion, over random programs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner, all_tracks
from cdhr_host.motion.sampling import Timeline
from cdhr_host.values import Dwell, Moves

PERIOD = 0.004
ROUNDING = 1e-13
"""m: of positions, where a bend of micrometres is centimetres into its leg"""
LIMITS = MotionLimits(0.1, 0.5, 5.0, half_width=0.74e-3, stop_angle=math.radians(179))
COORDINATE = st.integers(-20_000, 20_000).map(lambda micrometre: micrometre * 1e-6)
STEP = st.one_of(
    st.tuples(COORDINATE, COORDINATE, COORDINATE),
    st.tuples(*[st.integers(-300, 300).map(lambda micrometre: micrometre * 1e-6)] * 3),
    st.tuples(*[st.integers(-2, 2).map(lambda micrometre: micrometre * 1e-6)] * 3),
)
ROW = st.tuples(STEP, st.sampled_from([0.005, 0.02, 0.06, 0.3]), st.sampled_from([0.0, 1e-8]))


def program(rows, dwells):
    """Moves by relative steps, with a dwell before some of them."""
    at = np.zeros(3)
    for n, (step, speed, clay) in enumerate(rows, start=1):
        end = at + step
        if n in dwells:
            yield Dwell(n, 0.01)
        yield Moves(np.array([n]), at, end[None], np.array([speed]), np.array([clay]), np.zeros(1))
        at = end


@settings(max_examples=150, deadline=None)
@given(st.lists(ROW, min_size=1, max_size=30), st.sets(st.integers(1, 30), max_size=3))
def test_limits_hold_and_the_end_is_reached(rows, dwells):
    commands = list(program(rows, dwells))
    tracks = list(all_tracks(Planner(LIMITS, np.zeros(3)), Timeline(PERIOD), commands))
    position = np.concatenate([track.position_G for track in tracks])
    line = np.concatenate([track.line for track in tracks])
    velocity, acceleration, jerk = (
        np.linalg.norm(np.diff(position, n, axis=0), axis=1) / PERIOD**n for n in (1, 2, 3)
    )
    assert acceleration.max(initial=0.0) <= LIMITS.acceleration * 1.001
    assert jerk.max(initial=0.0) <= LIMITS.jerk * 1.001
    feed = np.minimum(np.array([speed for _, speed, _ in rows]), LIMITS.speed)
    allowed = np.maximum(feed[np.maximum(line[1:], 1) - 1], feed[np.maximum(line[:-1], 1) - 1])
    assert (velocity <= allowed * (1 + 1e-9) + ROUNDING / PERIOD).all()
    assert np.abs(position[0]).max() < 1e-12
    end = commands[-1].end_G[0] if isinstance(commands[-1], Moves) else position[-1]
    assert np.abs(position[-1] - end).max() < 1e-11
    assert not tracks[-1].velocity[-1].any()
    assert (np.diff(line) >= 0).all()


@settings(max_examples=60, deadline=None)
@given(st.lists(ROW, min_size=1, max_size=20))
def test_clay_is_laid_in_proportion_to_the_way_travelled(rows):
    density = 12.5e-6
    drawn = [(step, speed, density * math.hypot(*step)) for step, speed, _ in rows]
    period = PERIOD / 8
    tracks = list(all_tracks(Planner(LIMITS, np.zeros(3)), Timeline(period), program(drawn, set())))
    laid = sum(float(track.flow.sum()) for track in tracks) * period
    position = np.concatenate([track.position_G for track in tracks])
    way = float(np.linalg.norm(np.diff(position, axis=0), axis=1).sum())
    assert laid == pytest.approx(density * way, rel=0.01, abs=1e-15)
    assert way <= sum(math.hypot(*step) for step, _, _ in rows) * (1 + 1e-9)
