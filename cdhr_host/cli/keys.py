"""Keys while a print runs in a terminal: space holds and goes on, + and - change the feed by 10 %."""

import select
import sys
import termios
import tty
from types import TracebackType
from typing import TYPE_CHECKING, Final, Self

if TYPE_CHECKING:
    from cdhr_host.job.printer import Printer

STEP: Final = 0.1
"""of the programmed feed"""


class Keys:
    """Single keys of a terminal; none where standard input is something else."""

    def __init__(self) -> None:
        self._before: list[int | list[bytes | int]] | None = None

    def obey(self, printer: "Printer") -> None:
        """Do what the keys pressed since the last call ask for, where that is possible."""
        from cdhr_host.job.states import Word, can

        while self._before is not None and select.select([sys.stdin], [], [], 0.0)[0]:
            key = sys.stdin.read(1)
            if key == " " and can(printer.state, Word.RESUME) and printer.pause is None:
                printer.resume()
            elif key == " " and can(printer.state, Word.HOLD):
                printer.hold("space goes on")
            elif key in {"+", "-"}:
                _faster(printer, STEP if key == "+" else -STEP)
            elif not key:
                return

    def __enter__(self) -> Self:
        if sys.stdin.isatty():
            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)


def _faster(printer: "Printer", by: float) -> None:
    from cdhr_host.job.printer import LEAST, MOST

    feed = printer.status().feed_override + by
    printer.override(feed=round(min(max(feed, LEAST, STEP), MOST), 2))
