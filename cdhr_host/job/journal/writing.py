"""Writing a journal.

Policy: every record is handed to the operating system at once, so that it survives this process
(kill -9); the disk has it at the latest SYNC_EVERY later, and at once when the state changes, so
that it survives the computer (power cut). What a power cut takes is at most SYNC_EVERY of records:
resuming then trusts the encoders and asks for the overlap that covers the difference.
"""

import os
import threading
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.journal.reading import read_journal
from cdhr_host.job.journal.records import Opened, Record, Turned, encoded

SYNC_EVERY: Final = 1.0
"""s"""
SUFFIX: Final = ".journal"
BOOT: Final = Path("/proc/sys/kernel/random/boot_id")
KEPT: Final = 100
"""journals"""


def boot_name() -> str:
    """Another one after each start of the computer (random(4)); empty where there is none."""
    try:
        return BOOT.read_text(encoding="ascii").strip()
    except OSError:
        return ""


def journal_folder() -> Path:
    """``$XDG_STATE_HOME/cdhr/journals``."""
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "cdhr" / "journals"


def latest_unfinished(folder: Path) -> Path:
    """The youngest journal of a print that did not end and that none goes on from; JobError without one."""
    gone_on: set[str] = set()
    for path in sorted(folder.glob(f"*{SUFFIX}"), reverse=True):
        try:
            journal = read_journal(path)
        except JobError:
            continue
        gone_on.add(journal.opened.goes_on)
        if not journal.finished and str(path) not in gone_on:
            return path
    hint = "give the journal's path: cdhr resume JOURNAL"
    raise JobError(Problem("journal", f"no interrupted print in {folder}", hint=hint))


def prune(folder: Path, keep: int = KEPT) -> None:
    """Remove all but the youngest journals, and the black boxes beside them."""
    for path in sorted(folder.glob(f"*{SUFFIX}"), reverse=True)[keep:]:
        path.unlink(missing_ok=True)
        path.with_suffix(".npz").unlink(missing_ok=True)


class JournalWriter:
    """An append-only file; safe to use from one thread."""

    def __init__(self, path: Path, opened: Opened) -> None:
        """Begin a journal; raises JobError where it cannot be written or is there already."""
        self.path = path
        self._crc = 0
        self._closing = threading.Event()
        self._failed: OSError | None = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except OSError as error:
            raise self._refusal(error) from error
        self.add(opened)
        self._flush(self._file)
        self._flush_folder()
        self._syncer = threading.Thread(target=self._sync, name="journal", daemon=True)
        self._syncer.start()

    def add(self, record: Record) -> None:
        """Append a record; raises JobError when the disk is full or gone."""
        if self._failed is not None:
            raise self._refusal(self._failed)
        line, self._crc = encoded(record, self._crc)
        try:
            while line:
                line = line[os.write(self._file, line) :]
        except OSError as error:
            self._failed = error
            raise self._refusal(error) from error
        if isinstance(record, Turned):
            self._flush(self._file)

    def close(self) -> None:
        """All of it is on the disk."""
        if self._closing.is_set():
            return
        self._closing.set()
        self._syncer.join()
        self._flush(self._file)
        os.close(self._file)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _sync(self) -> None:
        """In its own thread: a slow disk must not delay the drives."""
        while not self._closing.wait(SYNC_EVERY):
            self._flush(self._file)

    def _flush(self, file: int) -> None:
        try:
            os.fdatasync(file)
        except OSError as error:
            self._failed = error

    def _flush_folder(self) -> None:
        """The file's name must survive, too."""
        folder = os.open(self.path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)

    def _refusal(self, error: OSError) -> JobError:
        hint = "free some space, or set XDG_STATE_HOME to another disk"
        return JobError(Problem("journal", f"cannot write journal {self.path}: {error.strerror}", hint=hint))
