"""A pseudo-terminal in the test's own hands: it can stall, and it can be closed."""

import fcntl
import os
import select
import subprocess
import sys
import termios
import time
from pathlib import Path
from types import TracebackType
from typing import Self

ROOT = Path(__file__).parents[2]
PATIENCE = 150.0
"""s until something that should happen is given up"""


class Pseudo:
    """``cdhr`` with a terminal of 80 x 24; ``controlling`` says whether it hears SIGHUP when that closes."""

    def __init__(self, folder: Path, arguments: list[str], *, controlling: bool = True) -> None:
        self.near, far = os.openpty()
        termios.tcsetwinsize(far, (24, 80))
        self.seen = ""

        plain = {"NO_COLOR": "1", "TERM": "xterm", "XDG_STATE_HOME": str(folder / "state")}
        self.process = subprocess.Popen(
            ["setsid", *(["--ctty"] if controlling else []), sys.executable, "-m", "cdhr_host", *arguments],
            stdin=far,
            stdout=far,
            stderr=far,
            env={**os.environ, **plain, "PYTHONPATH": str(ROOT)},
        )
        os.close(far)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
        self.process.kill()
        self.process.wait()

    def shows(self, text: str) -> None:
        """Wait until this was drawn, in one piece."""
        given_up = time.monotonic() + PATIENCE
        while text not in self.seen:
            assert time.monotonic() < given_up, self.seen
            if select.select([self.near], [], [], 0.1)[0]:
                self.seen += os.read(self.near, 65536).decode("utf-8", "replace")

    def type(self, text: str) -> None:
        os.write(self.near, text.encode())

    def stalls(self) -> None:
        """Wait until nothing more goes into the terminal, which nobody reads."""
        before = -1
        while (there := self._waiting) != before:
            before = there
            time.sleep(1.0)

    @property
    def _waiting(self) -> int:
        """Bytes drawn and not read."""
        return int.from_bytes(fcntl.ioctl(self.near, termios.FIONREAD, bytes(4)), sys.byteorder)

    def close(self) -> None:
        if self.near >= 0:
            os.close(self.near)
            self.near = -1

    @property
    def code(self) -> int:
        return self.process.wait(PATIENCE)
