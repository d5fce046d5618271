"""Files that appear whole or not at all: written beside their place, put there when complete."""

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

PICTURES = (".png", ".svg", ".pdf")
"""suffixes of the kinds of picture that can be drawn"""


class TargetError(ValueError):
    """A file cannot be written there; the message says why and what would do."""


def check_place(path: Path, suffixes: Collection[str]) -> None:
    """Refuse a file that could not be written there, before any work is done; raises TargetError."""
    if path.suffix not in suffixes:
        known = " or ".join(suffixes)
        raise TargetError(f"'{path.name}' does not end in {known}: the suffix says which kind to write")
    if path.exists() and not path.is_file():
        raise TargetError(f"{path} is not a regular file")
    if not path.parent.is_dir():
        raise TargetError(f"there is no folder {path.parent}")
    if not os.access(path.parent, os.W_OK):
        raise TargetError(f"no permission to write in {path.parent}")


@contextmanager
def put(path: Path) -> Iterator[Path]:
    """A hidden name beside ``path``, of the same suffix; what was written there becomes ``path``.

    Whatever ends the block early (a full disk's OSError, Ctrl-C) leaves ``path`` as it was.
    """
    part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield part
        with part.open("rb+") as file:
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
