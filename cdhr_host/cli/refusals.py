"""What ends a command early: one place turns every refusal into words and an exit code."""

import sys
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import Any

from typer import Exit
from typer.core import TyperGroup

from cdhr_host.errors import CdhrError, Problem

ROOM = "make room or mend it, or name a file elsewhere; what was there before is untouched"
USAGE = 2
INTERRUPTED = 130


class Refusal(Exception):  # noqa: N818 - not an error of the program
    """Words for standard error, and the exit code."""

    def __init__(self, text: str, exit_code: int = USAGE) -> None:
        super().__init__(text)
        self.exit_code = exit_code


def place(problem: Problem, source: str) -> str:
    """``file``, ``file:line`` or ``file:line:column``."""
    parts = [source, *(str(number) for number in (problem.line, problem.column) if number is not None)]
    return ":".join(parts)


def problem_lines(problems: Sequence[Problem], total: int, source: str, kind: str = "error") -> Iterator[str]:
    """One line a problem; a hint shared by neighbours stands once, after the last of them."""
    for problem, following in zip_longest(problems, problems[1:]):
        yield f"{place(problem, source)}: {kind}: {problem.message}"
        if problem.hint and (following is None or following.hint != problem.hint):
            yield f"hint: {problem.hint}"
    if total > len(problems):
        yield f"{source}: {total - len(problems)} more like these, not listed"


@contextmanager
def about(source: str) -> Iterator[None]:
    """Refusals raised inside are about this file."""
    try:
        yield
    except CdhrError as error:
        raise Refusal(
            "\n".join(problem_lines(error.problems, error.total, source)), error.exit_code
        ) from error


@contextmanager
def writing(path: Path, consequence: str = "") -> Iterator[None]:
    """A disk that refuses while this file is written is the user's to mend, not a bug."""
    try:
        yield
    except OSError as error:
        said = f"cdhr: error: cannot write {path}: {error.strerror or error}{consequence}"
        raise Refusal(f"{said}\nhint: {ROOM}") from error


def check_file(path: Path, suffixes: Collection[str], option: str) -> None:
    """Refuse a file that could not be written, before any work."""
    from cdhr_host.report.files import TargetError, check_place

    try:
        check_place(path, suffixes)
    except TargetError as error:
        raise Refusal(f"cdhr: error: {option} {path}: {error}") from error


def check_picture(path: Path | None, option: str) -> None:
    """Refuse a picture that could not be drawn, before any work; nothing where none is wanted."""
    from cdhr_host.report.files import PICTURES
    from cdhr_host.report.plot.write import available

    if path is None:
        return
    if not available():
        raise Refusal("cdhr: error: pictures need matplotlib\nhint: python3 -m pip install 'cdhr-host[plot]'")
    check_file(path, PICTURES, option)


def say(text: str) -> None:
    """A line for the person at the terminal: standard error."""
    print(text, file=sys.stderr, flush=True)


def emit(text: str) -> None:
    """A result: standard output; raises Refusal when nobody takes it."""
    try:
        print(text, flush=True)
    except OSError as error:
        sys.stdout = open("/dev/null", "w")  # noqa: SIM115 - what is still in the buffer has nowhere to go
        raise Refusal(f"cdhr: error: cannot write to standard output: {error.strerror}") from error


class RefusingGroup(TyperGroup):
    """A group of commands whose refusals end in words and an exit code; a bug keeps its traceback."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command; raises Exit with the code of the contract."""
        try:
            with about("cdhr"):
                return super().invoke(ctx)
        except Refusal as refusal:
            say(str(refusal))
            raise Exit(refusal.exit_code) from None
        except KeyboardInterrupt:
            say("cdhr: interrupted; nothing moves")
            raise Exit(INTERRUPTED) from None
