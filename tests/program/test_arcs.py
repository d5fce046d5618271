"""G2, G3: centre, radius, helix, full circle; what is no arc."""

import math

import pytest
from program_reading import moves, only_problem, read, refused, shown

from cdhr_host.values import Arc


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


def test_other_planes_are_refused_with_the_reason() -> None:
    for code in ("G18", "G19"):
        problem = only_problem(code + "\n")
        assert problem.message == f"unsupported word {code}"
        assert "only G17" in (problem.hint or "")


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
