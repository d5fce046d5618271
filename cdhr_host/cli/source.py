"""A program to read: a plain or gzip-compressed file, or standard input, in chunks."""

import difflib
import gzip
import os
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from cdhr_host.cli.refusals import Refusal

CHUNK = 1 << 16
GZIP_MAGIC = b"\x1f\x8b"


class Source:
    """Bytes of a program. ``chunks`` may be called again, except on standard input.

    Raises Refusal (exit 2) for what is missing, a folder, unreadable or a damaged archive.
    """

    def __init__(self, name: str) -> None:
        self.name = "<stdin>" if name == "-" else name
        self._path = None if name == "-" else Path(name)
        self.read = 0
        """bytes taken from the disk so far, before decompression"""
        if self._path is not None:
            _check(self._path)
            self._seen = _stamp(self._path)

    @property
    def size(self) -> int | None:
        """Bytes on the disk; None for standard input."""
        return self._seen[0] if self._path is not None else None

    @property
    def fraction(self) -> float | None:
        """How much of the file has been read, 0 to 1; None when its size is not known."""
        return min(1.0, self.read / self.size) if self.size else None

    def chunks(self) -> Iterator[bytes]:
        """The program's bytes, decompressed."""
        if self._path is None:
            yield from self._plain(sys.stdin.buffer)
            return
        try:
            with self._path.open("rb") as file:
                packed = file.read(2) == GZIP_MAGIC
                file.seek(0)
                yield from self._unpacked(file) if packed else self._plain(file)
        except (OSError, EOFError, zlib.error) as error:
            why = getattr(error, "strerror", None) or error
            raise Refusal(f"{self.name}: error: cannot read: {why}") from error

    def still_the_same(self) -> None:
        """Raises Refusal when the file on the disk is not the one opened first."""
        if self._path is not None and _stamp(self._path) != self._seen:
            raise Refusal(
                f"{self.name}: error: the file changed while it was being checked\nhint: start again"
            )

    def _plain(self, file: BinaryIO) -> Iterator[bytes]:
        self.read = 0
        while chunk := file.read(CHUNK):
            self.read += len(chunk)
            yield chunk

    def _unpacked(self, file: BinaryIO) -> Iterator[bytes]:
        with gzip.open(file) as unpacked:
            while chunk := unpacked.read(CHUNK):
                self.read = file.tell()
                yield chunk


def _stamp(path: Path) -> tuple[int, int, int]:
    status = path.stat()
    return status.st_size, status.st_mtime_ns, status.st_ino


def _check(path: Path) -> None:
    if path.is_dir():
        raise Refusal(f"{path}: error: this is a folder, not a G-code file")
    if not path.exists():
        near = difflib.get_close_matches(path.name, _neighbours(path), n=1)
        hint = f"\nhint: did you mean {path.with_name(near[0])}?" if near else ""
        raise Refusal(f"{path}: error: there is no such file{hint}")
    if not path.is_file():
        raise Refusal(f"{path}: error: not a regular file\nhint: give - to read standard input")
    if not os.access(path, os.R_OK):
        raise Refusal(f"{path}: error: no permission to read it")


def _neighbours(path: Path) -> list[str]:
    return os.listdir(path.parent) if path.parent.is_dir() else []
