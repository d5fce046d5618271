"""What is refused: words, numbers, comments, checksums; every problem at once."""

from functools import reduce
from operator import xor

import pytest
from program_reading import only_problem, read, refused, shown

from cdhr_host.errors import ProgramError
from cdhr_host.program.words import nearest


@pytest.mark.parametrize(
    ("code", "near"),
    [
        ("G6", "G5"),
        ("G7", "G5"),
        ("G5.4", "G5.1"),
        ("G64.1", "G61.1"),
        ("G61.2", "G61.1"),
        ("G16", "G17"),
        ("M85", "M84"),
        ("M62", "M42"),
        ("M1060", "M106"),
        ("M207", "M20"),
        ("G29", "G2"),
        ("G01.5", "G1"),
    ],
)
def test_unknown_words_get_the_nearest(code: str, near: str) -> None:
    problem = only_problem(code + "\n")
    assert problem.message == f"unknown word {code.replace('01', '1')}"
    assert (problem.hint or "").startswith(f"did you mean {near}")


def test_nearest_is_always_known() -> None:
    assert nearest("G999") in {"G90", "G91", "G92"}
    assert nearest("M").startswith("M")


@pytest.mark.parametrize(
    "code", ["G5.2", "G5.3", "G41", "G42", "G43", "G95", "G96", "M4", "M6 T1", "T1", "T15"]
)
def test_words_refused_with_the_reason(code: str) -> None:
    assert "did you mean" not in (only_problem(code + "\n").hint or "did you mean")


@pytest.mark.parametrize(
    ("line", "at", "says"),
    [
        ("G1 X1e-05 F600", 4, "X1e-05: exponents are not allowed"),
        ("G1 X1E-05 F600", 4, "X1E-05: exponents"),
        ("G1 X1E5 F600", 4, "X1E5: exponents"),
        ("G1X1e5F600", 3, "X1e5: exponents"),
        ("g1x1e-05f600", 3, "x1e-05: exponents"),
        ("G1 X1 E1e-05 F600", 7, "E1e-05: exponents"),
        ("G1X1E2E3F600", 3, "X1E2: exponents"),
        ("G1 Xnan F600", 4, "Xnan is not a number"),
        ("G1 X-inf F600", 4, "X-inf is not a number"),
        ("G1 X1,5 F600", 4, "X1,5 is not a number"),
        ("G1 X1.2.3 F600", 4, "X1.2.3 is not a number"),
        ("G1 X1-2 F600", 4, "X1-2 is not a number"),
        ("G1 X- F600", 4, "X- is not a number"),
        ("G1 X F600", 4, "X has no number"),
        ("G1 X1 F600 X1", 12, "X is given twice"),
        ("G1 F600 X1 F600", 12, "F is given twice"),
        ("G1 Z1 X1 Z1 F600", 10, "Z is given twice"),
        ("G1 K5 F600", 4, "G1 has no word K"),
        ("G90 G21", 5, "two commands in a line: G90 and G21"),
        ("G1 X5 M106 F600", 7, "two commands in a line: G1 and M106"),
        ("X5 Y5", 1, "X without a command"),
        ("N5 X5", 4, "X without a command"),
        ("N G1 X5 F600", 1, "N without a command"),
        ("G X5", 1, "G has no number"),
        ("M-1", 1, "M has no number"),
        ("G1 X1000000000 F600", 4, "too great"),
        ("G1 X1 Y=5 F600", 7, "Y=5 is not a number"),
        ("%", 1, "'%' is not a word"),
        ("G1 X5 (left ( nested ) F600)", 7, "with no ')' after it"),
        ("G1 X5 (left F600", 7, "with no ')' after it"),
        ("G1 X5 left) F600", 11, "with no '(' before it"),
        ("M1O4", 3, "M1 has no word O"),
        ("M220", 5, "M220 needs S"),
        ("N1 G1 X1 F600*", 14, "no checksum after '*'"),
        ("N1 G1 X1 F600*12", 14, "checksum *12 does not fit"),
    ],
)
def test_where_and_why(line: str, at: int, says: str) -> None:
    first = refused(f"G21\n{line}\n").problems[0]
    assert says in first.message
    assert (first.line, first.column) == (2, at)
    assert first.hint


def test_how_to_write_it_is_said() -> None:
    assert "write X0.00001," in (only_problem("G1 X1e-05 F600\n").hint or "")
    assert "point: X1.5" in (only_problem("G1 X1,5 F600\n").hint or "")
    assert only_problem("G1 K1 F600\n").hint == "known: X Y Z E F"
    assert only_problem("G90 X1\n").hint == "it has none"


@pytest.mark.parametrize("line", ["G1X1E5F600", "g1x1e5f600", "G1 X1 E-05 F600", "G1X1.5E-5F600"])
def test_e_after_a_number_is_a_word_where_it_can_be(line: str) -> None:
    assert "move to 1" in shown(read(line + "\n"))[0]


def summed(line: str) -> str:
    return f"{line}*{reduce(xor, line.encode(), 0)}"


def test_checksums() -> None:
    assert shown(read(summed("N12 G1 X1 F600") + " ; sent by a host\n" + summed("G1 X2") + "\n")) == [
        "1 move to 1 0 0 at 10",
        "2 move to 2 0 0 at 10",
    ]
    assert shown(read(summed("N1 M117 5*3") + "\nM117 5*3\n")) == ["1 display '5*3'", "2 display '5*3'"]
    assert read("N5\n  N5 (nothing)\n")[0]
    assert shown(read(summed("N12 (up) G1 X1 F600") + "\n")) == ["1 move to 1 0 0 at 10"]


def test_every_problem_of_the_file_at_once() -> None:
    error = refused("G1 X1 F600\nG6\nG1 X1,5 Y1e-05 F0\nG1 X2\nM9999 \nG2 X50\n")
    assert [(problem.line, problem.column) for problem in error.problems] == [
        (2, 1),
        (3, 4),
        (3, 9),
        (3, 16),
        (5, 1),
        (6, 1),
    ]


def test_a_hundred_are_listed_the_rest_counted() -> None:
    error = refused("G6\n" * 250)
    assert (len(error.problems), error.total) == (100, 250)
    assert isinstance(error, ProgramError)


def test_nothing_of_a_refused_line_is_done() -> None:
    assert refused("G28 G91\nG1 X5 Q1 F600\n").total == 2


def test_words_that_are_not_ascii_are_shown_as_written() -> None:
    assert only_problem("\u00e9t\u00e9 G1\n").message == "'\u00e9t\u00e9' is not a word"
