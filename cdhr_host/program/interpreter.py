"""A program's text -> commands, line after line."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from cdhr_host.errors import Problem, ProgramError
from cdhr_host.profile.schema import Profile
from cdhr_host.program.comments import comment
from cdhr_host.program.modal import Laying, Metadata, Modal
from cdhr_host.program.parse import parse_line
from cdhr_host.program.run import Run
from cdhr_host.program.straight import Row
from cdhr_host.program.text import Piece, pieces
from cdhr_host.program.words import WORDS
from cdhr_host.values import Array, Command

_NUMBER: Final = r"([-+]?(?:[0-9]{1,9}+(?:\.[0-9]{0,15}+)?|\.[0-9]{1,15}+))"
_SPEED: Final = r" ++F((?=[0-9.]*[1-9])(?:[0-9]{1,9}+(?:\.[0-9]{0,15}+)?|\.[0-9]{1,15}+))"
_LINE: Final = re.compile(
    rf"(?:G0?([01])(?:{_SPEED})?(?: ++Z{_NUMBER})?(?: ++X{_NUMBER})?(?: ++Y{_NUMBER})?"
    rf"(?(3)|(?: ++Z{_NUMBER})?)(?: ++E{_NUMBER})?(?(2)|(?:{_SPEED})?) *+(?:;[^\n]*+)?|([^\n]*+))\n"
)
"""Every line is one match: the columns of a plain G0 or G1 as slicers write it, or the whole
line as the last group, for the parser."""


class Interpreter:
    """Modal state of one program, threaded through; pure.

    It starts as G21 G90 M82 with no F, at ``at_G`` (m; default program 0, the reference pose).
    """

    def __init__(self, profile: Profile, *, at_G: Array | None = None) -> None:
        x, y, z = (0.0, 0.0, 0.0) if at_G is None else at_G.tolist()
        extruder = profile.extruder
        self.profile = profile
        self.modal = Modal(
            (x, y, z),
            volumetric=extruder.e_unit == "mm3",
            filament_diameter=extruder.filament_diameter,
            laying=Laying.of(profile.bead),
        )

    @property
    def lines(self) -> int:
        """Lines read so far."""
        return self.modal.lines

    @property
    def metadata(self) -> Metadata:
        """The latest of what the slicer says in comments."""
        return self.modal.metadata

    def commands(self, chunks: Iterable[bytes]) -> Iterator[Command]:
        """Text in blocks of any size -> commands in program order.

        Raises ProgramError with every problem of the text, after reading all of it; from the
        first problem on no command is yielded. Then, and when the iterator is closed early,
        the modal state is what it was before. Called again with further text, modal state
        and line numbers go on.
        """
        before = self.modal
        run = Run(self.profile, replace(before, ended=False))
        try:
            for command in _read(run, chunks):
                self.modal = run.modal
                yield command
            if run.problems:
                raise ProgramError(run.problems, total=run.total)
        except BaseException:
            self.modal = before
            raise
        self.modal = run.modal


def plain(line: str) -> Row | None:
    """The row of a G0 or G1 as slicers write it, without its line end; None for any other line."""
    found = _LINE.fullmatch(f"{line}\n")
    return found.groups("") if found is not None and found[1] else None


def _read(run: Run, chunks: Iterable[bytes]) -> Iterator[Command]:
    """Commands until the first problem; the run holds problems and modal state."""
    seen = False
    for piece in pieces(chunks, run.modal.lines + 1):
        if isinstance(piece, Problem):
            if not run.modal.ended:
                run.refuse(piece)
            continue
        seen = _piece(run, piece) or seen
        run.modal = replace(run.modal, lines=piece.first_line - 1 + piece.text.count("\n"))
        yield from run.take()
    if not seen and not run.problems:
        run.warn("empty", run.modal.lines, "the text holds no command")
    run.flush()
    yield from run.take()


def _piece(run: Run, piece: Piece) -> bool:
    """Act on whole lines; says whether there was any command."""
    found: list[Row] = _LINE.findall(piece.text)
    others = [at for at, row in enumerate(found) if not row[0]]
    first = 0
    seen = len(others) < len(found)
    for at in [*others, len(found)]:
        if first < at:
            _straight(run, found, first, at, piece.first_line)
        if at < len(found):
            seen = _line(run, found[at][-1], piece.first_line + at) or seen
        first = at + 1
    return seen


def _straight(run: Run, found: Sequence[Row], first: int, last: int, first_line: int) -> None:
    if run.modal.ended:
        _after_end(run, first_line + first)
    else:
        run.straight(found[first:last], range(first_line + first, first_line + last))


def _line(run: Run, text: str, line: int) -> bool:
    """Act on one line; says whether it held a command or a problem."""
    bare = text.strip(" \t")
    if not bare:
        return False
    if bare[0] == ";":
        if not run.modal.ended:
            comment(run, bare[1:], line)
        return False
    if run.modal.ended:
        _after_end(run, line)
        return True
    block, problems = parse_line(text, line)
    for problem in problems:
        run.refuse(problem)
    if block is not None:
        WORDS[block.code].act(run, block)
    elif problems:
        _refused(run, text)
    return block is not None or bool(problems)


def _refused(run: Run, text: str) -> None:
    """A refused line leaves unknown what it would have set: later lines are not blamed for it."""
    letters = set(text.upper())
    if "F" in letters:
        run.unfed = False
    if letters & {"X", "Y"}:
        run.flush()
        run.lost = True


def _after_end(run: Run, line: int) -> None:
    run.warn("after end", line, f"the program has ended: line {line} and what follows is ignored")
