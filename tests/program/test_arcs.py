"""G2, G3: centre, radius, helix, full circle; what is no arc."""

import math

import pytest
from program_reading import PAPER_WIDE, moves, only_problem, read, refused, shown

from cdhr_host.errors import ProgramError
from cdhr_host.program import Interpreter
from cdhr_host.values import Arc, Plane


def arc_of(text: str) -> Arc:
    (arc,) = (item for item in read(text) if isinstance(item, Arc))
    return arc


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("G2 X10 Y0 I5 J0 F600", "about 5 0 by -180 deg"),
        ("G3 X10 Y0 I5 F600", "about 5 0 by 180 deg"),
        ("G3 X10 R5 F600", "about 5 0 by 180 deg"),
        ("G2 X10 R-5 F600", "about 5 0 by -180 deg"),
        ("G2 X5 Y5 I5 J0 F600", "about 5 0 by -90 deg"),
        ("G3 X5 Y5 I5 J0 F600", "about 5 0 by 270 deg"),
        ("G2 X5 Y5 R5 F600", "about 5 0 by -90 deg"),
        ("G2 X5 Y5 R-5 F600", "about 0 5 by -270 deg"),
        ("G3 X5 Y5 R5 F600", "about 0 5 by 90 deg"),
        ("G3 X5 Y5 R-5 F600", "about 5 0 by 270 deg"),
        ("G2 I5 F600", "about 5 0 by -360 deg"),
        ("G3 X0 Y0 I3 J4 F600", "about 3 4 by 360 deg"),
        ("g02x10i5f600", "about 5 0 by -180 deg"),
    ],
)
def test_centre_and_sweep(line: str, expected: str) -> None:
    assert expected in shown(read(line + "\n"))[0]


def test_helix_carries_its_end_clay_and_speed() -> None:
    assert shown(read("G1 X1 F600\nG17\nG3 X1 Y10 Z2.5 J5 E7 F1200\nG1 X0\n")) == [
        "1 move to 1 0 0 at 10",
        "3 arc to 1 10 2.5 about 1 5 by 180 deg at 20 clay 7",
        "4 move to 0 10 2.5 at 20",
    ]


def test_arc_follows_units_distances_and_offsets() -> None:
    text = "G20\nG92 X1\nG91\nG3 X0 Y2 J1 F60\n"
    assert shown(read(text))[1] == "4 arc to 0 50.8 0 about 0 25.4 by 180 deg at 25.4"


def test_radii_may_differ_by_the_rounding_of_the_file() -> None:
    arc = arc_of("G1 X100 F600\nG3 X0 Y100.04 I-100 J0\n")
    assert arc.end_G.tolist() == [0, 0.10004, 0]
    assert arc.centre_G.tolist() == [0, 0]
    assert arc.sweep == pytest.approx(math.pi / 2)
    assert arc_of("G1 X400 F600\nG3 X0 Y400.39 I-400\n").sweep == pytest.approx(math.pi / 2)


def test_radii_that_differ_are_refused_with_both() -> None:
    problem = only_problem("G1 X10 F600\nG1 X10\n G3 X0 Y11 I-10 J0\n")
    assert (problem.kind, problem.line, problem.column) == ("arc", 3, 2)
    assert "10.0000 mm" in problem.message
    assert "11.0000 mm" in problem.message
    assert (problem.value, problem.limit) == (pytest.approx(1), pytest.approx(0.05))


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("G2 X1 F600", "no centre"),
        ("G2 X1 I.5 R.5 F600", "both a centre"),
        ("G2 X1 I0 J0 F600", "radius is 0"),
        ("G3 R5 F600", "full circle"),
        ("G3 X10.2 R5 F600", "more than twice"),
        ("G2 X1 P2 I.5 F600", "no word P"),
        ("G2 X1 I F600", "I has no number"),
    ],
)
def test_no_arc(line: str, says: str) -> None:
    assert says in only_problem(line + "\n").message


def test_a_radius_short_by_rounding_is_half_a_turn() -> None:
    arc = arc_of("G3 X10.004 R5 F600\n")
    assert arc.sweep == pytest.approx(math.pi)
    assert arc.centre_G.tolist() == pytest.approx([0.005002, 0])


def test_arcs_after_a_refused_one_start_at_its_end() -> None:
    assert refused("G2 X10 I2 F600\nG2 X20 I5\n").total == 1


def test_arcs_after_an_unreadable_move_are_not_blamed() -> None:
    text = "G1 X1,5 Y2 F600\nG2 X10 I5\nG1 X1 Y1\nG2 X2 I-5\n"
    assert [problem.line for problem in refused(text).problems] == [1, 4]


def test_end_in_the_direction_of_the_start_is_a_full_turn() -> None:
    assert arc_of("G3 X-.01 I10 F600\n").sweep == pytest.approx(2 * math.pi)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G18\nG3 X-10 Z0 I-5 F600", "to -10 0 0 about 0 -5 by 180 deg at 10 in ZX"),
        ("G18\nG2 X10 Y4 Z10 K10 F600", "to 10 4 10 about 10 0 by -90 deg at 10 in ZX"),
        ("G18\nG3 X10 Y4 Z10 K10 F600", "to 10 4 10 about 10 0 by 270 deg at 10 in ZX"),
        ("G18\nG2 X10 R5 F600", "to 10 0 0 about 0 5 by -180 deg at 10 in ZX"),
        ("G19\nG3 Y-10 J-5 F600", "to 0 -10 0 about -5 0 by 180 deg at 10 in YZ"),
        ("G19\nG3 X2 K5 F600", "to 2 0 0 about 0 5 by 360 deg at 10 in YZ"),
        ("G19\nG20\nG91\nG2 Y1 Z1 R1 F60", "to 0 25.4 25.4 about 25.4 0 by -90 deg at 25.4 in YZ"),
        ("G19\nG17\nG3 X10 I5 F600", "to 10 0 0 about 5 0 by 180 deg at 10"),
    ],
)
def test_planes(text: str, expected: str) -> None:
    assert shown(read(text + "\n"))[-1].endswith(expected)


def test_clockwise_is_seen_from_the_positive_end_of_the_normal() -> None:
    """A quarter turn counter-clockwise about +y goes from z to x."""
    arc = arc_of("G1 Z10 F600\nG18\nG3 X10 Z0 K-10\n")
    assert (arc.plane, arc.centre_G.tolist()) == (Plane.ZX, [0, 0])
    assert arc.sweep == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(("code", "letter"), [("G17", "K"), ("G18", "J"), ("G19", "I")])
def test_the_centre_has_no_offset_along_the_helix(code: str, letter: str) -> None:
    problem = only_problem(f"{code}\nG2 X1 Y1 Z1 {letter}1 F600\n")
    assert problem.message == f"G2 has no word {letter} in the plane of {code}"


def test_arcs_of_a_hundred_metres_are_not_meant() -> None:
    assert "long" in only_problem("G2 I99999999 F600\n").message
    assert arc_of("G3 X100 Y0.001 R99999999 F600\n").sweep < 1e-5


def test_the_plane_goes_on_into_the_next_text_and_is_not_left_by_a_refused_one() -> None:
    interpreter = Interpreter(PAPER_WIDE)
    list(interpreter.commands([b"G18\n"]))
    with pytest.raises(ProgramError):
        list(interpreter.commands([b"G19\nG6\n"]))
    assert "in ZX" in shown(interpreter.commands([b"G3 I5 F600\n"]))[0]


def test_clay_of_an_upright_arc_counts_at_its_top() -> None:
    text = "G0 X20 Z5\nG18\nG3 X-20 I-20 E5 F600\nG0 X0\nG28\n"
    upright, flat = read(text), read(text.replace("G18", "G17"))
    bed = PAPER_WIDE.bed
    assert moves(flat)[-1][2] == pytest.approx(5 + bed.clear_height * 1e3)
    assert moves(upright)[-1][2] == pytest.approx(5 + bed.clear_height * 1e3, abs=0.01)
    up = text.replace("G3", "G2")
    assert moves(read(up))[-1][2] == pytest.approx(25 + bed.clear_height * 1e3, abs=0.01)


@pytest.mark.parametrize(
    ("text", "blocked"),
    [
        ("G0 X110\nG3 X-110 I-110 E5 F600\nG0 X-200\n", False),
        ("G0 X90\nG3 X-90 I-90 E5 F600\nG0 X-200\n", True),
        ("G0 X200\nG3 X200 Y20 R10 E5 F600\n", False),
        ("G0 X0 Y150\nG3 X0 Y-150 I200 J-150 E5 F600\nG0 Y-200\n", True),
        ("G0 X0 Y150\nG2 X0 Y-150 I200 J-150 E5 F600\nG0 Y-200\n", False),
    ],
)
def test_arcs_of_clay_near_the_reference_axis(text: str, blocked: bool) -> None:
    commands = read(text + "G28\n")
    assert (moves(commands)[-1][2] > 0) == blocked
