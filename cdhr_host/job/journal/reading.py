"""A journal read back: everything up to the first record that is not whole."""

from dataclasses import dataclass
from pathlib import Path

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.journal.records import VERSION, Executed, Fed, Opened, Record, Turned, decoded


@dataclass(frozen=True, slots=True)
class Damage:
    """What had to be dropped at a journal's end."""

    record: int
    """number of the first record dropped, from 1"""
    offset: int
    """bytes before it"""
    dropped: int
    """bytes dropped"""
    why: str


@dataclass(frozen=True, slots=True)
class Journal:
    """What is known of a print."""

    path: Path
    opened: Opened
    executed: Executed | None
    """the last; None when nothing was executed"""
    fed: Fed | None
    """the furthest; None when nothing was fed"""
    bead: Executed | None
    """the last with clay being pushed"""
    pace: float
    """ticks of the plan in one of the drives', lately"""
    pace_most: float
    """of what was fed, at most: up to 1 as ``pace``, above it the feed that the plan was made for"""
    changing: bool
    """whether the drives may have been on their way from one pace to another"""
    state: str
    """the last told"""
    reason: str
    damage: Damage | None

    def power_was_cut(self, boot: str) -> bool:
        """Whether the computer was started again since; ``boot`` names its present start."""
        return bool(self.opened.boot) and self.opened.boot != boot

    @property
    def finished(self) -> bool:
        """Whether there is nothing left to print."""
        return self.state == "done"


def read_journal(path: Path) -> Journal:
    """What a journal says, in memory that does not grow with it.

    A damaged tail is dropped and named in ``damage``. Raises JobError for a file that cannot
    be read, does not begin with a whole first record, or is of another version.
    """
    reader = _Reader()
    try:
        with path.open("rb") as lines:
            for line in lines:
                if not reader.take(line):
                    break
    except OSError as error:
        raise JobError(Problem("journal", f"cannot read journal {path}: {error.strerror}")) from error
    return reader.journal(path, path.stat().st_size)


class _Reader:
    """The last record of each kind so far."""

    def __init__(self) -> None:
        self._crc = 0
        self._count = 0
        self._offset = 0
        self._why = ""
        self._opened: Opened | None = None
        self._executed: Executed | None = None
        self._bead: Executed | None = None
        self._pace = 1.0
        self._fed: Fed | None = None
        self._turned = Turned("printing", "")

    def take(self, line: bytes) -> bool:
        """Take the next line in; False when it is damaged."""
        try:
            record, self._crc = decoded(line, self._crc)
            self._note(record)
        except ValueError as error:
            self._why = str(error)
            return False
        self._count += 1
        self._offset += len(line)
        return True

    def _note(self, record: Record) -> None:
        if (self._opened is None) != isinstance(record, Opened):
            raise ValueError("it is not where a record of its kind belongs")
        match record:
            case Opened():
                self._opened = record
            case Executed():
                self._pace = _pace(self._executed, record, self._pace)
                self._executed = record
                self._bead = record if record.air else self._bead
            case Fed():
                self._fed = record
            case Turned():
                self._turned = record

    def journal(self, path: Path, size: int) -> Journal:
        """What was found in a file of this many bytes."""
        if self._opened is None:
            why = self._why or "it is empty"
            hint = "a print that never began has nothing to go on with: cdhr stream FILE"
            raise JobError(Problem("journal", f"{path} is not the journal of a print: {why}", hint=hint))
        if self._opened.version != VERSION:
            found = self._opened.version
            raise JobError(Problem("journal", f"{path} is a journal of version {found}, not {VERSION}"))
        damage = None
        if size > self._offset:
            damage = Damage(self._count + 1, self._offset, size - self._offset, self._why)
        return Journal(
            path,
            self._opened,
            self._executed,
            self._fed,
            self._bead,
            self._pace,
            max(self._pace, self._fed.pace if self._fed else 0.0),
            self._fed is not None and self._fed.pace > 0.0 and not self._fed.steady,
            self._turned.state,
            self._turned.reason,
            damage,
        )


def _pace(before: Executed | None, now: Executed, known: float) -> float:
    """From the record before; what is ``known`` where the drives' ticks began anew."""
    if before is None or now.tick <= before.tick or now.plan_tick <= before.plan_tick:
        return known
    return (now.plan_tick - before.plan_tick) / (now.tick - before.tick)
