"""The upload folder: programs of clients, written as they arrive, never outside.

Every step into a folder is taken with ``O_NOFOLLOW`` from the folder before it, so a link
planted there leads nowhere, and what was checked is what is opened.
"""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from types import TracebackType
from typing import Final, Self

from cdhr_host.serve.names import SUFFIXES, program_name, refused, shown

_STEP: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_FILE: Final = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
SPARE: Final = 64 << 20
"""bytes that must stay free on the disk: a journal and a black box are written there too"""


@dataclass(frozen=True, slots=True)
class Entry:
    """One program in the folder."""

    name: str
    """relative, with ``/``"""
    size: int
    """bytes"""
    modified: float
    """s since 1970"""


@dataclass(frozen=True, slots=True)
class FolderLimits:
    """How much clients may leave here."""

    size_max: int = 256 << 20
    """bytes of one program"""
    files_max: int = 1000


class Folder:
    """Programs below one root; raises JobError for what is not allowed, with the reason."""

    def __init__(self, root: Path, limits: FolderLimits | None = None) -> None:
        try:
            root.mkdir(parents=True, exist_ok=True, mode=0o750)
        except OSError as error:
            message = f"{root} cannot be the folder of programs: {error.strerror}"
            raise refused(message, "name another with --files", kind="folder") from error
        self.root = root.resolve()
        self.limits = limits or FolderLimits()
        for left in self.root.glob(".upload-*"):
            left.unlink(missing_ok=True)

    def entries(self) -> list[Entry]:
        """All programs, by name; links and anything else are not seen."""
        return sorted(self._walk(PurePosixPath(), self.root), key=lambda entry: entry.name)

    def folders(self) -> list[str]:
        """Folders that hold something, by name."""
        parents = {
            parent.as_posix() for entry in self.entries() for parent in PurePosixPath(entry.name).parents
        }
        return sorted(parents - {"."})

    def entry(self, name: str) -> Entry:
        """One program; JobError when there is none."""
        path = program_name(name)
        with self._opened(path) as fd:
            found = os.fstat(fd)
        return Entry(path.as_posix(), found.st_size, found.st_mtime)

    def path(self, name: str) -> Path:
        """Where a program lies, once it is known to be one."""
        return self.root / self.entry(name).name

    def read(self, name: str, size: int, *, at: int = 0) -> bytes:
        """Some bytes of a program."""
        with self._opened(program_name(name)) as fd:
            return os.pread(fd, size, at)

    def delete(self, name: str) -> None:
        """Remove a program."""
        path = program_name(name)
        self.entry(name)
        with self._parent(path) as parent:
            os.unlink(path.name, dir_fd=parent)

    def receive(self, name: str) -> "Upload":
        """Begin an upload; the program appears under its name once all of it is there."""
        path = program_name(name)
        known = {entry.name for entry in self.entries()}
        if path.as_posix() not in known and len(known) >= self.limits.files_max:
            raise refused(
                f"the folder is full: {len(known)} programs, at most {self.limits.files_max}",
                "delete some first",
                kind="full",
            )
        return Upload(self, path)

    def _walk(self, inside: PurePosixPath, folder: Path) -> Iterator[Entry]:
        with os.scandir(folder) as found:
            for item in found:
                name = inside / item.name
                if item.name.startswith(".") or len(name.parts) > 4:
                    continue
                if item.is_dir(follow_symlinks=False):
                    yield from self._walk(name, folder / item.name)
                elif item.is_file(follow_symlinks=False) and item.name.lower().endswith(SUFFIXES):
                    about = item.stat(follow_symlinks=False)
                    yield Entry(name.as_posix(), about.st_size, about.st_mtime)

    @contextmanager
    def _parent(self, path: PurePosixPath, *, make: bool = False) -> Iterator[int]:
        """The folder a path lies in, as a descriptor."""
        fd = os.open(self.root, _STEP)
        try:
            for part in path.parts[:-1]:
                if make:
                    _make(part, fd)
                step = os.open(part, _STEP, dir_fd=fd)
                os.close(fd)
                fd = step
            yield fd
        except OSError as error:
            raise refused(
                f"no program '{shown(path.as_posix())}': {error.strerror}", kind="missing"
            ) from error
        finally:
            os.close(fd)

    @contextmanager
    def _opened(self, path: PurePosixPath) -> Iterator[int]:
        """A regular file, as a descriptor."""
        with self._parent(path) as parent:
            fd = os.open(path.name, _FILE, dir_fd=parent)
            try:
                if not stat.S_ISREG(os.fstat(fd).st_mode):
                    raise refused(f"'{shown(path.as_posix())}' is no regular file", kind="missing")
                yield fd
            finally:
                os.close(fd)


class Upload:
    """A program on its way in: straight to the disk, gone again unless ``keep`` is called."""

    def __init__(self, folder: Folder, path: PurePosixPath) -> None:
        self.name = path.as_posix()
        self.size = 0
        self._folder = folder
        self._path = path
        self._kept = False
        self._part = folder.root / f".upload-{os.getpid()}-{id(self):x}"
        self._file = self._part.open("xb")

    def put_in(self, folder: str) -> None:
        """Into a folder of that name, after all."""
        self._path = program_name(f"{folder}/{self._path.name}")
        self.name = self._path.as_posix()

    def write(self, data: bytes) -> None:
        """Further bytes; JobError beyond the size limit or when the disk is nearly full."""
        self.size += len(data)
        if self.size > self._folder.limits.size_max:
            raise refused(
                f"'{shown(self.name)}' is larger than {self._folder.limits.size_max} bytes",
                "the profile's [serve] upload_max_bytes is the limit",
                kind="size",
            )
        disk = os.fstatvfs(self._file.fileno())
        if disk.f_bavail * disk.f_frsize < SPARE:
            raise refused(f"the disk has less than {SPARE >> 20} MiB left", "free some space", kind="full")
        self._file.write(data)

    def keep(self) -> Entry:
        """All of it is here: give it its name."""
        if not self.size:
            raise refused(f"'{shown(self.name)}' is empty", kind="size")
        self._file.flush()
        os.fsync(self._file.fileno())
        with self._folder._parent(self._path, make=True) as parent:
            os.replace(self._part, self._path.name, dst_dir_fd=parent)
        self._kept = True
        return self._folder.entry(self.name)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()
        if not self._kept:
            self._part.unlink(missing_ok=True)


def _make(part: str, fd: int) -> None:
    try:
        os.mkdir(part, 0o750, dir_fd=fd)
    except FileExistsError:
        return
