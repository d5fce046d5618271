"""The jerk-limited reference, where the optimum is known."""

import math

import pytest
from paths import SMALL, machine, planned_runs, read

casadi = pytest.importorskip("casadi")


def found(name):
    from dense import reference

    profile, limits = machine()
    (run,) = planned_runs(read(profile, SMALL[name]()), limits)
    return reference(run, limits), limits


def test_short_move_is_four_pieces_of_jerk():
    best, limits = found("straight 4 mm, F50")
    assert best.duration == pytest.approx(4 * math.cbrt(0.004 / (2 * limits.jerk)), rel=1e-3)


def test_long_move_is_the_full_law():
    best, limits = found("straight 60 mm, F50")
    ramp = 0.05 / limits.acceleration + limits.acceleration / limits.jerk
    assert best.duration == pytest.approx(0.06 / 0.05 + ramp, rel=1e-3)


def test_square_keeps_every_limit_nearly_as_it_comes():
    best, _ = found("square 20 mm, F60")
    assert best.converged
    assert best.stretched < 1.003
