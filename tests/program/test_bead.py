"""The profile's bead, where a program says where clay goes but not how much; the first layer."""

import math

import numpy as np
import pytest
from program_reading import column, profile, read

from cdhr_host.values import Arc, Moves, Spline

AREA = 2.5 * 2.5 + math.pi / 4 * 2.5**2  # 5 mm wide, 2.5 mm high, in mm²
WORDS = {"lays": "bead", "fan_words": "air", "pin_words": "air", "pin": 4}
OPENS = [("M106", "M107"), ("M3", "M5"), ("M126", "M127"), ("M380", "M381"), ("M42 P4 S255", "M42 P4 S0")]


def clay(text, **sections):
    """mm³ of each move, arc and curve."""
    commands = read(text, profile(**sections))
    laid = [item.clay for item in commands if isinstance(item, Moves | Arc | Spline)]
    return (np.concatenate([np.atleast_1d(each) for each in laid]) / 1e-9).tolist()


@pytest.mark.parametrize(("opens", "closes"), OPENS)
def test_open_air_lays_the_bead_along_every_move(opens, closes):
    text = f"G1 X10 F600\n{opens}\nG1 X20\nG0 Y3\n{closes}\nG1 X40\n"
    commands = read(text, profile(air=WORDS))
    assert column(commands, "clay", 1e-9) == pytest.approx([0, 10 * AREA, 3 * AREA, 0])
    assert column(commands, "air") == [0, 0, 0, 0]


def test_half_open_air_and_the_flow_factor_lay_a_share():
    text = "G1 X10 F600\nM3 S127.5\nG1 X20\nM221 S150\nG1 X30\n"
    assert clay(text, air=WORDS) == pytest.approx([0, 5 * AREA, 7.5 * AREA])


def test_a_line_with_e_says_itself_how_much():
    text = "M83\nM3\nG1 X10 E3 F600\nG1 X20 E0\nG1 X30\n"
    assert clay(text, air=WORDS) == pytest.approx([3, 0, 10 * AREA])


def test_arcs_and_curves_lay_it_along_their_length():
    quarter = 10 * math.pi / 2
    text = "M3\nG1 X10 F600\nG3 X0 Y10 I-10\nG2 X0 Y10 Z4 I5 J0\nG5 X30 Y10 I10 J0 P-10 Q0\n"
    helix = math.hypot(10 * math.pi, 4)
    expected = [10, quarter, helix, 30]
    assert clay(text, air=WORDS) == pytest.approx([way * AREA for way in expected], rel=1e-5)


def test_a_bead_higher_than_wide_is_an_ellipse():
    bead = {"width_mm": 2.0, "layer_height_mm": 4.0}
    assert clay("M3\nG1 X10 F600\n", air=WORDS, bead=bead) == pytest.approx([10 * math.pi / 4 * 8])


def test_features_lay_on_all_but_g0():
    text = (
        "G1 X10 F600\n;TYPE:Perimeter\nG1 X20\nG0 X30\nG3 X30 Y0 I-5 J0\n;TYPE:Custom\nG1 X50\n"
        ";TYPE:External perimeter\nG1 X60\n"
    )
    found = clay(text, air={"comments": "type"})
    assert found == pytest.approx([0, 10 * AREA, 0, 10 * math.pi * AREA, 0, 10 * AREA])
    assert clay(text) == [0] * 6


def test_paths_between_comments_lay():
    text = "G1 X10 F600\n; Start path\nG1 X20\n; End path\nG1 X40\n"
    assert clay(text, air={"comments": "path"}) == pytest.approx([0, 10 * AREA, 0])


def test_the_first_layer_gets_its_share_with_e_and_without():
    text = "M83\nG0 Z2.5 F600\nG1 X10 E100\nM3\nG1 X20\nG0 Z5 E0\nG1 X30\nG1 X40 E100\n"
    found = clay(text, air=WORDS, bead={"first_layer_percent": 150.0})
    assert found == pytest.approx([0, 150, 15 * AREA, 0, 10 * AREA, 100])
    arcs = clay("M3\nG3 X10 I5 F600\nG0 Z9 E0\nG3 X0 I-5\n", air=WORDS, bead={"first_layer_percent": 150.0})
    assert arcs[0] == pytest.approx(1.5 * arcs[2])


def test_pressure_is_what_open_air_holds_unless_told_otherwise():
    commands = read("M3\nG1 X10 F600\n")
    assert column(commands, "air") == [200e3]
    assert column(commands, "clay", 1e-9) == [0]
