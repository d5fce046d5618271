"""No peak of a long record is lost, however few intervals it is drawn in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdhr_host.report.plot.envelope import Envelope


@given(st.lists(st.integers(1, 300), min_size=1, max_size=12), st.integers(0, 2**32 - 1))
def test_extremes_are_those_of_the_rows_of_each_interval(sizes, seed):
    rows = np.random.default_rng(seed).normal(size=(sum(sizes), 2))
    envelope = Envelope(8)
    for part in np.split(rows, np.cumsum(sizes)[:-1]):
        envelope.add(part)
    low, high = envelope.extremes()
    starts = np.arange(0, len(rows), envelope.span)
    assert np.array_equal(low, np.minimum.reduceat(rows, starts))
    assert np.array_equal(high, np.maximum.reduceat(rows, starts))
    assert len(low) <= 17


def test_a_single_peak_in_a_million_rows_is_there():
    rows = np.zeros((1_000_000, 1))
    rows[654_321] = 7.0
    envelope = Envelope()
    for part in np.split(rows, 40):
        envelope.add(part)
    _, high = envelope.extremes()
    assert len(high) <= 3001
    assert high.max() == 7.0
    assert high[654_321 // envelope.span] == 7.0


def test_what_is_not_known_is_no_extreme():
    envelope = Envelope()
    envelope.add(np.array([[np.nan, 1.0], [2.0, np.nan]]))
    low, high = envelope.extremes()
    assert np.isnan(low[0, 0])
    assert (low[1, 0], high[0, 1]) == (2.0, 1.0)


@pytest.mark.parametrize("count", [0, 1])
def test_little_or_nothing(count):
    envelope = Envelope()
    envelope.add(np.zeros((count, 3)))
    assert len(envelope.extremes()[0]) == count
