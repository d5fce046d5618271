"""The smoothed path against its definition, a convolution."""

import math

import numpy as np
import pytest

from cdhr_host.motion.smooth_path import smooth

H = 0.75e-3


def convolved(points, s, h=H, count=20001):
    """q(s) by quadrature of the definition."""
    u = np.linspace(-h, h, count)
    kernel = (h - np.abs(u)) / h**2
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    drawn = np.concatenate(([0.0], np.cumsum(lengths)))
    values = np.stack([np.interp(s - u, drawn, points[:, k]) for k in range(3)], axis=1)
    return np.trapezoid(values * kernel[:, None], u, axis=0)


@pytest.fixture
def zigzag():
    return np.cumsum(np.random.default_rng(0).normal(size=(40, 3)) * 4e-4, axis=0)


def test_is_the_convolution_with_a_triangle(zigzag):
    path = smooth(zigzag, H, passed=0.0, closes=True)
    drawn = np.linalg.norm(np.diff(zigzag, axis=0), axis=1).sum()
    places = np.linspace(3 * H, drawn - 3 * H, 57)
    _, position, _, _ = path.at(places)
    wanted = np.array([convolved(zigzag, s) for s in places])
    assert np.abs(position - wanted).max() < 1e-10


def test_derivatives_are_continuous_and_consistent(zigzag):
    path = smooth(zigzag, H, passed=0.0, closes=True)
    inner = path.start[(path.start > 2 * H) & (path.start < path.end - 2 * H)]
    before, after = (path.at(inner + side * 1e-12) for side in (-1, 1))
    for k, scale in ((1, 1.0), (2, 1.0), (3, 1 / H)):
        assert np.abs(before[k] - after[k]).max() < 1e-6 * scale
    places = np.linspace(2 * H, path.end - 2 * H, 500)
    step = 1e-7
    low, middle, high = (path.at(places + d) for d in (-step, 0.0, step))
    assert np.abs((high[1] - low[1]) / (2 * step) - middle[2]).max() < 1e-6
    assert np.abs((high[2] - low[2]) / (2 * step) - middle[3]).max() < 2 / H**2 * step


def test_slope_never_exceeds_one_and_bounds_hold(zigzag):
    path = smooth(zigzag, H, passed=0.0, closes=True)
    places = np.linspace(0, path.end, 5000)
    piece, _, slope, bend = path.at(places)
    assert np.linalg.norm(slope, axis=1).max() <= 1 + 1e-9
    largest, _ = path.bounds()
    assert (np.linalg.norm(bend, axis=1) <= largest[piece] * (1 + 1e-9) + 1e-9).all()


@pytest.mark.parametrize("degrees", [1, 10, 45, 90, 120, 150, 179])
@pytest.mark.parametrize("second", [1e-4, 5e-4, 1e-2])
def test_deviation_at_a_corner_stays_below_a_third_of_the_half_width(degrees, second):
    angle = math.radians(degrees)
    corner = np.array([0.01, 0.0, 0.0])
    end = corner + second * np.array([math.cos(angle), math.sin(angle), 0.0])
    points = np.array([[0.0, 0, 0], corner, end])
    path = smooth(points, H, passed=0.0, closes=True)
    places = np.linspace(0, path.end, 4001)
    _, position, _, _ = path.at(places)
    drawn = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    same = np.stack([np.interp(places, drawn, points[:, k]) for k in range(3)], axis=1)
    assert np.linalg.norm(position - same, axis=1).max() <= H / 3 * (1 + 1e-9)


def test_middle_of_a_longer_path_does_not_depend_on_what_was_cut_off(zigzag):
    whole = smooth(zigzag, H, passed=0.0, closes=True)
    lengths = np.linalg.norm(np.diff(zigzag, axis=0), axis=1)
    cut = 12
    offset = lengths[:cut].sum()
    part = smooth(zigzag[cut:], H)
    places = np.linspace(offset + H, lengths.sum() - 3 * H, 300)
    for wanted, found in zip(whole.at(places)[1:], part.at(places - offset)[1:], strict=True):
        assert np.abs(wanted - found).max() < 1e-8


def test_straight_points_make_no_corner():
    points = np.column_stack((np.linspace(0, 0.1, 11), np.zeros((11, 2))))
    path = smooth(points, H)
    assert not path.bending.any()
    assert path.lengths().sum() == pytest.approx(0.1 + H)


def test_a_corner_that_stands_alone_is_rounded_as_far_as_allowed():
    for degrees in (5, 20, 60, 90, 140):
        turn = math.radians(degrees)
        points = np.array([[0, 0, 0], [0.1, 0, 0], [0.1 + 0.1 * math.cos(turn), 0.1 * math.sin(turn), 0]])
        path = smooth(points, H)
        _, position, _, _ = path.at(np.array([0.1]))
        assert np.linalg.norm(position[0] - points[1]) == pytest.approx(H / 3, rel=1e-6)
        largest, _ = path.bounds()
        assert largest.max() == pytest.approx((2 * math.sin(turn / 2)) ** 2 / (2 * H), rel=1e-6)


def test_wide_kernels_stay_within_the_halves_of_their_segments():
    rng = np.random.default_rng(2)
    points = np.cumsum(rng.normal(size=(200, 3)) * rng.choice([1e-4, 2e-3, 2e-2], size=(200, 1)), axis=0)
    path = smooth(points, H, passed=0.0, closes=True)
    places = np.linspace(0, path.end, 100_000)
    _, position, slope, _ = path.at(places)
    drawn = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    same = np.stack([np.interp(places, drawn, points[:, k]) for k in range(3)], axis=1)
    assert np.linalg.norm(position - same, axis=1).max() <= H / 3 * (1 + 1e-9)
    assert np.linalg.norm(slope, axis=1).max() <= 1 + 1e-9
