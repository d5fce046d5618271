"""Bars of characters: where the mark stands, and what is said outside the window."""

import math

import pytest

from cdhr_host.console.gauges import gauge, outside, progress_bar, span


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "├█·········┤"),
        (4.9, "├····█·····┤"),
        (9.99, "├·········█┤"),
        (10.0, "├·········█┤"),
        (-0.1, "◄··········┤"),
        (10.1, "├··········►"),
        (math.nan, "├··········┤"),
    ],
)
def test_the_mark_stands_where_the_value_is(value: float, shown: str) -> None:
    assert gauge(value, 0.0, 10.0, 12) == shown


def test_a_window_without_width_has_no_mark() -> None:
    assert gauge(3.0, 3.0, 3.0, 6) == "├····┤"


def test_outside_is_said_in_words() -> None:
    assert [outside(value, 3.0, 10.0) for value in (2.9, 3.0, 10.0, 10.1)] == ["LOW", "", "", "HIGH"]


def test_progress_and_time() -> None:
    assert progress_bar(0.5, 4) == "██··"
    assert progress_bar(2.0, 4) == "████"
    assert [span(s) for s in (-1, 59.6, 61, 3723)] == ["0:00", "1:00", "1:01", "1:02:03"]
