"""One interpreter over several texts: state goes on, a refused text leaves no trace."""

import pytest
from program_reading import PAPER_WIDE, moves, shown, warnings

from cdhr_host.errors import ProgramError
from cdhr_host.program import Interpreter
from cdhr_host.values import Command


def test_state_and_line_numbers_go_on() -> None:
    interpreter = Interpreter(PAPER_WIDE)
    list(interpreter.commands([b"G91\nM83\nG1 X5 F600\n"]))
    assert interpreter.lines == 3
    assert shown(interpreter.commands([b"G1 X5 E1\n"])) == ["4 move to 10 0 0 at 10 clay 1"]
    assert interpreter.lines == 4


def test_a_refused_text_leaves_the_state_as_it_was() -> None:
    interpreter = Interpreter(PAPER_WIDE)
    list(interpreter.commands([b"G1 X5 F600\n"]))
    before = interpreter.modal
    with pytest.raises(ProgramError):
        list(interpreter.commands([b"G91\nG20\n;TYPE:x\nG1 X7\nG6\n"]))
    assert interpreter.modal == before
    assert shown(interpreter.commands([b"G1 Y1\n"])) == ["2 move to 5 1 0 at 10"]


def test_a_text_left_half_read_leaves_the_state_as_it_was() -> None:
    interpreter = Interpreter(PAPER_WIDE)
    commands = interpreter.commands([b"G1 X5 F600\nM400\nG1 X6\n"])
    next(iter(commands))
    assert interpreter.lines == 3
    commands.close()  # type: ignore[attr-defined]
    assert interpreter.lines == 0
    assert moves(interpreter.commands([b"G1 Y1 F60\n"])) == [[0, 1, 0]]


def test_the_end_of_one_text_is_not_that_of_the_next() -> None:
    interpreter = Interpreter(PAPER_WIDE)
    list(interpreter.commands([b"M2\n"]))
    assert moves(interpreter.commands([b"G1 Y1 F60\n"])) == [[0, 1, 0]]


def test_a_feed_is_remembered_and_warnings_are_given_once() -> None:
    interpreter = Interpreter(PAPER_WIDE)
    assert len(warnings(interpreter.commands([b"G1 X5 F60000\n"]))) == 1
    assert warnings(interpreter.commands([b"G1 X6\n"])) == []


def test_nothing_is_yielded_from_the_first_problem_on() -> None:
    yielded: list[Command] = []
    commands = Interpreter(PAPER_WIDE).commands([b"G1 X5 F600\nM400\nG1 X6\nG6\nM400\nG1 X7\n"])
    with pytest.raises(ProgramError):
        yielded.extend(commands)
    assert shown(yielded) == ["1 move to 5 0 0 at 10", "2 stop"]
