"""A real terminal: tmux on a server of its own, 80 x 24, without colour."""

import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

ROOT = Path(__file__).parents[2]
TMUX = shutil.which("tmux")
PATIENCE = 150.0
"""s until something that should happen is given up"""
LOOK = 0.1


def until(happened: Callable[[], bool], told: Callable[[], str]) -> None:
    given_up = time.monotonic() + PATIENCE
    while not happened():
        assert time.monotonic() < given_up, told()
        time.sleep(LOOK)


class Terminal:
    """One ``cdhr`` command in it; ``code`` once it has ended."""

    def __init__(self, folder: Path, arguments: list[str]) -> None:
        self._folder = folder
        self._ended, self._process = folder / "ended", folder / "process"
        environment = [f"PYTHONPATH={ROOT}", "NO_COLOR=1", f"XDG_STATE_HOME={folder / 'state'}"]
        command = shlex.join(["env", *environment, sys.executable, "-m", "cdhr_host", *arguments])
        started = f"sh -c 'echo $$ > process; exec \"$@\"' sh {command}"
        self._script = f"{started}; echo $? > ended.part; mv ended.part ended; sleep 600"

    def __enter__(self) -> Self:
        size = ["-x", "80", "-y", "24"]
        shell = ["bash", "-c", self._script]
        self._tmux("-f", "/dev/null", "new-session", "-d", *size, "-c", str(self._folder), *shell)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._tmux("kill-server", check=False)

    def keys(self, *names: str) -> None:
        self._tmux("send-keys", *names)

    def type(self, text: str) -> None:
        self._tmux("send-keys", "-l", text)

    @property
    def screen(self) -> str:
        return self._tmux("capture-pane", "-p", check=False)

    def shows(self, *texts: str) -> None:
        """Wait until all of these are on the screen."""
        until(lambda: all(text in self.screen for text in texts), lambda: f"{texts}\n{self.screen}")

    def close(self) -> None:
        """The terminal is gone: its programs hear SIGHUP."""
        self._tmux("kill-session")

    @property
    def process(self) -> int:
        return int(self._process.read_text())

    @property
    def code(self) -> int:
        until(self._ended.exists, lambda: self.screen)
        return int(self._ended.read_text())

    def _tmux(self, *words: str, check: bool = True) -> str:
        assert TMUX is not None
        socket = str(self._folder / "tmux")
        done = subprocess.run(
            [TMUX, "-S", socket, *words], capture_output=True, encoding="utf-8", check=check
        )
        return done.stdout
