"""Rows of cells that turning holds up, run through as fast as can be."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from motion_tracks import distance_to, moves, norm

from cdhr_host.motion import hastened, leg
from cdhr_host.motion.bounds import leg_bounds
from cdhr_host.motion.closely import Pieces, close_bounds
from cdhr_host.motion.interior import Found
from cdhr_host.motion.leg import Leg
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.smooth_path import smooth

LIMITS = MotionLimits(speed=0.1, acceleration=0.5, jerk=5.0, half_width=0.747e-3, stop_angle=math.pi)
STEP = 1e-4
"""s, between looks"""


def circle(radius, chord, turns=1.0):
    angle = np.arange(0.0, 2 * np.pi * turns, chord / radius)
    return radius * np.column_stack((np.sin(angle), 1 - np.cos(angle), 0 * angle))


def spiral(chord):
    angle = np.cumsum(chord / np.linspace(1e-3, 0.015, 200))
    radius = np.linspace(1e-3, 0.015, 200)
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle), 0 * angle))


def noisy(seed, count=80, chord=5e-4, noise=5e-5):
    x = chord * np.arange(count)
    y = np.random.default_rng(seed).uniform(-noise, noise, (2, count))
    return np.column_stack((x, *y))


PATHS = {
    "fast circle": circle(0.01, 3e-4),
    "long chords": circle(0.01, 2e-3),
    "spiral": spiral(5e-4),
    "noise": noisy(1),
    "micrometres": noisy(2, count=400, chord=1e-6, noise=1e-6),
}


def legs(points, speed):
    planner = Planner(LIMITS, points[0])
    stretches = [*planner.stretches(moves(points, speed)), *planner.close()]
    return [each for each in stretches if isinstance(each, Leg)]


def by_cells(points, speed, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(leg, "hastened", lambda law, *_: law)
        return legs(points, speed)


def places(one, step=STEP):
    """(N, 3) m every step."""
    t = np.arange(0.0, one.duration, step)
    return one.path.at(one.law.at(t)[0])[1]


def motion(one):
    """(N, 3) m/s, m/s² and m/s³ every STEP, by the chain rule."""
    law, t = one.law, np.arange(0.0, one.duration, STEP)
    s, v, a = law.at(t)
    j = law.state[3, np.searchsorted(law.t, t, side="right") - 1][:, None]
    piece, _, slope, bend = one.path.at(s)
    third, v, a = one.path.coefficients[3][:, piece].T, v[:, None], a[:, None]
    return slope * v, bend * v**2 + slope * a, third * v**3 + 3 * bend * v * a + slope * j


def assert_kept(one, speed):
    assert leg_bounds(one).over_feed <= 1 + 1e-9
    close = np.flatnonzero(one.law.close)
    if len(close):
        bounds = close_bounds(one.path, one.law.pieces.only(close))
        assert bounds[0].max() <= LIMITS.acceleration * (1 + 1e-9)
        assert bounds[1].max() <= LIMITS.jerk * (1 + 1e-9)
    # Places know it better than the chain rule, but between two pieces rounding leaves up to 2e-13 m.
    rows = places(one, 1e-3)
    for rate, limit in zip(
        motion(one), (min(speed, LIMITS.speed), LIMITS.acceleration, LIMITS.jerk), strict=True
    ):
        assert norm(rate).max() <= limit * (1 + 1e-9)
        rows = np.diff(rows, axis=0) / 1e-3
        assert norm(rows).max(initial=0.0) <= limit * (1 + 1e-5) + 5e-4


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("speed", [0.03, 0.09])
def test_limits_hold_and_it_is_no_slower_than_by_cells(name, speed, monkeypatch):
    points = PATHS[name]
    found, before = legs(points, speed), by_cells(points, speed, monkeypatch)
    for one in found:
        assert_kept(one, speed)
        assert distance_to(places(one)[::20], points).max() < 0.25e-3
    assert sum(one.duration for one in found) <= sum(one.duration for one in before) * (1 + 1e-12)
    last = found[-1].path.at(np.array([found[-1].law.end]))[1][0]
    assert last == pytest.approx(points[-1], abs=1e-12)


@pytest.mark.parametrize(
    ("name", "share"), [("fast circle", 0.87), ("long chords", 0.9), ("spiral", 0.9), ("noise", 0.85)]
)
def test_it_is_much_faster_where_turning_holds_up(name, share, monkeypatch):
    found, before = legs(PATHS[name], 0.09), by_cells(PATHS[name], 0.09, monkeypatch)
    assert sum(one.duration for one in found) < share * sum(one.duration for one in before)


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.floats(2e-5, 1.5e-3), st.floats(1e-6, 2e-4), st.floats(0.01, 0.1))
@example(7, 0.0007566563362676704, 0.00013848639756229285, 0.0625)
@example(187, 0.0010819203015711854, 0.00016159024358458968, 0.0625)  # pieces 4e-14 m apart
def test_random_chords_keep_their_limits(seed, chord, noise, speed):
    points = noisy(seed, 60, chord, noise)
    for one in legs(points, speed):
        assert_kept(one, speed)


def test_pieces_follow_one_another_in_place_speed_and_acceleration():
    for one in legs(PATHS["spiral"], 0.09):
        law = one.law
        assert law.close.any()
        x = law.pieces.lasting
        s, v, a, j = law.state
        ends = s + x * (v + x * (a / 2 + x * j / 6)), v + x * (a + x * j / 2), a + x * j
        for begins, end, near in zip((s, v, a), ends, (1e-13, 1e-10, 1e-7), strict=True):
            assert np.abs(begins[1:] - end[:-1]).max() < near
        assert np.all(np.diff(s) > 0.0)
        assert (v > -1e-15).all()
        assert law.t == pytest.approx(np.append(0.0, np.cumsum(x)[:-1]), abs=1e-12)


def test_what_is_not_solved_stays_as_it_was(monkeypatch):
    points = PATHS["fast circle"]
    before = by_cells(points, 0.09, monkeypatch)
    never = np.zeros(1, dtype=bool)
    monkeypatch.setattr(hastened, "fastest", lambda steps, b, a: Found(b, a, never))
    for one, other in zip(legs(points, 0.09), before, strict=True):
        assert np.array_equal(one.law.state, other.law.state)
        assert not one.law.close.any()


def test_what_exceeds_a_limit_is_not_used(monkeypatch):
    points = PATHS["fast circle"]
    before, real = by_cells(points, 0.09, monkeypatch), hastened.fastest

    def hasty(steps, b, a):
        found = real(steps, b, a)
        return Found(1.02 * found.b, found.a, found.solved)

    monkeypatch.setattr(hastened, "fastest", hasty)
    assert sum(one.duration for one in legs(points, 0.09)) == sum(one.duration for one in before)


def test_close_bounds_are_no_less_than_what_is_reached_and_little_more():
    path = smooth(PATHS["noise"], LIMITS.half_width)
    rng = np.random.default_rng(3)
    count = 300
    s = rng.uniform(0.1, 0.9, count) * path.end
    v, a, j = rng.uniform(0.01, 0.05, count), rng.uniform(-0.3, 0.3, count), rng.uniform(-5.0, 5.0, count)
    lasting = rng.uniform(5e-4, 4e-3, count)
    way = lasting * (v + lasting * (a / 2 + lasting * j / 6))
    law = Pieces(np.stack((s, v, a, j)), lasting, np.stack((s, s + way)))
    bounds = close_bounds(path, law)
    x = np.linspace(0.0, 1.0, 41)[:, None] * lasting
    at = s + x * (v + x * (a / 2 + x * j / 6))
    piece = np.searchsorted(path.start, at, side="right") - 1
    offset, (_, c1, c2, q3) = at - path.start[piece], path.coefficients[:, :, piece]
    q2, q1 = c2 + offset * q3, c1 + offset * (c2 + offset * q3 / 2)
    rate, change = v + x * (a + x * j / 2), a + x * j
    pull = np.sqrt(((q2 * rate**2 + q1 * change) ** 2).sum(axis=0)).max(axis=0)
    jerk = np.sqrt(((q3 * rate**3 + 3 * q2 * rate * change + q1 * j) ** 2).sum(axis=0)).max(axis=0)
    for bound, reached, near in zip(bounds, (pull, jerk), (0.01, 0.04), strict=True):
        assert (bound >= reached * (1 - 1e-9)).all()
        assert (bound <= reached * (1 + near)).all()
