"""``cdhr jog``: move the machine by keys and typed G-code."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import typer

from cdhr_host.cli.interrupt import StopRequest
from cdhr_host.cli.machine import SIMULATED, open_machine, opened
from cdhr_host.cli.options import DrivesUrl, MaterialName, ProfileName, Speed, examples
from cdhr_host.cli.refusals import INTERRUPTED, Refusal, emit
from cdhr_host.errors import CdhrError

if TYPE_CHECKING:
    from cdhr_host.job.printer import Printer

EXAMPLES = examples(
    "cdhr jog",
    "cdhr jog --profile paper-wide",
    "printf 'G1 X10 F600\\nG28\\n' | cdhr jog",
)
LOOK = 0.05
"""s between two looks at a request to stop"""


def jog(
    *,
    profile: ProfileName = "paper",
    material: MaterialName = None,
    drives: DrivesUrl = SIMULATED,
    speed: Speed = 1.0,
) -> None:
    """Jog: a screen with keys and typed G-code on a terminal; lines of G-code from a pipe.

    On a terminal ? shows the keys, and Ctrl-C holds. From a pipe each line is proven before it
    moves and answered with ok and the position, or with its refusal; the exit code is that of the
    first refusal, and Ctrl-C stops on the path.
    """
    from cdhr_host.job.printer import Printer
    from cdhr_host.job.recorder import Names, Recorder

    machine = open_machine(profile, material)
    has_screen = _has_screen()
    link, clock = opened(drives, machine, speed)
    try:
        printer = Printer(link, clock, recorder=Recorder(link, Names(profile, material, drives)))
        printer.begin()
        try:
            code = _screen(printer) if has_screen else _lines(printer)
        finally:
            printer.close()
    finally:
        link.close()
    raise typer.Exit(code)


def _has_screen() -> bool:
    """Whether a person sits there; raises Refusal where the screen would go into a file."""
    if sys.stdin.isatty() and not sys.stderr.isatty():
        raise Refusal(
            "cdhr: error: the screen is drawn on standard error, which is no terminal\n"
            "hint: do not redirect it, or pipe lines of G-code in"
        )
    return sys.stdin.isatty()


def _screen(printer: "Printer") -> int:
    """Keys, until the operator quits or the terminal is gone; refusals were shown."""
    from cdhr_host.console.desk import Desk
    from cdhr_host.console.terminal import hung_up

    with StopRequest() as stop:

        def should_stop() -> bool:
            return stop() or hung_up()

        with _resting(printer, should_stop):
            desk = Desk(printer, should_stop=should_stop)
            desk.run()
            return INTERRUPTED if should_stop() else desk.return_code or 0


@contextmanager
def _resting(printer: "Printer", should_stop: Callable[[], bool]) -> Iterator[None]:
    """Inside, the machine comes to rest once ``should_stop`` says so, even while the screen waits."""
    over = threading.Event()

    def watch() -> None:
        while not over.wait(LOOK):
            if should_stop():
                with suppress(CdhrError):
                    printer.hold("the terminal is gone")
                return

    thread = threading.Thread(target=watch, name="cdhr-terminal")
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _lines(printer: "Printer") -> int:
    """Lines from standard input."""
    from cdhr_host.console import from_lines

    with StopRequest() as stop:
        code = from_lines(printer, sys.stdin, emit, stop)
    return INTERRUPTED if stop.asked else code
