"""Planes, curves and blending through the whole staircase."""

import math

import numpy as np
import pytest

from cdhr_host.errors import MotionError, ProgramError
from cdhr_host.pipeline import Staircase, open_profile, prove
from cdhr_host.units import MM, MM3

CORNER = b"G91\nG1 X10 F1200\nG1 Y10\nG1 X-10\nG1 Y-10\nG90\n"


@pytest.fixture(scope="module")
def wide():
    return open_profile("paper-wide")


def nozzle(blocks):
    return np.concatenate([block.nozzle_G for block in blocks])


def nearest(rows, place_mm):
    """mm from a place to the nearest row."""
    return np.linalg.norm(rows / MM - np.array(place_mm), axis=1).min()


def test_proof_counts_curves(wide):
    straight = prove([b"M83\nG5 X30 I10 J0 P-10 Q0 E60 F1200\n"], wide)
    assert straight.ok
    assert straight.moves == 1
    assert straight.path / MM == pytest.approx(30)
    assert straight.extruded / MM3 == pytest.approx(60)
    parabola = prove([b"G5.1 X40 I20 J40 F1200\nG61\nG18\nG2 X20 Z0 I-10 F1200\n"], wide)
    arc_of_parabola = 20 * (math.sqrt(5) + math.asinh(2) / 2)
    assert parabola.path / MM == pytest.approx(arc_of_parabola + 10 * math.pi, rel=1e-6)
    assert parabola.moves == 2


def test_an_upright_arc_below_the_bed_is_refused(wide):
    text = b"G1 X20 Z5 F1200\nG18\nG3 X-20 I-20\n"
    assert {(problem.kind, problem.line) for problem in prove([text], wide).problems} == {("bed", 3)}
    assert prove([text.replace(b"G3", b"G2")], wide).ok


@pytest.mark.parametrize("refused", [b"G61\nG1 X5000 F1200\n", b"G64 P3\nG1 X5 F1200\nG6\n"])
def test_a_refused_text_does_not_change_how_corners_are_taken(refused, wide):
    machine, other = Staircase(wide), Staircase(wide)
    for first in (b"G64 P0.05\n", b"G18\n"):
        machine.prepare([first])
        other.prepare([first])
    with pytest.raises((MotionError, ProgramError)):
        machine.prepare([refused])
    found, wanted = nozzle(machine.prepare([CORNER])), nozzle(other.prepare([CORNER]))
    assert np.array_equal(found, wanted)


def test_blending_goes_on_into_the_next_text_and_after_a_stop_on_the_way(wide):
    machine = Staircase(wide)
    assert nearest(nozzle(machine.prepare([CORNER])), (10, 0, 0)) > 0.02
    machine.prepare([b"G61\n"])
    assert nearest(nozzle(machine.prepare([CORNER])), (10, 0, 0)) < 1e-3
    machine.stand_at(np.array([0.02, 0.0, 0.0]))
    assert nearest(nozzle(machine.prepare([CORNER])), (30, 0, 0)) < 1e-3
    machine.prepare([b"G64\n"])
    assert nearest(nozzle(machine.prepare([CORNER])), (30, 0, 0)) > 0.02


def test_a_curve_does_not_go_on_after_a_stop_on_the_way(wide):
    machine = Staircase(wide)
    machine.prepare([b"G5 X10 I5 J5 P-5 Q5 F1200\n"])
    machine.stand_at(np.array([0.0, 0.0, 0.0]))
    with pytest.raises(ProgramError, match="follows no G5"):
        machine.prepare([b"G5 X20 P0 Q5\n"])


def test_words_alone_move_nothing(wide):
    rows = Staircase(wide).prepare([b"G61\nG64 P1\nG18\nG64\nG61.1\nG17\nG5 X0 I0 J0 P0 Q0 F600\n"])
    assert not nozzle(rows).any()


def test_clay_of_a_curve_flows_evenly(wide):
    blocks = Staircase(wide).prepare([b"M83\nG5 X40 Y20 I30 J0 P-5 Q-20 E600 F1200\n"])
    flow = np.concatenate([block.flow for block in blocks])
    rows = nozzle(blocks)
    speed = np.linalg.norm(np.gradient(rows, 0.004, axis=0), axis=1)
    steady = (speed > 0.0199) & (flow > 0)
    assert steady.sum() > 100
    assert flow[steady] / speed[steady] == pytest.approx(np.median(flow[steady] / speed[steady]), rel=1e-3)
