"""The table of corners' shapes against the program that made it."""

import numpy as np
import pytest

pytest.importorskip("casadi")

from corner_shapes import (
    ANGLES,
    SAME,
    SOME_ANGLES,
    SOME_PAIRS,
    SPEEDS,
    STATES,
    TOLERANCE,
    Angle,
    again,
    backwards,
)

from cdhr_host.motion.shapes import PIECES, Shapes, measured, table


def row(degrees, pair, swings):
    """Durations and jerks (18,) of the table."""
    i, j = (STATES.index(state) for state in pair)
    return table().rows[int(swings), ANGLES.index(degrees), i, j]


@pytest.mark.parametrize("swings", [False, True])
@pytest.mark.parametrize("degrees", SOME_ANGLES)
@pytest.mark.parametrize("pair", SOME_PAIRS)
def test_what_the_table_holds_nearly_keeps_limits_and_tolerance(degrees, pair, swings):
    (v0, _), (v1, _) = pair
    shape = measured(Shapes.of(row(degrees, pair, swings)), np.radians(degrees), np.bool_(True))
    assert shape.off <= TOLERANCE * 1.2
    assert shape.acceleration <= 1.05
    assert shape.jerk <= 1.05
    assert shape.speed == pytest.approx([SPEEDS[v0], SPEEDS[v1]], rel=0.02)


def test_a_shape_driven_backwards_twice_is_itself():
    shape = np.random.default_rng(1).uniform(size=3 * PIECES + 1)
    twice = backwards(backwards(shape))
    assert np.array_equal(twice[:-1], shape[:-1])


def test_shapes_of_one_angle_are_found_from_each_other(monkeypatch):
    monkeypatch.setattr("corner_shapes.STATES", [(9, 0), (9, 1), (10, 0), (10, 1)])
    found = Angle(90.0, True).table()
    assert found.shape == (4, 4, 3 * PIECES)
    assert np.isfinite(found).all()
    held = [[row(90.0, (one, other), True) for other in ((9, 0), (10, 0))] for one in ((9, 0), (10, 0))]
    assert found[::2, ::2, :PIECES].sum(axis=-1) == pytest.approx(
        np.array(held)[..., :PIECES].sum(axis=-1), rel=0.02
    )


def test_shapes_looked_for_again_are_worth_the_same():
    for *_, held, found in again():
        assert found == pytest.approx(held, abs=SAME)
