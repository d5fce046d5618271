"""One reading of a text: rows that wait, commands that are ready, problems that were found."""

from collections.abc import Sequence
from dataclasses import replace

from cdhr_host.errors import MAX_LISTED, Problem
from cdhr_host.profile.schema import Profile
from cdhr_host.program.block import Block
from cdhr_host.program.modal import Modal
from cdhr_host.program.straight import BATCH, Row, Steps, has_feed, has_travel, interpret, resolve
from cdhr_host.units import MM
from cdhr_host.values import Command, Moves, Notice


class Run:
    """What the words of the table act on."""

    def __init__(self, profile: Profile, modal: Modal) -> None:
        self.profile = profile
        self.modal = modal
        self.ready: list[Command] = []
        self.problems: list[Problem] = []
        self.total = 0
        self.lost = False
        """a refused move has left the position unknown"""
        self.unfed = modal.feed is None
        """no F has been read yet"""
        self._rows: list[Row] = []
        self._lines: list[int] = []

    def refuse(self, problem: Problem) -> None:
        """Note a reason to refuse the text; from now on no command is made."""
        self.total += 1
        if len(self.problems) < MAX_LISTED:
            self.problems.append(problem)

    def emit(self, *commands: Command) -> None:
        """Commands, after the rows that wait."""
        self.flush()
        self._put(commands)

    def warn(self, key: str, line: int, text: str) -> None:
        """Tell the operator something once in a program."""
        self.flush()
        self._warn(key, line, text)

    def straight(self, rows: Sequence[Row], lines: Sequence[int], column: int = 1) -> None:
        """Rows of G0 and G1 that follow one another; ``column`` is that of their first word."""
        if self.unfed:
            self._need_feed(rows, lines, column)
        self._rows.extend(rows)
        self._lines.extend(lines)
        while len(self._rows) >= BATCH:
            self._interpret(BATCH)

    def flush(self) -> None:
        """Make commands of the rows that wait."""
        if self._rows:
            self._interpret(len(self._rows))

    def take(self) -> list[Command]:
        """The commands that are ready."""
        ready, self.ready = self.ready, []
        return ready

    def step(self, row: Row, line: int) -> tuple[Steps, float]:
        """Resolve one row that is not straight, after those that wait: (steps, speed in m/s)."""
        self.flush()
        steps = resolve(self.modal, [row])
        speed = float(steps.feed[0]) * self.modal.speed_factor
        self._warn_fast(line, speed)
        return replace(steps, modal=replace(steps.modal, warned=self.modal.warned)), speed

    def refuse_word(self, block: Block, letter: str, message: str, limit: str, hint: str) -> None:
        """Note a number that is out of its range."""
        word = block.word(letter)
        self.refuse(
            Problem("range", message, block.line, word.column, value=word.value, limit=limit, hint=hint)
        )

    def _put(self, commands: Sequence[Command]) -> None:
        if not self.problems:
            self.ready.extend(commands)

    def _warn(self, key: str, line: int, text: str) -> None:
        if key not in self.modal.warned:
            self._put([Notice(line, "warning", text)])
            self.modal = replace(self.modal, warned=self.modal.warned | {key})

    def _interpret(self, count: int) -> None:
        rows, self._rows = self._rows[:count], self._rows[count:]
        lines, self._lines = self._lines[:count], self._lines[count:]
        self.modal, commands = interpret(self.modal, rows, lines, self.profile.limits.speed_max)
        for command in commands:
            if isinstance(command, Moves):
                at = int(command.speed.argmax())
                self._warn_fast(int(command.line[at]), float(command.speed[at]))
            self._put([command])
        self.lost = self.lost and not (any(row[3] for row in rows) and any(row[4] for row in rows))

    def _warn_fast(self, line: int, speed: float) -> None:
        limit = self.profile.limits.speed_max
        if speed > limit * (1 + 1e-9):
            self._warn(
                "fast",
                line,
                f"{speed / MM:g} mm/s is asked for, the machine's greatest speed is {limit / MM:g} mm/s: "
                "faster moves are planned at that",
            )

    def _need_feed(self, rows: Sequence[Row], lines: Sequence[int], column: int) -> None:
        """Refuse the first row that needs an F when none was given; only that one."""
        for row, line in zip(rows, lines, strict=True):
            moves, given = has_travel(row), has_feed(row)
            needed = row[6] or (row[0] == "1" and moves)
            if needed and not given:
                self.refuse(missing_feed(line, column))
            if needed or given:
                self.unfed = False
                return


def missing_feed(line: int, column: int) -> Problem:
    """The problem of a move without a speed."""
    return Problem(
        "feed",
        "no speed has been given yet",
        line,
        column,
        hint="give the first G1 an F in units per minute, such as F1200",
    )
