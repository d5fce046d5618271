"""What is left out of a drawn path was not to be seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdhr_host.report.thinning import thinned


def away(places, line):
    """(M, 3) from a polyline (K, 3): the greatest of the least distances."""
    start, way = line[:-1], np.diff(line, axis=0)
    square = np.maximum((way**2).sum(axis=1), 1e-300)
    share = np.clip(((places[:, None] - start) * way).sum(axis=2) / square, 0.0, 1.0)
    return np.linalg.norm(places[:, None] - start - share[..., None] * way, axis=2).min(axis=1).max()


def test_a_straight_line_keeps_one_of_256():
    rows = np.column_stack([np.linspace(0, 1, 1025), np.zeros((1025, 3))])
    assert len(thinned(rows, np.array([1e-5] * 3 + [1.0]), np.zeros(1025))) == 5


@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-4, 1e-3, 1e-2]))
def test_all_that_was_there_is_within_the_tolerance_of_what_is_kept(seed, tolerance):
    steps = np.random.default_rng(seed).normal(size=(200, 3)) * np.array([1e-3, 1e-3, 1e-4])
    rows = np.column_stack([np.cumsum(np.cumsum(steps, axis=0) * 0.05, axis=0), np.zeros(200)])
    kept = thinned(rows, np.array([tolerance] * 3 + [0.0]), np.zeros(200))
    assert kept[0] == 0
    assert kept[-1] == 199
    assert away(rows[:, :3], rows[kept, :3]) <= tolerance


def test_a_change_of_colour_stays():
    rows = np.column_stack([np.linspace(0, 1, 101), np.zeros((101, 3))])
    rows[50, 3] = 0.3
    kept = thinned(rows, np.array([1e-3] * 3 + [0.1]), np.zeros(101))
    assert 50 in kept
    assert {49, 51} & set(kept)


def test_where_clay_begins_and_ends_stays():
    rows, clay = np.column_stack([np.linspace(0, 1, 64), np.zeros((64, 3))]), np.arange(64) >= 31
    assert {30, 31} <= set(thinned(rows, np.ones(4), clay))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_little_is_kept_whole(count):
    assert len(thinned(np.zeros((count, 4)), np.ones(4), np.zeros(count))) == count
