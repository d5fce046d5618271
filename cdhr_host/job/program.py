"""A program file: read as often as needed, proven once, and never printed when it has changed."""

import gzip
import zlib
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np

from cdhr_host.errors import JobError, Problem
from cdhr_host.pipeline import Checked, Proof, prove
from cdhr_host.profile import Profile
from cdhr_host.values import Ints

CHUNK: Final = 1 << 16
GZIP_MAGIC: Final = b"\x1f\x8b"
STRIDE: Final = 256
"""lines between two places that are kept"""
Stamp = tuple[int, int, int]


class ProgramFile:
    """A plain or gzip-compressed file. Raises JobError for one that cannot be read."""

    def __init__(self, path: Path, name: str | None = None) -> None:
        self.path = path
        self.name = name or path.name
        self._seen = self._stamp()

    def chunks(self) -> Iterator[bytes]:
        """The text, decompressed; it must be what it was at first."""
        if self._stamp() != self._seen:
            raise self._refusal("changed since it was checked", "load it again")
        try:
            with self.path.open("rb") as file:
                packed = file.read(2) == GZIP_MAGIC
                file.seek(0)
                yield from _blocks(gzip.GzipFile(fileobj=file)) if packed else _blocks(file)
        except (OSError, EOFError, zlib.error) as error:
            raise self._refusal(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error

    def _stamp(self) -> Stamp:
        try:
            status = self.path.stat()
        except OSError as error:
            raise self._refusal(f"cannot be read: {error.strerror}") from error
        return status.st_size, status.st_mtime_ns, status.st_ino

    def _refusal(self, what: str, hint: str | None = None) -> JobError:
        return JobError(Problem("file", f"{self.name} {what}", hint=hint))


@dataclass(frozen=True, slots=True)
class Program:
    """A file the machine can print."""

    file: ProgramFile
    proof: Proof
    size: int
    """bytes of the text"""
    places: Ints
    """bytes of the text before every STRIDE-th line"""

    def position(self, line: int) -> int:
        """Bytes of the text up to a line, to within STRIDE lines."""
        return int(self.places[min(max(line, 0) // STRIDE, len(self.places) - 1)]) if len(self.places) else 0

    def layer(self, line: int) -> int:
        """How many layers have begun at a line."""
        return bisect_right(self.proof.layers, (line, 1 << 62))


def proven(
    file: ProgramFile,
    profile: Profile,
    *,
    watch: Callable[[Checked], None] | None = None,
    chunks: Iterator[bytes] | None = None,
) -> Program:
    """Walk the whole file. Raises ProgramError for text that is not understood.

    What the machine cannot do is in the proof. ``chunks`` is the text where it is read already.
    """
    index = _Index()
    proof = prove(index.noting(chunks or file.chunks()), profile, watch=watch)
    return Program(file, proof, index.size, np.array(index.places, dtype=np.int64))


class _Index:
    """Where lines begin, noted while the text passes by."""

    def __init__(self) -> None:
        self.size = 0
        self.places = [0]
        self._lines = 0

    def noting(self, chunks: Iterator[bytes]) -> Iterator[bytes]:
        """The chunks themselves."""
        for chunk in chunks:
            ends = np.flatnonzero(np.frombuffer(chunk, dtype=np.uint8) == ord("\n"))
            first = STRIDE - 1 - self._lines % STRIDE
            self.places += (self.size + ends[first::STRIDE] + 1).tolist()
            self._lines += len(ends)
            self.size += len(chunk)
            yield chunk


def _blocks(file: "BinaryIO | gzip.GzipFile") -> Iterator[bytes]:
    while chunk := file.read(CHUNK):
        yield chunk
