"""The two faces of a session: lines from a pipe, keys from a terminal."""

import os
import select
import sys
import termios
import tty
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from cdhr_host.console.keys import AXES, HELP, STEPS_MM, read_key
from cdhr_host.console.session import Reply, Session

Write = Callable[[str], None]

ESCAPE_TIME = 0.05
"""s within which the rest of an escape sequence follows"""
QUIT = ("q", "quit", "exit")


def from_lines(session: Session, lines: Iterable[str], write: Write) -> int:
    """Lines of G-code, each answered ``ok ...`` or with its refusal; the exit code of the first refusal."""
    code = 0
    for line in lines:
        text = line.strip()
        if text in QUIT:
            break
        if text == "?":
            write(HELP)
        elif text:
            reply = session.run(text)
            write(f"ok {reply.text}" if reply.ok else reply.text)
            code = code or reply.exit_code
    return code


class KeyConsole:
    """Keys jog at once; anything else typed is a line of G-code, run by Enter."""

    def __init__(self, session: Session, write: Write) -> None:
        self._session = session
        self._write = write
        self._typed = ""
        self._step = 1

    @property
    def prompt(self) -> str:
        """The line being typed, after the size of a jog step."""
        return f"[{STEPS_MM[self._step]:g} mm] > {self._typed}"

    def press(self, key: str) -> bool:
        """Act on a key; False when it ends the session."""
        if key == "end" or (key in QUIT and not self._typed):
            return False
        if key in AXES:
            axis, sign = AXES[key]
            self._tell(self._session.jog(axis, sign * STEPS_MM[self._step]))
        elif key == "enter":
            self._enter()
        elif key == "backspace":
            self._typed = self._typed[:-1]
        elif key == "?" and not self._typed:
            self._write(HELP)
        elif key in {"+", "-"} and not self._typed:
            self._step = min(max(self._step + (1 if key == "+" else -1), 0), len(STEPS_MM) - 1)
        elif len(key) == 1 and key.isprintable():
            self._typed += key
        return True

    def _enter(self) -> None:
        line, self._typed = self._typed.strip(), ""
        if line:
            self._write(f"> {line}")
            self._tell(self._session.run(line))

    def _tell(self, reply: Reply) -> None:
        self._write(f"ok {reply.text}" if reply.ok else reply.text)


def from_keys(session: Session) -> int:
    """Keys from the terminal on standard input until ``q``; always 0: refusals were shown."""
    console = KeyConsole(session, _above_prompt)
    _above_prompt(f"{HELP}\n{session.where()}")
    with _unbuffered() as read:
        while True:
            sys.stdout.write(f"\r\x1b[K{console.prompt}")
            sys.stdout.flush()
            key = read_key(read)
            if not console.press(key):
                break
            if key in AXES:
                # A held key must not go on jogging after it is released.
                termios.tcflush(sys.stdin, termios.TCIFLUSH)
    sys.stdout.write("\r\x1b[K")
    return 0


def _above_prompt(text: str) -> None:
    """Print in place of the prompt, which is drawn again below."""
    lines = text.replace("\n", "\r\n")
    sys.stdout.write(f"\r\x1b[K{lines}\r\n")
    sys.stdout.flush()


@contextmanager
def _unbuffered() -> Iterator[Callable[[bool], str]]:
    """Keys one by one, not echoed; Ctrl-C stays a signal."""
    fd = sys.stdin.fileno()
    before = termios.tcgetattr(fd)

    def read(wait: bool) -> str:
        ready = select.select([fd], [], [], None if wait else ESCAPE_TIME)[0]
        return os.read(fd, 1).decode("latin-1") if ready else ""

    try:
        tty.setcbreak(fd)
        yield read
    finally:
        termios.tcsetattr(fd, termios.TCSADRAIN, before)
