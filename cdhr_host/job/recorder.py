"""What is kept of a print while it goes on: its journal, the last minute, and the watchdogs' view."""

import hashlib
import itertools
import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from cdhr_host.drives.link import MachineLink
from cdhr_host.errors import Problem
from cdhr_host.job.black_box import SUFFIX, BlackBox
from cdhr_host.job.journal import (
    Executed,
    Fed,
    JournalWriter,
    Opened,
    Turned,
    boot_name,
    journal_folder,
    prune,
)
from cdhr_host.job.journal.records import VERSION
from cdhr_host.job.journal.writing import SUFFIX as JOURNAL
from cdhr_host.job.program import ProgramFile
from cdhr_host.job.watchdogs import Alarm, Watchdogs
from cdhr_host.profile import described
from cdhr_host.profile.schema import Profile
from cdhr_host.units import MM, MM3
from cdhr_host.values import Feedback, Setpoints

LOOK: Final = 1.0
"""s between two looks at clocks and disks"""


@dataclass(frozen=True, slots=True)
class Plan:
    """Where in the program's plan at 100 % the machine is, and how far it may get by itself; ticks."""

    executed: float
    fed: float
    pace: float = 0.0
    """feed override at most until then; 0 where the plan at 100 % is played as slowly as lately"""
    steady: bool = False
    """whether the machine has got to that override"""


@dataclass(frozen=True, slots=True)
class Names:
    """What the machine was called with, so that a print can go on with the same."""

    profile: str
    material: str | None = None
    drives: str = "loopback:"


class Recorder:
    """One printer's; everything from the printer's thread."""

    def __init__(self, link: MachineLink, names: Names, folder: Path | None = None) -> None:
        self._link = link
        self._names = names
        self._folder = folder or journal_folder()
        self._box = BlackBox(link.profile)
        self._dogs = Watchdogs(link.profile)
        self._journal: JournalWriter | None = None
        self._file: ProgramFile | None = None
        self._extruded = 0.0
        self._looked = 0.0

    @property
    def journal(self) -> Path | None:
        """The journal that is being written."""
        return None if self._journal is None else self._journal.path

    def begin(self, file: ProgramFile, *, goes_on: str = "", tick: float = 0.0) -> None:
        """A print begins, at a tick of its plan. Raises JobError where no journal can be written."""
        self.end()
        prune(self._folder)
        now = datetime.now(UTC)
        stem = f"{now:%Y%m%d-%H%M%S-%f}-{file.path.stem}"
        opened = Opened(
            version=VERSION,
            file=str(file.path.resolve()),
            sha256=digest_of(file.path),
            profile=self._names.profile,
            material=self._names.material,
            profile_sha256=digest_of_profile(self._link.profile),
            drives=self._names.drives,
            period_s=self._link.profile.drives.period,
            begun=now.isoformat(timespec="seconds"),
            goes_on=goes_on,
            first_tick=tick,
            boot=boot_name(),
        )
        self._journal = JournalWriter(self._folder / f"{stem}{JOURNAL}", opened)
        self._dogs = Watchdogs(self._link.profile)
        self._file, self._extruded = file, 0.0

    def executed(self, rows: Setpoints, feedback: Feedback, plan: Plan | None) -> Alarm | None:
        """A batch that was executed, with a ``plan`` while a program is played; the first thing wrong."""
        self._box.executed(rows, feedback)
        if plan is not None:
            self._box.line = int(rows.line[-1])
        if self._journal is not None and plan is not None:
            self._extruded += float(rows.flow.sum()) * self._link.profile.drives.period
            x, y, z = (rows.nozzle_G[-1] / MM).tolist()
            counts = tuple(feedback.counts[-1].tolist())
            self.expect(int(rows.line[-1]), plan)
            self._journal.add(
                Executed(
                    tick=int(rows.tick[-1]),
                    line=int(rows.line[-1]),
                    plan_tick=round(plan.executed, 6),
                    nozzle_mm=(x, y, z),
                    counts=counts,
                    air=bool(rows.flow[-1] > 0.0),
                    extruded_mm3=self._extruded / MM3,
                )
            )
        return self._dogs.executed(rows, feedback)

    def expect(self, line: int, plan: Plan) -> None:
        """How far the drives may get, and how fast: to be written before they are fed that."""
        if self._journal is not None:
            self._journal.add(Fed(line, round(plan.fed, 6), plan.pace, plan.steady))

    def look(self, now: float, fed: int, *, waiting: bool) -> Alarm | None:
        """Clocks, feeder and disk, about once a second; the first thing wrong."""
        if self._journal is None or now - self._looked < LOOK:
            return None
        self._looked = now
        return (
            self._dogs.cycles(now, self._link.timing())
            or self._dogs.fed(now, fed, waiting=waiting)
            or self._dogs.disk(shutil.disk_usage(self._folder).free)
        )

    def rearm(self) -> None:
        """An operator has seen to the machine: what was found amiss before counts no more."""
        self._dogs = Watchdogs(self._link.profile)

    def event(self, kind: str, text: str) -> None:
        """Something happened."""
        self._box.event(kind, text)

    def turned(self, state: str, reason: str) -> None:
        """The job's state changed."""
        self._box.event("state", f"{state}: {reason}" if reason else state)
        if self._journal is not None:
            self._journal.add(Turned(state, reason))

    def keep(self, why: Problem) -> Path:
        """The run ended other than planned: write the black box. Raises JobError where it cannot be."""
        stem = (
            self._journal.path.stem if self._journal is not None else f"{datetime.now(UTC):%Y%m%d-%H%M%S-%f}"
        )
        path = self._folder / f"{stem}{SUFFIX}"
        program = "" if self._file is None else str(self._file.path)
        self._box.write(path, why, program, self._lines())
        return path

    def end(self) -> None:
        """The journal is complete on the disk."""
        if self._journal is not None:
            self._journal.close()
        self._journal = None

    def _lines(self) -> Iterator[str]:
        """Texts of the last lines up to the one that was executed."""
        if self._file is None:
            return
        wanted = self._box.lines
        lines = _lines_of(self._file.chunks)
        for line in itertools.islice(lines, wanted.start - 1, wanted.stop - 1):
            yield line.decode("utf-8", errors="replace").rstrip("\r\n")


def digest_of(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def digest_of_profile(profile: Profile) -> str:
    """SHA-256 of all values of a profile."""
    values = [(section, key, value) for section, key, value, _ in described(profile)]
    return hashlib.sha256(json.dumps(values).encode()).hexdigest()


def _lines_of(chunks: Callable[[], Iterator[bytes]]) -> Iterator[bytes]:
    rest = b""
    for chunk in chunks():
        *lines, rest = (rest + chunk).split(b"\n")
        yield from lines
    if rest:
        yield rest
