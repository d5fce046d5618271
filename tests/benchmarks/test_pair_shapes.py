"""The table of shapes of two right angles against the program that made it."""

import numpy as np
import pytest

pytest.importorskip("clarabel")

from pair_shapes import ANGLES, FLAT, LENGTHS, LOST, SAME, SPEEDS, TOLERANCE, Program, Way, again, fastest

from cdhr_host.motion.pair_shapes import ENDS, PIECES, table

STEPS = 40
"""of each piece"""


def driven(way, row):
    """Places, speeds, accelerations, jerks (N, 3) of a row (88,), and the piece of each, by small steps."""
    lasting = np.repeat(row[:3] / PIECES, PIECES)
    piece = np.repeat(np.arange(len(lasting)), STEPS)
    jerk, t = row[4:].reshape(-1, 3)[piece], (lasting / STEPS)[piece, None]
    bend = np.cumsum(jerk * t, axis=0)
    speed = way.directions[0] * way.speeds[0] + np.cumsum((bend - jerk * t / 2) * t, axis=0)
    place = -row[3] * way.directions[0] + np.cumsum((speed - bend * t / 2 + jerk * t**2 / 6) * t, axis=0)
    return place, speed, bend, jerk, piece


@pytest.mark.parametrize("degrees", [0.0, 70.0, 180.0])
@pytest.mark.parametrize("length", [0.3, 1.0, 2.0])
@pytest.mark.parametrize("floor", [True, False])
def test_what_is_found_keeps_limits_and_tolerance(degrees, length, floor):
    way = Way(np.radians(degrees), (0.6, 1.2), length, floor)
    time, row = fastest(way)
    assert 0.5 < time < 4.0
    place, speed, bend, jerk, piece = driven(way, row)
    assert np.linalg.norm(jerk, axis=1).max() <= 1 + 1e-5
    assert np.linalg.norm(bend, axis=1).max() <= 1 + 1e-5
    assert np.abs(bend[-1]).max() < 1e-5
    assert speed[-1] == pytest.approx(1.2 * way.directions[2], abs=1e-4)
    for side, most in ((piece < ENDS[0], 0.6), (piece >= ENDS[1], 1.2)):
        assert np.linalg.norm(speed[side], axis=1).max() <= most * 1.01
    corner = length * way.directions[1]
    off = np.abs(np.cross(place[piece < ENDS[0]], way.directions[0])).max()
    beyond = place[piece >= ENDS[1]] - corner
    assert max(off, np.linalg.norm(np.cross(beyond, way.directions[2]), axis=1).max()) <= TOLERANCE * 1.02
    between = place[(piece >= ENDS[0]) & (piece < ENDS[1])]
    assert np.linalg.norm(between[:, :2], axis=1).max() <= TOLERANCE * 1.02
    if floor:
        assert place[:, 2].min() >= -1e-6


def test_a_shape_is_the_fastest_of_those_that_last_otherwise_between_the_corners():
    way = Way(np.radians(60), (0.6, 1.2), 0.5, True)
    time, row = fastest(way)
    others = [Program(way, row[:3] * [1, part, 1]).solve()[0] for part in (0.5, 0.9, 0.95, 1.05, 1.1)]
    assert others[0] == LOST
    assert min(others) > time


def test_the_table_is_of_these_angles_lengths_and_speeds():
    held = table()
    assert np.degrees(held.angle) == pytest.approx(ANGLES)
    assert held.length == pytest.approx(LENGTHS)
    assert held.speed == pytest.approx(SPEEDS)
    count = len(LENGTHS), len(SPEEDS), len(SPEEDS), 3 * sum(PIECES) + 4
    assert held.floor.shape == (len(ANGLES), *count)
    assert held.flat.shape == (len(FLAT), *count)


def test_shapes_looked_for_again_lose_the_same():
    for _, held, found in again():
        assert held == pytest.approx(found, abs=SAME)
