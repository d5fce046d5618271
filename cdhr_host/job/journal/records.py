"""What a journal is made of: one record a line, each bound to all before it.

A line is ``CRC JSON``: eight hexadecimal digits of the CRC-32 (IEEE 802.3) of the line's JSON,
begun with the CRC of the line before, then the JSON itself, an array of the record's letter and
its fields in their order. A record out of its place has therefore a wrong CRC.
"""

import json
import zlib
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Final

VERSION: Final = 1


@dataclass(frozen=True, slots=True)
class Opened:
    """What is printed where; the first record."""

    version: int
    file: str
    """path of the program, absolute"""
    sha256: str
    """of the program's bytes as stored"""
    profile: str
    """name or path, as given"""
    material: str | None
    profile_sha256: str
    """of all values of the profile"""
    drives: str
    """URL"""
    period_s: float
    """of the drives' ticks"""
    begun: str
    """wall time, ISO 8601"""
    goes_on: str
    """the journal this print goes on from; empty for a fresh one"""
    first_tick: float
    """of the program's plan at 100 %, at which it goes on; 0 for a fresh one"""
    boot: str = ""
    """names the time since the computer was switched on; empty where it has no such name"""


@dataclass(frozen=True, slots=True)
class Fed:
    """How far the drives may get by themselves: written before they are fed."""

    line: int
    plan_tick: float
    """of the program's plan at 100 %"""
    pace: float = 0.0
    """feed override at most until then; 0 where the plan at 100 % is played as slowly as it was executed"""
    steady: bool = False
    """whether the drives have got to that override"""


@dataclass(frozen=True, slots=True)
class Executed:
    """How far the drives are, as they answered."""

    tick: int
    """the drives' own"""
    line: int
    plan_tick: float
    """of the program's plan at 100 %"""
    nozzle_mm: tuple[float, float, float]
    """commanded, in G"""
    counts: tuple[int, int, int, int, int, int]
    """encoder counts"""
    air: bool
    """whether clay was being pushed"""
    extruded_mm3: float
    """as planned, since this journal begins"""


@dataclass(frozen=True, slots=True)
class Turned:
    """The job's state changed."""

    state: str
    reason: str


Record = Opened | Fed | Executed | Turned

_KINDS: Final[dict[str, Callable[..., Record]]] = {"O": Opened, "F": Fed, "X": Executed, "T": Turned}
_LETTERS: Final = {kind: letter for letter, kind in _KINDS.items()}


def encoded(record: Record, crc: int) -> tuple[bytes, int]:
    """A record, and the CRC of the line before (0 for the first) -> its line, and that line's CRC."""
    fields = [_LETTERS[type(record)], *astuple(record)]
    body = json.dumps(fields, ensure_ascii=False, separators=(",", ":")).encode("utf-8")
    crc = zlib.crc32(body, crc)
    return b"%08x %s\n" % (crc, body), crc


def decoded(line: bytes, crc: int) -> tuple[Record, int]:
    """A line with its end, and the CRC of the line before -> its record and CRC; ValueError says why not."""
    if not line.endswith(b"\n"):
        raise ValueError("it is not complete")
    digits, _, body = line[:-1].partition(b" ")
    found = zlib.crc32(body, crc)
    if digits != b"%08x" % found:
        raise ValueError("its checksum is wrong")
    letter, *fields = json.loads(body)
    kind = _KINDS.get(letter)
    if kind is None:
        raise ValueError(f"its kind {letter!r} is not known")
    try:
        record = kind(*(tuple(each) if isinstance(each, list) else each for each in fields))
    except TypeError as error:
        raise ValueError("its fields are not those of its kind") from error
    return record, found
