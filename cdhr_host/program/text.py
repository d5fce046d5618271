"""Bytes of any block size -> pieces of whole lines, in bounded memory.

Line ends are LF, CRLF or a lone CR; a UTF-8 byte-order mark is dropped. Text is decoded as
Latin-1, which loses nothing: ``readable`` gives back what the author wrote. At most one line
and one block are held, whatever the size of the file.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from cdhr_host.errors import Problem

BLOCK: Final = 1 << 16
"""Bytes taken up at a time."""
LINE_MAX: Final = 1 << 16
"""Bytes in the longest line that is read; nothing that long is a G-code line."""

_BOM: Final = b"\xef\xbb\xbf"
_CONTROL: Final = bytes(sorted({*range(32), 127} - {9, 10, 13}))
_CONTROL_BYTE: Final = re.compile(b"[" + re.escape(_CONTROL) + b"]")
_LINE_END: Final = re.compile(rb"[\r\n]")
_LONG: Final = re.compile(rb"[^\n]{%d,}" % (LINE_MAX + 1))
_COMMENTS: Final = re.compile(rb";.*|\([^()]*\)", re.DOTALL)
_MAGIC: Final = {
    b"\x1f\x8b": "it is gzip-compressed: unpack it first (gunzip FILE)",
    b"PK": "it is a zip or 3MF archive: export plain G-code from the slicer",
    b"GCDE": "it is binary G-code: switch off 'binary G-code' in the slicer and export again",
    b"\xff\xfe": "it is UTF-16 text: save it as UTF-8 or ASCII",
    b"\xfe\xff": "it is UTF-16 text: save it as UTF-8 or ASCII",
}


@dataclass(frozen=True, slots=True)
class Piece:
    """Some consecutive whole lines."""

    first_line: int
    text: str
    """lines, each ended by one LF"""


def readable(text: str) -> str:
    """Latin-1 decoded text as its author wrote it: UTF-8 where it is UTF-8, else Latin-1."""
    try:
        return text.encode("latin-1").decode("utf-8")
    except UnicodeDecodeError:
        return text


def pieces(chunks: Iterable[bytes], first_line: int = 1) -> Iterator[Piece | Problem]:
    """Whole lines of a text in order, and what is wrong with the text itself.

    A line longer than LINE_MAX is a problem and reads as an empty line. A control byte is a
    problem and ends the reading. A last line that holds words but no line end is a problem.
    """
    reader = _Reader(first_line)
    for block in _blocks(chunks):
        yield from reader.feed(block)
        if reader.stopped:
            return
    yield from reader.finish()


def _blocks(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """Chunks of any size -> blocks between BLOCK and twice that, the last one shorter."""
    held: list[bytes] = []
    size = 0
    for chunk in chunks:
        for at in range(0, len(chunk), BLOCK):
            held.append(chunk[at : at + BLOCK])
            size += len(held[-1])
            if size >= BLOCK:
                yield b"".join(held)
                held, size = [], 0
    if held:
        yield b"".join(held)


def _unix(data: bytes) -> bytes:
    """CRLF and CR -> LF."""
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in data else data


class _Reader:
    """The unfinished line between two blocks, and the line number."""

    def __init__(self, first_line: int) -> None:
        self.line = first_line
        self.stopped = False
        self._tail = b""
        self._skipping = False
        self._magic: bytes | None = None

    def feed(self, block: bytes) -> Iterator[Piece | Problem]:
        if self._magic is None:
            self._magic = block[:4]
            block = block.removeprefix(_BOM)
        if len(block.translate(None, _CONTROL)) != len(block):
            yield from self._until_control_byte(block)
        else:
            yield from self._lines(block)

    def finish(self) -> Iterator[Piece | Problem]:
        tail = self._tail
        self._tail = b""
        if tail and (tail.endswith(b"\r") or not _COMMENTS.sub(b"", tail).strip()):
            yield from self._whole(tail if tail.endswith(b"\r") else tail + b"\n")
        elif tail:
            yield self._unfinished(tail)

    def _until_control_byte(self, block: bytes) -> Iterator[Piece | Problem]:
        found = _CONTROL_BYTE.search(block)
        assert found is not None
        yield from self._lines(block[: found.start()])
        hint = next((text for magic, text in _MAGIC.items() if (self._magic or b"").startswith(magic)), None)
        self.stopped = True
        self._tail = _unix(self._tail)
        yield Problem(
            "binary",
            f"this is not a G-code text: it holds the control byte 0x{found.group()[0]:02X}",
            self.line + self._tail.count(b"\n"),
            len(self._tail.rpartition(b"\n")[2]) + 1,
            value=float(found.group()[0]),
            hint=hint or "give a text file as a slicer writes it",
        )

    def _lines(self, block: bytes) -> Iterator[Piece | Problem]:
        data = self._tail + block
        if self._skipping:
            data = self._after_long_line(data)
        cut = max(data.rfind(b"\n"), data.rfind(b"\r", 0, max(len(data) - 1, 0))) + 1
        self._tail = data[cut:]
        if cut:
            yield from self._whole(data[:cut])
        if len(self._tail.rstrip(b"\r")) > LINE_MAX:
            yield self._too_long(self.line)
            self._tail = self._tail[len(self._tail.rstrip(b"\r")) :]
            self._skipping = not self._tail

    def _after_long_line(self, data: bytes) -> bytes:
        end = _LINE_END.search(data)
        self._skipping = end is None
        return data[end.start() :] if end else b""

    def _whole(self, data: bytes) -> Iterator[Piece | Problem]:
        data = _unix(data)
        if len(data) > LINE_MAX and max(map(len, data.split(b"\n"))) > LINE_MAX:
            for long in _LONG.finditer(data):
                yield self._too_long(self.line + data.count(b"\n", 0, long.start()))
            data = _LONG.sub(b"", data)
        yield Piece(self.line, data.decode("latin-1"))
        self.line += data.count(b"\n")

    @staticmethod
    def _too_long(line: int) -> Problem:
        return Problem(
            "long-line",
            f"the line is longer than {LINE_MAX} bytes",
            line,
            1,
            limit=float(LINE_MAX),
            unit="byte",
            hint="this is not a G-code line; has the file lost its line ends?",
        )

    def _unfinished(self, tail: bytes) -> Problem:
        return Problem(
            "unfinished",
            f"the file ends inside line {self.line}",
            self.line,
            len(tail) + 1,
            hint="it may have been cut off: export it again, or end the last line with a line end",
        )
