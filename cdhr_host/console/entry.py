"""The line a person types: history, and completion from the table of words."""

import os
from pathlib import Path
from typing import Final

from textual.suggester import Suggester

from cdhr_host.program import WORDS

KEPT: Final = 500
"""lines of history"""


def history_file() -> Path:
    """``$XDG_STATE_HOME/cdhr/history``."""
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "cdhr" / "history"


class History:
    """Lines typed before, over sessions."""

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self.lines = path.read_text(encoding="utf-8").splitlines()[-KEPT:]
        except (OSError, UnicodeDecodeError):
            self.lines = []  # a history that cannot be read is only a comfort lost
        self._at = len(self.lines)

    def add(self, line: str) -> None:
        """A line was run."""
        if not self.lines or self.lines[-1] != line:
            self.lines.append(line)
        self.lines = self.lines[-KEPT:]
        self._at = len(self.lines)

    def step(self, by: int) -> str:
        """An older (-1) or younger (+1) line; empty beyond the youngest."""
        self._at = min(max(self._at + by, 0), len(self.lines))
        return self.lines[self._at] if self._at < len(self.lines) else ""

    def save(self) -> None:
        """Keep it for the next session; raises OSError."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._path.write_text("\n".join(self.lines[-KEPT:]) + "\n", encoding="utf-8")


class WordSuggester(Suggester):
    """Completes the word at the start of a line, then a line typed before."""

    def __init__(self, history: History) -> None:
        super().__init__(use_cache=False, case_sensitive=True)
        self._history = history

    async def get_suggestion(self, value: str) -> str | None:
        """The youngest line that begins so, else the first known word that does."""
        if not value:
            return None
        typed = next((line for line in reversed(self._history.lines) if line.startswith(value)), None)
        return typed or next((code for code in WORDS if code.startswith(value.upper())), None)
