"""G0, G1: coordinates, feeds, units, distances."""

from itertools import pairwise

import numpy as np
import pytest
from program_reading import PAPER_WIDE, column, moves, only_problem, profile, read, refused, shown, warnings

from cdhr_host.values import Moves, Notice


@pytest.mark.parametrize(
    "line",
    [
        "G1 X1.5 Y-.5 Z10 F1200",
        "g1 x1.5 y-.5 z10 f1200",
        "G01 X1.5 Y-0.50 Z10. F1200.000",
        "G1X1.5Y-.5Z+10F1200",
        "G1 F1200 X1.5 Y-.5 Z10",
        "G1 Z10 X1.5 Y-.5 F1200",
        "  \tG1  X1.5\tY-.5   Z10  F1200  ",
        "G 1 X 1.5 Y -.5 Z 10 F 1200",
        "G1 X1.5 (right) Y-.5 Z10 F1200 ; up (and away",
        "N7 G1 X1.5 Y-.5 Z10 F1200",
        "G1.0 X001.5 Y-.5 Z10 F1200",
        "G0 X1.5 Y-.5 Z10 F1200",
        "G00 X1.5 Y-.5 Z10 F1200;",
    ],
)
def test_ways_to_write_the_same_move(line: str) -> None:
    assert shown(read(line + "\n")) == ["1 move to 1.5 -0.5 10 at 20"]


def test_moves_are_batched_and_joined() -> None:
    text = "".join(f"G1 X{n} F600\n" for n in range(1, 2501))
    batches = [item for item in read(text) if isinstance(item, Moves)]
    assert [len(batch.line) for batch in batches] == [1024, 1024, 452]
    assert batches[0].start_G.tolist() == [0, 0, 0]
    for before, after in pairwise(batches):
        assert before.end_G[-1].tolist() == after.start_G.tolist()
    assert np.concatenate([batch.line for batch in batches]).tolist() == list(range(1, 2501))


def test_arrays_are_read_only() -> None:
    batch = read("G1 X1 F600\n")[0]
    assert isinstance(batch, Moves)
    for name in ("line", "start_G", "end_G", "speed", "clay", "air"):
        assert not getattr(batch, name).flags.writeable


def test_moves_of_no_length_vanish() -> None:
    assert read("G1 X0 Y0 F600\nG1\nG0 Z0\nG21\n") == []


def test_g92_and_g91_leave_no_rounding_behind() -> None:
    text = "G1 X86.894 F600\nG92 X0.3\nG1 X0.3\nG91\nG1 X.1\nG1 X.2\nG1 X-.3\nG90\nG1 X0.3\n"
    assert moves(read(text)) == [[86.894, 0, 0], [86.994, 0, 0], [87.194, 0, 0], [86.894, 0, 0]]


def test_start_pose_is_given() -> None:
    assert moves(read("G1 Y5 F60\n", at=(1, 2, 3))) == [[1, 5, 3]]


def test_feed_is_modal_and_shared_by_g0_and_g1() -> None:
    text = "G0 X1\nG0 X2 F600\nG1 X3\nG1 F1200\nG0 X4\n"
    assert column(read(text), "speed", 1e-3) == [100, 10, 10, 20]


def test_a_first_g1_without_feed_is_refused_once() -> None:
    problem = only_problem("G0 X1\n  G1 X2\nG1 X3\nG2 X4 I.5\n")
    assert (problem.line, problem.column, problem.kind) == (2, 3, "feed")
    assert "F1200" in (problem.hint or "")


@pytest.mark.parametrize(
    "line", ["G1 E5", "G0 E5", "G0 X0 E1 Y0 Z0", "G0 X5 E5", "G1 X1 E5", "g1 x1", "G2 X2 I1"]
)
def test_what_needs_a_feed(line: str) -> None:
    assert only_problem(line + "\n").kind == "feed"


def test_feed_of_a_refused_line_is_not_missed() -> None:
    assert refused("G1 X1,5 F600\nG1 X2\nG3 X0 I-1\n").total == 1


@pytest.mark.parametrize("feed", ["0", "-5", "0.000", "-0", "0.0000000000000000"])
def test_feed_must_be_positive(feed: str) -> None:
    problem = only_problem(f"G1 X1 F{feed}\nG1 X2\n")
    assert (problem.kind, problem.line, problem.column, problem.limit) == ("feed", 1, 7, 0.0)


def test_feed_above_the_machine_is_told_once() -> None:
    commands = read("G1 X1 F6000\nG1 X2 F6001\nG1 X3 F9000\nG21\nG1 X4\nG2 X4 I5\n")
    assert len(warnings(commands)) == 1
    assert "150 mm/s" in warnings(commands)[0]
    assert isinstance(commands[0], Notice)
    assert commands[0].line == 3
    assert column(commands, "speed", 1e-3) == [100, 100.016666667, 150, 150]


def test_inches() -> None:
    commands = read("G20\nG1 X1 Y-.5 F60\nG20\nG21\nG1 X1 F60\n")
    assert moves(commands) == [[25.4, -12.7, 0], [1, -12.7, 0]]
    assert column(commands, "speed", 1e-3) == [25.4, 1]
    assert len(warnings(commands)) == 1


def test_relative_distances_leave_e_alone() -> None:
    commands = read("G91\nG1 X1 Y1 E1 F600\nG1 X1 E2\nG1 Z1\nG90\nG1 X5 E4\n")
    assert moves(commands) == [[1, 1, 0], [2, 1, 0], [2, 1, 1], [5, 1, 1]]
    assert column(commands, "clay", 1e-9) == [1, 1, 0, 2]


def test_g92_alone_means_zeros() -> None:
    text = "G1 X5 Y5 Z5 E5 F600\nG92\nG1 X1 E1\nG92 X5\nG1 X0\n"
    commands = read(text)
    assert moves(commands) == [[5, 5, 5], [6, 5, 5], [1, 5, 5]]
    assert column(commands, "clay", 1e-9) == [5, 1, 0]


def test_speed_factor() -> None:
    commands = read("M220 S50\nG1 X1 F1200\nM220 S300\nG1 X2\nG1 E5\n")
    assert column(commands, "speed", 1e-3) == [10, 60]
    assert shown(commands)[-1] == "5 prime clay 5 at 60"


@pytest.mark.parametrize("code", ["M220", "M221"])
@pytest.mark.parametrize("percent", ["0", "-1", "0.99", "300.1"])
def test_factors_have_a_range(code: str, percent: str) -> None:
    problem = only_problem(f"{code} S{percent}\n")
    assert (problem.kind, problem.limit, problem.value) == ("range", "1..300", float(percent))


def test_machine_speed_is_that_of_the_profile() -> None:
    slow = profile(limits={"speed_max_mm_s": 7.0})
    assert column(read("G0 X1\n", slow), "speed", 1e-3) == [7]
    assert PAPER_WIDE.limits.speed_max == pytest.approx(0.1)
