"""Bytes of a client -> lines, their numbers and checksums checked."""

import re
from dataclasses import dataclass
from functools import reduce
from operator import xor
from typing import Final

LINE_MAX: Final = 1024
"""bytes of a line; a longer one is dropped as a whole"""
IN_FLIGHT: Final = 6
"""lines a client may have sent before it reads that one of them is wanted again"""
NUMBER_MAX: Final = 2**31

_NUMBERED: Final = re.compile(r"\s*N\s*([-+]?[0-9]{1,10})\s*", re.IGNORECASE)
_CHECKSUM: Final = re.compile(r"\*\s*([0-9]{1,3})\s*\Z")
_RENUMBER: Final = re.compile(r"M\s*110(?![0-9.])\s*(?:N\s*([-+]?[0-9]{1,10}))?", re.IGNORECASE)


class Framer:
    """Cuts a stream of bytes into lines; holds one unfinished line at most."""

    def __init__(self) -> None:
        self._tail = bytearray()
        self._dropping = False

    def lines(self, data: bytes) -> list[str | None]:
        """The lines that further bytes end; None for one that was too long to be kept."""
        *whole, rest = data.replace(b"\0", b"").replace(b"\r", b"\n").split(b"\n")
        found = [self._ended(part) for part in whole]
        self._keep(rest)
        return [line for line in found if line is None or line.strip()]

    def _ended(self, part: bytes) -> str | None:
        self._keep(part)
        line = None if self._dropping else self._tail.decode("latin-1")
        self._tail.clear()
        self._dropping = False
        return line

    def _keep(self, part: bytes) -> None:
        if len(self._tail) + len(part) > LINE_MAX:
            self._dropping = True
            self._tail.clear()
        elif not self._dropping:
            self._tail += part


@dataclass(frozen=True, slots=True)
class Line:
    """One command of a client."""

    text: str
    """without number and checksum"""
    numbered: bool = False


@dataclass(frozen=True, slots=True)
class Damaged:
    """A line that must come again."""

    wanted: int
    """its number"""
    why: str


@dataclass(frozen=True, slots=True)
class Dropped:
    """A line that came after a damaged one and will come again by itself."""


class Numbering:
    """Which line comes next; lines without a number pass unchecked."""

    def __init__(self) -> None:
        self.last = 0
        self._patience = 0

    def check(self, raw: str) -> Line | Damaged | Dropped:
        """One line as it came."""
        found = _NUMBERED.match(raw)
        if found is None:
            raw = raw.partition(";")[0]
        star = _CHECKSUM.search(raw)
        body = raw[found.end() if found else 0 : star.start() if star else len(raw)].strip()
        if star is not None and _checksum(raw[: star.start()].lstrip()) != int(star[1]):
            return self._again(f"checksum mismatch, Last Line: {self.last}")
        renumber = _RENUMBER.fullmatch(body)
        if renumber is not None and (renumber[1] or found):
            return self._renumbered(int(renumber[1] or (found[1] if found else "0")), body)
        if found is None:
            return Line(body)
        if star is None:
            return self._again(f"No Checksum with line number, Last Line: {self.last}")
        return self._counted(int(found[1]), body)

    def _renumbered(self, number: int, body: str) -> Line:
        self.last = max(-NUMBER_MAX, min(number, NUMBER_MAX))
        self._patience = 0
        return Line(body, numbered=True)

    def _counted(self, number: int, body: str) -> Line | Damaged | Dropped:
        if number == self.last + 1:
            self.last, self._patience = number, 0
            return Line(body, numbered=True)
        if number > self.last and self._patience > 0:
            self._patience -= 1
            return Dropped()
        return self._again(f"Line Number is not Last Line Number+1, Last Line: {self.last}")

    def _again(self, why: str) -> Damaged:
        self._patience = IN_FLIGHT
        return Damaged(self.last + 1, why)


def _checksum(text: str) -> int:
    return reduce(xor, text.encode("latin-1"), 0)
