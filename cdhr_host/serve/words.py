"""One line a client sent: its command, its words, and the modes it leaves behind."""

import re
import shlex
from dataclasses import dataclass, replace
from typing import Final

from cdhr_host.program.block import Block
from cdhr_host.program.interpreter import plain
from cdhr_host.program.parse import parse_line
from cdhr_host.program.straight import Row
from cdhr_host.program.words import WORDS
from cdhr_host.units import INCH, MINUTE, MM

_CODE: Final = re.compile(r"\s*([GMTgmt])\s*([0-9]+(?:\.[0-9]+)?)(?![_0-9]|[A-Za-z](?![-+.0-9]))")
_SCRIPT: Final = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_]*)")


def code_of(line: str) -> str:
    """``"g01 X1"`` -> ``"G1"``; a script's name in capitals; ``""`` for anything else."""
    found = _CODE.match(line)
    if found:
        number = float(found[2])
        return found[1].upper() + (str(int(number)) if number.is_integer() else f"{number:g}")
    named = _SCRIPT.match(line)
    return named[1].upper() if named else ""


def rest_of(line: str) -> str:
    """What follows the command."""
    found = _CODE.match(line) or _SCRIPT.match(line)
    return line[found.end() :].strip() if found else ""


def number_after(line: str, letter: str, default: float | None = None) -> float | None:
    """``number_after("M220 S50", "S")`` -> 50.0"""
    found = re.search(rf"(?i)(?<![A-Za-z]){letter}\s*([-+]?(?:\d+\.?\d*|\.\d+))", rest_of(line))
    return float(found[1]) if found else default


def parameters(line: str) -> dict[str, str]:
    """``NAME="a b" MOVE=1`` -> names in capitals with their values; ValueError for bad quoting."""
    parts = shlex.split(rest_of(line))
    pairs = (part.partition("=") for part in parts)
    return {name.upper(): value for name, equals, value in pairs if equals}


def bare(line: str) -> str:
    """A line without its comment and the space around it."""
    return line.partition(";")[0].strip()


def is_program_word(line: str) -> bool:
    """Whether a line's command is one that programs may use."""
    return code_of(line) in WORDS


@dataclass(frozen=True, slots=True)
class Modes:
    """What a client's next line inherits from its earlier ones."""

    absolute: bool = True
    absolute_e: bool = True
    inches: bool = False
    feed: float | None = None
    """programmed units per minute"""
    e: float = 0.0
    """programmed E"""

    @property
    def feed_speed(self) -> float:
        """m/s; 0 before the first F."""
        return (self.feed or 0.0) * (INCH if self.inches else MM) / MINUTE

    def after(self, line: str) -> "Modes":
        """The modes once this line has been read."""
        row = plain(line)
        if row is not None:
            return self._passed(row)
        simple = _SWITCHES.get(code_of(line))
        if simple is not None:
            return replace(self, **simple)
        if code_of(line) not in {"G0", "G1", "G2", "G3", "G5", "G5.1", "G92"}:
            return self
        block, _ = parse_line(line, 1)
        return self._moved(block) if block else self

    def _passed(self, row: Row) -> "Modes":
        """After a line as slicers write it, which is nearly every one."""
        feed, e = row[1] or row[7], row[6]
        if not feed and not e:
            return self
        before = 0.0 if e and self.absolute_e else self.e
        return Modes(
            self.absolute,
            self.absolute_e,
            self.inches,
            float(feed) if feed else self.feed,
            before + float(e or 0.0),
        )

    def _moved(self, block: Block) -> "Modes":
        named = "E" in block or (block.code == "G92" and not block.words)
        e = block.get("E") if named else 0.0
        relative = block.code != "G92" and not self.absolute_e
        e = self.e + e if relative else (e if named else self.e)
        return replace(self, feed=block.get("F") if "F" in block else self.feed, e=e)

    def preamble(self) -> tuple[str, ...]:
        """Lines that set exactly these modes, without moving."""
        feed = (f"G1 F{self.feed:.6f}",) if self.feed else ()
        return (
            "G20" if self.inches else "G21",
            "G90" if self.absolute else "G91",
            "M82" if self.absolute_e else "M83",
            f"G92 E{self.e:.6f}",
            *feed,
        )


_SWITCHES: Final[dict[str, dict[str, bool]]] = {
    "G20": {"inches": True},
    "G21": {"inches": False},
    "G90": {"absolute": True},
    "G91": {"absolute": False},
    "M82": {"absolute_e": True},
    "M83": {"absolute_e": False},
}
