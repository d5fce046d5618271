"""Wider kernels for chords of a curve: faster, and never further off than any other."""

import math

import numpy as np
import pytest
from motion_tracks import distance_to, moves

from cdhr_host.motion import approach
from cdhr_host.motion.beside import Allowance
from cdhr_host.motion.chords import WIDEST
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.smooth_path import smooth

H = 0.747e-3
FAST = 0.1


def smoothed(points, feed=FAST):
    """The path of a whole polyline (M+1, 3) m, and the points as they were moved."""
    feeds = np.full(len(points) - 1, feed)
    moved, spent = approach.straightened(points, feeds, feeds > 0, H)
    allowed = Allowance(feeds, np.ones(len(feeds)), 0.5, 5.0)
    return smooth(moved, H, passed=0.0, closes=True, allowed=allowed, moved=spent)


def circle(radius, chord, turned=2 * math.pi):
    count = math.ceil(radius * turned / chord)
    angle = np.linspace(0.0, turned, count + 1)
    return np.column_stack((radius * np.sin(angle), radius * (1 - np.cos(angle)), 0 * angle))


def wavy(rng):
    """Chords of any length along a heading that wanders, now and then with a corner."""
    count = int(rng.integers(5, 300))
    steps = rng.choice([1e-4, 3e-4, 1e-3, 2e-3]) * rng.uniform(0.2, 1.8, count)
    turns = rng.choice([0.01, 0.03, 0.1, 0.2]) * rng.choice([-1.0, 1.0, 1.0, 1.0], count)
    turns += rng.normal(size=count) * rng.choice([0.0, 0.02, 0.1])
    corners = rng.random(count) < 0.03
    turns[corners] = rng.uniform(-3.0, 3.0, corners.sum())
    heading = np.cumsum(turns)
    ways = steps[:, None] * np.column_stack((np.cos(heading), np.sin(heading), 0 * heading))
    return np.vstack((np.zeros(3), np.cumsum(ways, axis=0)))


@pytest.mark.parametrize("seed", range(60))
def test_the_tolerance_is_kept_whatever_is_drawn(seed):
    points = wavy(np.random.default_rng(seed))
    path = smoothed(points)
    places = np.linspace(0.0, path.end, 20 * len(points))
    _, position, slope, _ = path.at(places)
    assert distance_to(position, points).max() <= H / 3 * (1 + 1e-9)
    assert distance_to(points, position).max() <= H / 3 + (places[1] - places[0])
    assert np.linalg.norm(slope, axis=1).max() <= 1 + 1e-9
    assert np.abs(position[[0, -1]] - points[[0, -1]]).max() < 1e-9


@pytest.mark.parametrize(("radius", "chord"), [(10e-3, 0.3e-3), (10e-3, 1e-3), (30e-3, 2e-3), (5e-3, 0.5e-3)])
def test_a_fast_circle_of_chords_bends_like_a_circle(radius, chord):
    points = circle(radius, chord)
    fast, slow = smoothed(points), smoothed(points, 0.01)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    inner = slice(len(fast.start) // 4, 3 * len(fast.start) // 4)
    # The jerk of going round is |q'''| v³, and at least v³/r²; what chords add to that is left out.
    third, rippling = (each.bounds()[1][inner].max() for each in (fast, slow))
    assert third < 0.6 * rippling
    _, position, _, _ = fast.at(np.linspace(fast.end / 4, 3 * fast.end / 4, 999))
    off = np.linalg.norm(position - np.array([0.0, radius, 0.0]), axis=1) - radius
    assert off.min() > -H / 3
    assert off.max() < 1e-9
    assert fast.end == pytest.approx(lengths.sum(), rel=1e-12)


def test_slow_chords_keep_the_usual_kernel():
    points = circle(10e-3, 0.3e-3)
    allowed = Allowance(np.full(len(points) - 1, 0.02), np.ones(len(points) - 1), 0.5, 5.0)
    kept, plain = smooth(points, H, allowed=allowed), smooth(points, H)
    assert np.array_equal(kept.start, plain.start)
    assert np.array_equal(kept.coefficients, plain.coefficients)


def test_no_wider_kernel_reaches_into_a_sharp_corners_room():
    half = circle(10e-3, 0.3e-3, math.pi)
    corner = half[-1] + np.array([0.0, 0.03, 0.0])
    points = np.vstack((half, corner, corner + np.array([0.02, 0.0, 0.0])))
    path = smoothed(points)
    assert WIDEST * H < 0.02
    # Straight lies between what belongs to the corners at both its ends.
    between = (path.segment == len(half) - 1) & (path.gear[0] == 0.0)
    assert path.lengths()[between].sum() > WIDEST * H
    assert not path.bending[between].any()
    assert np.ptp(path.coefficients[1][:, between], axis=1).max() < 1e-9


def test_a_bend_of_many_metres_is_continuous_within_and_between_its_stretches():
    angle = np.cumsum(np.full(14_000, 0.012))
    points = np.column_stack((0.025 * np.cos(angle), 0.025 * np.sin(angle), 1e-5 * angle))
    limits = MotionLimits(0.1, 0.5, 5.0, H, math.radians(179))
    planner = Planner(limits, points[0])
    parts = [points[k : k + 4701] for k in range(0, len(points) - 1, 4700)]
    legs = [leg for part in parts for leg in planner.stretches(moves(part, FAST))]
    legs += planner.close()
    assert len(legs) > 2
    before = None
    for leg in legs:
        first, last = (leg.law.at(np.array([t]))[0][0] for t in (0.0, leg.duration))
        inner = (leg.path.start > first) & (leg.path.start <= last)
        x, (c0, c1, c2, c3) = leg.path.lengths()[:-1], leg.path.coefficients[:, :, :-1]
        ends = c0 + x * (c1 + x * (c2 / 2 + x * c3 / 6)), c1 + x * (c2 + x * c3 / 2)
        for end, begin in zip(ends, leg.path.coefficients[:2, :, 1:], strict=True):
            assert np.abs(end - begin)[:, inner[1:]].max() < 1e-12
        places = np.array([first, last])
        here = np.stack(leg.path.at(places)[1:])
        if before is not None:
            assert np.abs(here[:, 0] - before).max(axis=1) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
        before = here[:, 1]
