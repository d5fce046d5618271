"""Commands of one reading of a text, kept while someone may still have to plan them again."""

from collections import deque
from collections.abc import Generator, Iterator

from cdhr_host.values import Command


class Tape:
    """Commands by their number in the text; reads on when asked for one that is not there yet."""

    def __init__(self, commands: Iterator[Command]) -> None:
        self._commands = commands
        self._kept: deque[Command] = deque()
        self._first = 0
        self._over = False

    def at(self, index: int) -> Command | None:
        """The command of this number; None after the last. Raises ProgramError like the reading."""
        while not self._over and index >= self._first + len(self._kept):
            command = next(self._commands, None)
            if command is None:
                self._over = True
            else:
                self._kept.append(command)
        place = index - self._first
        return self._kept[place] if place < len(self._kept) else None

    def close(self) -> None:
        """Read no further."""
        self._over = True
        if isinstance(self._commands, Generator):
            self._commands.close()

    def forget(self, before: int) -> None:
        """Commands below this number are not asked for any more."""
        while self._kept and self._first < before:
            self._kept.popleft()
            self._first += 1
