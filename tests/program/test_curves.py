"""G5, G5.1: control points, what is no curve, and where clay of curves is; G61, G64."""

import numpy as np
import pytest
from program_reading import moves, only_problem, read, refused, shown, warnings

from cdhr_host.values import Blend, Prime, Spline


def curves(text: str) -> list[Spline]:
    return [item for item in read(text) if isinstance(item, Spline)]


def control_mm(text: str) -> list[list[float]]:
    (curve,) = curves(text)
    return (np.round(curve.control_G * 1e3, 9) + 0.0).tolist()


def test_control_points_of_a_cubic() -> None:
    text = "G0 X1 Y1 Z2\nG5 X11 Y2 I1 J3 P-2 Q4 F600\n"
    assert control_mm(text) == [[1, 1, 2], [2, 4, 2], [9, 6, 2], [11, 2, 2]]


def test_a_quadratic_is_its_parabola() -> None:
    """LinuxCNC's example: y = x² from (-2, 4) to (2, 4)."""
    (curve,) = curves("G0 X-2 Y4\nG5.1 X2 I2 J-8 F600\n")
    t = np.linspace(0, 1, 9)[:, None]
    a, b, c, d = curve.control_G[:, :2] * 1e3
    x, y = ((1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t**2 * c + t**3 * d).T
    assert y == pytest.approx(x**2)


@pytest.mark.parametrize("between", ["", "M117 hello\nG4 P5\n", "G91\nG90\n", "M105\n"])
def test_a_cubic_goes_on_from_the_one_before(between: str) -> None:
    first, second = curves(f"G5 X1 Y1 I0 J3 P.5 Q-3 F600\n{between}G5 P0 Q-3 X2 Y1\n")
    before, after = np.diff(first.control_G, axis=0)[-1], np.diff(second.control_G, axis=0)[0]
    assert after == pytest.approx(before)
    assert np.array_equal(first.control_G[-1], second.control_G[0])


@pytest.mark.parametrize("between", ["G1 X20", "G0", "G2 X20 I5", "G5.1 X20 I1", "G28"])
def test_a_move_ends_the_row_of_cubics(between: str) -> None:
    problem = only_problem(f"G5 X10 I5 J0 P-5 Q0 F600\n{between}\nG5 X30 P-5 Q0\n")
    assert "follows no G5" in problem.message


def test_units_distances_factors_and_feed() -> None:
    text = "G20\nG91\nM220 S50\nG5 X1 Y1 I0 J1 P0 Q-1 F60\nG5 X1 P0 Q1\n"
    assert shown(read(text))[1:] == [
        "4 curve by 0 25.4 and 25.4 0 to 25.4 25.4 0 at 12.7",
        "5 curve by 25.4 50.8 and 50.8 50.8 to 50.8 25.4 0 at 12.7",
    ]


def test_curves_need_a_feed_and_warn_above_the_machine() -> None:
    assert only_problem("G5 X1 I1 J0 P0 Q1\nG1 X2\n").kind == "feed"
    assert len(warnings(read("G5 X1 I1 J0 P0 Q1 F9000\nG5.1 X2 I1\nG2 X4 I1\n"))) == 1


def test_a_curve_of_no_length_vanishes_or_primes() -> None:
    assert read("G5 X0 I0 J0 P0 Q0 F600\n") == []
    (prime,) = read("G5 X0 I0 J0 P0 Q0 E2 F600\n")
    assert isinstance(prime, Prime)
    assert prime.clay == pytest.approx(2e-9)


def test_a_loop_is_a_curve() -> None:
    assert control_mm("G5 X0 Y0 I10 J10 P-10 Q10 F600\n")[3] == [0, 0, 0]


def test_a_refused_line_is_not_blamed_on_the_next() -> None:
    assert refused("G5 X1,5 I1 J1 P0 Q0 F600\nG5 X3 P0 Q0\n").total == 1
    assert refused("G5 X1 I1 P0 Q0 F600\nG5 X3 P0 Q0\n").total == 1


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("G5 X1 I1 J1 P1 F600", "needs Q"),
        ("G5.1 X1 P1 I1 F600", "no word P"),
        ("G5.1 X1 I0 J0 F600", "no control point"),
        ("G5.1 X1 Z1 I1 F600", "no word Z"),
        ("G5 X1 I1 K1 P0 Q0 F600", "no word K"),
        ("G5.1 X1 I99999999 F600", "apart"),
        ("G61 P1", "no word P"),
        ("G64 Q1", "no word Q"),
    ],
)
def test_no_curve(line: str, says: str) -> None:
    assert says in only_problem(line + "\n").message


@pytest.mark.parametrize(
    ("text", "blocked"),
    [
        ("G0 X-200 Y100\nG5 X200 I100 J-50 P-100 Q-50 E5 F600\nG0 X250\n", True),
        ("G0 X-200 Y100\nG5 X200 I100 J50 P-100 Q50 E5 F600\nG0 X250\n", False),
        ("G0 X-200 Y100\nM3\nG5.1 X200 I200 J-190 F600\nM5\nG0 X250\n", True),
        ("G0 X-200 Y100\nG5.1 X200 I200 J-190 F600\nG0 X250\n", False),
    ],
)
def test_curves_of_clay_near_the_reference_axis(text: str, blocked: bool) -> None:
    assert (moves(read(text + "G28\n"))[-1][2] > 0) == blocked


def test_blending_words() -> None:
    text = "G1 X1 F600\nG61\nG61.1\nG64\nG64 P.05\nG20\nG64 P1\n"
    found = [(item.tolerance, item.exact) for item in read(text) if isinstance(item, Blend)]
    assert found == [(None, True), (None, True), (None, False), (pytest.approx(5e-5), False), (0.0254, False)]


@pytest.mark.parametrize("number", ["0", "-1", "0.009", "50.1"])
def test_tolerances_have_a_range(number: str) -> None:
    problem = only_problem(f"G64 P{number}\n")
    assert (problem.kind, problem.limit, problem.column) == ("range", "0.01..50", 5)
    assert "G61" in (problem.hint or "")
