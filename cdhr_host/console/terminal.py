"""The terminal a desk is drawn on. It may stall, stop or vanish; the program must not wait for it."""

import os
import select
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Final, cast

from textual.drivers.linux_driver import LinuxDriver

if TYPE_CHECKING:
    from typing import Any, TextIO

GONE: Final = select.POLLHUP | select.POLLERR | select.POLLNVAL


class Canvas:
    """A file for Textual's writer, whose thread must never end: its queue would fill and block the desk.

    Once the terminal refuses, what is drawn is let go. Nothing stays in a buffer, which would fail
    again when the program ends.
    """

    def __init__(self, file: "TextIO") -> None:
        self._number = file.fileno()
        self._gone = False

    def write(self, text: str) -> int:
        """All of it, or none of it any more."""
        left = memoryview(text.encode("utf-8", "replace"))
        try:
            while left and not self._gone:
                left = left[os.write(self._number, left) :]
        except OSError:
            self._gone = True
        return len(text)

    def flush(self) -> None:
        """Nothing is kept back."""

    def fileno(self) -> int:
        """The terminal."""
        return self._number


class Terminal(LinuxDriver):
    """Textual's terminal, that can be lost."""

    def __init__(self, *words: "Any", **more: "Any") -> None:
        super().__init__(*words, **more)
        assert sys.__stderr__ is not None
        self._file = cast("Any", Canvas(sys.__stderr__))

    def run_input_thread(self) -> None:
        """Keys, as long as there is a keyboard; the desk sees by itself that it is gone."""
        with suppress(OSError):
            super().run_input_thread()

    def _sigtstp_application(self, *_: object) -> None:
        """A desk is not put into the background: a machine hangs on it."""

    def _sigcont_application(self, *_: object) -> None:
        """Stopped all the same, or hung up: begin anew, between two events, never in the middle of one."""
        self._app.call_later(self._again)

    def _again(self) -> None:
        if not hung_up():
            self.suspend_application_mode()
            self._must_signal_resume = True
            self.resume_application_mode()
            self._app.refresh(layout=True)


def hung_up() -> bool:
    """Whether the other end of standard input is closed: no key will ever come."""
    poll = select.poll()
    poll.register(0)
    return any(event & GONE for _, event in poll.poll(0))
