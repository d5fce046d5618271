"""Problems become lines; neighbours share their hint; only a bug has a traceback."""

import io
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from cdhr_host.cli.refusals import Refusal, RefusingGroup, about, emit, problem_lines, writing
from cdhr_host.errors import CdhrError, DriveError, MotionError, Problem, ProfileError, ProgramError

HINT = "write G1"


def test_a_problem_is_a_line_with_its_place_and_then_its_hint() -> None:
    problem = Problem("word", "unknown word G1O", line=118, column=7, hint=HINT)
    assert list(problem_lines([problem], 1, "ring.gcode")) == [
        "ring.gcode:118:7: error: unknown word G1O",
        "hint: write G1",
    ]


def test_neighbours_share_a_hint() -> None:
    problems = [Problem("word", f"word {n}", line=n, hint=HINT) for n in (1, 2)]
    lines = list(problem_lines([*problems, Problem("feed", "no F", line=3)], 3, "a"))
    assert lines == ["a:1: error: word 1", "a:2: error: word 2", "hint: write G1", "a:3: error: no F"]


def test_problems_beyond_those_listed_are_counted() -> None:
    assert list(problem_lines([Problem("x", "x")], 321, "a"))[-1] == "a: 320 more like these, not listed"


@pytest.mark.parametrize(
    ("error", "code"), [(ProfileError, 3), (ProgramError, 4), (MotionError, 5), (DriveError, 6)]
)
def test_refusals_keep_the_exit_code_of_the_contract(error: type[CdhrError], code: int) -> None:
    with pytest.raises(Refusal, match=r"^file: error: no$") as refused, about("file"):
        raise error("no")
    assert refused.value.exit_code == code


def test_a_disk_that_refuses_is_not_a_bug() -> None:
    with pytest.raises(Refusal, match=r"cannot write run\.csv: No space left"), writing(Path("run.csv")):
        raise OSError(28, "No space left on device")


def failing(error: BaseException) -> typer.Typer:
    app = typer.Typer(cls=RefusingGroup, pretty_exceptions_enable=False)

    @app.command()
    def fail() -> None:
        raise error

    @app.command()
    def other() -> None: ...

    return app


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (MotionError(Problem("reach", "out of reach")), 5, "cdhr: error: out of reach"),
        (Refusal("no such thing"), 2, "no such thing"),
        (KeyboardInterrupt(), 130, "nothing moves"),
    ],
)
def test_the_group_turns_refusals_into_words_and_a_code(error: BaseException, code: int, words: str) -> None:
    result = CliRunner().invoke(failing(error), ["fail"])
    assert (result.exit_code, result.stdout) == (code, "")
    assert words in result.stderr


def test_a_bug_keeps_its_traceback() -> None:
    result = CliRunner().invoke(failing(ZeroDivisionError("bug")), ["fail"])
    assert result.exit_code == 1
    assert isinstance(result.exception, ZeroDivisionError)


def test_standard_output_that_is_full_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    class Full(io.StringIO):
        def flush(self) -> None:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(sys, "stdout", Full())
    with pytest.raises(Refusal, match="standard output: No space left"):
        emit("a result")
    sys.stdout.close()
