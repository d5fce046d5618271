"""The table of corners' shapes against the program that made it."""

import numpy as np
import pytest
from corner_shapes import ANGLES, SPEEDS, STATES, TOLERANCE, WORTHS, Angle, ShapeProgram, backwards

from cdhr_host.motion.shapes import PIECES, Shapes, measured, table

PAIRS = [((9, 0), (9, 0)), ((11, 1), (6, 0)), ((12, 1), (12, 1)), ((13, 0), (8, 1))]


@pytest.fixture(scope="module")
def program():
    return ShapeProgram()


def row(degrees, pair, swings):
    """Durations and jerks (18,) of the table."""
    i, j = (STATES.index(state) for state in pair)
    return table().rows[int(swings), ANGLES.index(degrees), i, j]


def value(given, duration, speed, reach):
    """What the program makes least: time, less what the ways are worth."""
    worth = sum(way * (w - 1) / v for way, v, w in zip(reach, given[1:3], given[3:5], strict=True))
    return 10 * (duration + worth)


@pytest.mark.parametrize("swings", [False, True])
@pytest.mark.parametrize("degrees", [45.0, 90.0, 135.0])
@pytest.mark.parametrize("pair", PAIRS)
def test_nothing_better_is_found_near_what_the_table_holds(program, degrees, pair, swings):
    held = row(degrees, pair, swings)
    (v0, w0), (v1, w1) = pair
    given = np.array([np.radians(degrees), SPEEDS[v0], SPEEDS[v1], WORTHS[w0], WORTHS[w1], swings])
    shape = measured(Shapes.of(held), given[0], np.bool_(True))
    found = program.solve(given, np.append(held, shape.reach[0]), near=True)
    assert found is not None
    mine = value(given, shape.duration, shape.speed, shape.reach)
    assert found[0] == pytest.approx(mine, abs=0.02 * 10 * float(shape.duration))
    assert shape.off <= TOLERANCE * 1.2
    assert shape.acceleration <= 1.05
    assert shape.speed == pytest.approx(given[1:3], rel=0.02)


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
