"""Laws of arcs, curves and blending, over random programs of them."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.motion.curves import bezier, points_on
from cdhr_host.motion.limits import CHORD_ERROR, MotionLimits, half_width
from cdhr_host.motion.planner import Planner, all_tracks
from cdhr_host.motion.sampling import Timeline
from cdhr_host.values import Arc, Blend, Moves, Plane, Spline

PERIOD = 0.004
TOLERANCE = 0.25e-3
LIMITS = MotionLimits(0.1, 0.5, 5.0, half_width=half_width(TOLERANCE), stop_angle=math.radians(179))
LENGTH = st.integers(-15_000, 15_000).map(lambda micrometre: micrometre * 1e-6)
POINT = st.tuples(LENGTH, LENGTH, st.just(0.0)).map(np.array)
SPEED = st.sampled_from([0.01, 0.04, 0.2])
STEP = st.tuples(st.just("line"), POINT, SPEED)
TURN = st.tuples(
    st.just("arc"),
    st.sampled_from(list(Plane)),
    st.integers(5, 8000).map(lambda micrometre: micrometre * 1e-6),
    st.floats(-6.2, 6.2).filter(lambda sweep: abs(sweep) > 1e-3),
    LENGTH,
    SPEED,
)
BEND = st.tuples(st.just("spline"), POINT, POINT, POINT, SPEED)
MODE = st.tuples(st.just("mode"), st.sampled_from([None, 1e-4, 1e-3]), st.booleans())


def drawn(words):
    """Commands one after the other from 0, each with the places it must reach."""
    at = np.zeros(3)
    for line, (kind, *rest) in enumerate(words, 1):
        if kind == "mode":
            yield Blend(line, rest[0], rest[1]), at
            continue
        if kind == "line":
            end = at + rest[0]
            yield Moves(np.array([line]), at, end[None], np.array(rest[1:]), np.zeros(1), np.zeros(1)), end
        elif kind == "arc":
            plane, radius, sweep, rise, speed = rest
            first, second, along = plane.value
            end = at.copy()
            centre = np.array([at[first] - radius, at[second]])
            end[first], end[second] = centre + radius * np.array([math.cos(sweep), math.sin(sweep)])
            end[along] += rise
            yield Arc(line, at, end, centre, sweep, speed, 0.0, 0.0, plane), end
        else:
            end = at + rest[2]
            yield Spline(line, np.array([at, at + rest[0], at + rest[1], end]), rest[3], 0.0, 0.0), end
        at = end


@settings(max_examples=100, deadline=None)
@given(st.lists(st.one_of(STEP, TURN, BEND, MODE), min_size=1, max_size=6))
def test_limits_hold_and_every_exact_stop_is_reached(words):
    program = list(drawn(words))
    tracks = list(all_tracks(Planner(LIMITS, np.zeros(3)), Timeline(PERIOD), [each for each, _ in program]))
    position = np.concatenate([track.position_G for track in tracks])
    line = np.concatenate([track.line for track in tracks])
    velocity, acceleration, jerk = (
        np.linalg.norm(np.diff(position, n, axis=0), axis=1) / PERIOD**n for n in (1, 2, 3)
    )
    assert acceleration.max(initial=0.0) <= LIMITS.acceleration * 1.001
    assert jerk.max(initial=0.0) <= LIMITS.jerk * 1.001
    assert velocity.max(initial=0.0) <= LIMITS.speed * (1 + 1e-9)
    assert np.abs(position[-1] - program[-1][1]).max() < 1e-11
    assert (np.diff(line) >= 0).all()
    exact = False
    for command, end in program:
        exact = command.exact if isinstance(command, Blend) else exact
        if exact and not isinstance(command, Blend):
            assert np.linalg.norm(position - end, axis=1).min() <= LIMITS.jerk * PERIOD**3


def test_a_leg_of_many_chords_is_planned_again_at_the_speed_it_left():
    words = [
        ("mode", 1e-5, False),
        ("arc", Plane.XY, 4.425e-3, 2.953125, 0.0, 0.2),
        ("spline", *(np.array([x, y, 0.0]) * 1e-6 for x, y in ((2, 2), (24, 22), (69, 134))), 0.2),
        ("arc", Plane.XY, 4.45e-3, 3.0, 6.411e-3, 0.01),
    ]
    program = [each for each, _ in drawn(words)]
    assert list(all_tracks(Planner(LIMITS, np.zeros(3)), Timeline(PERIOD), program))


@settings(max_examples=100, deadline=None)
@given(POINT, POINT, POINT, POINT, st.sampled_from([1e-5, TOLERANCE, 5e-3]))
def test_chords_of_any_bezier_are_within_a_micrometre(a, b, c, d, tolerance):
    spline = Spline(1, np.array([a, b, c, d]), 0.02, 0.0, 0.0)
    points = points_on(spline, half_width(tolerance))
    assert np.array_equal(points[[0, -1]], [a, d])
    steps = np.diff(points, axis=0)
    assert np.linalg.norm(steps, axis=1).max() <= 0.51 * half_width(tolerance)
    square = np.maximum((steps**2).sum(axis=1), 1e-300)
    for place in bezier(spline.control_G, np.linspace(0, 1, 151)):
        offset = place - points[:-1]
        u = np.clip((offset * steps).sum(axis=1) / square, 0.0, 1.0)
        assert np.linalg.norm(offset - u[:, None] * steps, axis=1).min() <= CHORD_ERROR
