"""What keys mean: the bytes a terminal sends -> named keys -> jog moves."""

from collections.abc import Callable
from typing import Final

STEPS_MM: Final = (0.1, 1.0, 10.0, 100.0)
"""sizes of a jog move"""

SEQUENCES: Final = {
    "\x1b[A": "up",
    "\x1b[B": "down",
    "\x1b[C": "right",
    "\x1b[D": "left",
    "\x1bOA": "up",
    "\x1bOB": "down",
    "\x1bOC": "right",
    "\x1bOD": "left",
    "\x1b[5~": "page up",
    "\x1b[6~": "page down",
}
AXES: Final = {
    "right": ("X", 1),
    "left": ("X", -1),
    "up": ("Y", 1),
    "down": ("Y", -1),
    "page up": ("Z", 1),
    "page down": ("Z", -1),
}
PLAIN: Final = {
    "\r": "enter",
    "\n": "enter",
    "\x7f": "backspace",
    "\x08": "backspace",
    "\x04": "end",
}

HELP: Final = f"""\
  arrows              jog x and y          PgUp PgDn   jog z
  + -                 step: {", ".join(f"{step:g}" for step in STEPS_MM)} mm
  G1 X10 F600 Enter   run a line of G-code, proven before it moves
  ?                   this help            Ctrl-C      stop on the path
  q                   quit, when nothing is typed"""


def read_key(read: Callable[[bool], str]) -> str:
    """A named key or a character; ``"end"`` when the input has ended, ``""`` for a sequence not known.

    ``read(True)`` waits for one character; ``read(False)`` gives ``""`` when none follows at once.
    """
    first = read(True)
    if first != "\x1b":
        return PLAIN.get(first, first) or "end"
    sequence = first
    while any(known.startswith(sequence) for known in SEQUENCES):
        if sequence in SEQUENCES:
            return SEQUENCES[sequence]
        following = read(False)
        if not following:
            break
        sequence += following
    return ""
