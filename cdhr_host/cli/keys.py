"""Keys while a print runs in a terminal: space holds and goes on, + and - change the feed by 10 %."""

import os
import select
import sys
import termios
import tty
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING, Final, Self

if TYPE_CHECKING:
    from cdhr_host.job.printer import Printer

STEP: Final = 0.1
"""of the programmed feed"""
AT_ONCE: Final = 1024
"""bytes of keys taken at once: text that Python buffered would not be seen by ``select``"""


class Keys:
    """Single keys of a terminal; none where standard input is something else."""

    def __init__(self) -> None:
        self._before: list[int | list[bytes | int]] | None = None

    def obey(self, printer: "Printer") -> None:
        """Do what the keys pressed since the last call ask for, where that is possible."""
        while self._before is not None and select.select([sys.stdin], [], [], 0.0)[0]:
            if not (keys := _pressed()):
                return
            for _ in range(keys.count(b" ")):
                _hold_or_go_on(printer)
            if steps := keys.count(b"+") - keys.count(b"-"):
                _faster(printer, steps * STEP)

    def __enter__(self) -> Self:
        if sys.stdin.isatty():
            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None:
            with suppress(termios.error):  # a terminal that is gone needs no restoring
                termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)


def _pressed() -> bytes:
    """Keys that wait; none where the terminal is gone, which is told by a signal of its own."""
    try:
        return os.read(sys.stdin.fileno(), AT_ONCE)
    except OSError:
        return b""


def _hold_or_go_on(printer: "Printer") -> None:
    from cdhr_host.job.states import Word, can

    if can(printer.state, Word.RESUME) and printer.pause is None:
        printer.resume()
    elif can(printer.state, Word.HOLD):
        printer.hold("space goes on")


def _faster(printer: "Printer", by: float) -> None:
    from cdhr_host.job.printer import LEAST, MOST

    feed = printer.status().feed_override + by
    printer.override(feed=round(min(max(feed, LEAST, STEP), MOST), 2))
