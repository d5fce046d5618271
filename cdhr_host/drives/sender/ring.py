"""Rings of records in shared memory: one process writes, one reads, nobody waits."""

import zlib
from dataclasses import fields
from multiprocessing.shared_memory import SharedMemory
from typing import Any, Final

import numpy as np

from cdhr_host.drives.faults import fault
from cdhr_host.values import Array, Feedback, Setpoints

SETPOINTS: Final = {"nozzle_G": 3, "upper": 3, "slider": 6, "tension": 6}
FEEDBACK: Final = {"setpoint": 6, "slider": 6, "counts": 6, "torque": 6, "force": 3}
WHOLE: Final = ("tick", "line", "counts")
"""columns of whole numbers; below 2**53 they survive as float64"""
LOOKS: Final = 3
"""times a record that seems damaged is looked at: it may be on its way between two processors"""
UNMEASURED: Final = ("force", "deposited")
HEAD: Final = 16
"""bytes of the two counters"""


class Ring:
    """``capacity`` records of ``width`` float64; ``written`` and ``taken`` only ever grow.

    Each counter is an aligned 8-byte word that one side writes after the records it stands
    for, so that the other side never sees a record before it is complete. Nothing in Python
    orders the two stores for another processor, so every record also carries a CRC-32 of its
    bytes and its number: one that is not complete, or of an earlier round, is never taken.
    """

    def __init__(self, width: int, capacity: int, name: str | None = None) -> None:
        self.capacity = capacity
        self._memory = SharedMemory(name, create=name is None, size=HEAD + 8 * (width + 1) * capacity)
        self._owner = name is None
        self._counters = np.ndarray((2,), np.int64, self._memory.buf)
        self._records = np.ndarray((capacity, width + 1), np.float64, self._memory.buf, HEAD)
        if self._owner:
            self._counters[:] = 0

    @property
    def name(self) -> str:
        """For the other process."""
        return self._memory.name

    @property
    def written(self) -> int:
        """Records ever written."""
        return int(self._counters[0])

    @property
    def space(self) -> int:
        """Records there is room for."""
        return self.capacity - self.written + int(self._counters[1])

    def write(self, records: Array) -> None:
        """(N, width), N <= space."""
        at = self.written
        slots = (at + np.arange(len(records))) % self.capacity
        self._records[slots] = np.column_stack([records, _checks(records, at)])
        self._counters[0] = at + len(records)

    def take(self, most: int) -> Array:
        """(N, width), the oldest records, N <= most; DriveError for one that is damaged."""
        at = int(self._counters[1])
        count = max(min(self.written - at, most), 0)
        records = self._whole(at, count)
        self._counters[1] = at + count
        return records

    @property
    def waiting(self) -> int:
        """Records written and not taken."""
        return self.written - int(self._counters[1])

    def record(self, k: int) -> Array:
        """(1, width), the ``k``-th of the waiting records."""
        return self._whole(int(self._counters[1]) + k, 1)

    def cut(self, count: int) -> None:
        """Forget all waiting records but the first ``count``; only while the writer stands still."""
        self._counters[0] = int(self._counters[1]) + count

    def _whole(self, at: int, count: int) -> Array:
        """Records by number, once each is what its CRC says."""
        for _ in range(LOOKS):
            found = self._records[(at + np.arange(count)) % self.capacity]
            records = np.ascontiguousarray(found[:, :-1])
            if (found[:, -1] == _checks(records, at)).all():
                return records
        raise fault("ring", f"a record between host and sender is damaged (number {at} or later)")

    def unlink(self) -> None:
        """Take the name away: the memory is freed once nobody has it open, however they ended."""
        if self._owner:
            self._memory.unlink()
            self._owner = False

    def close(self) -> None:
        """Give the memory back; the owner's ``close`` removes it."""
        del self._counters, self._records
        self._memory.close()
        self.unlink()


def _checks(records: Array, first: int) -> Array:
    """(N,) CRC-32 of each record, begun with its number."""
    return np.array(
        [zlib.crc32(row.tobytes(), first + k & 0xFFFFFFFF) for k, row in enumerate(records)], dtype=np.float64
    )


def width(columns: dict[str, int], kind: type[Setpoints] | type[Feedback]) -> int:
    """Numbers in a record of this kind."""
    return sum(columns.get(field.name, 1) for field in fields(kind))


def packed(rows: Setpoints | Feedback, columns: dict[str, int]) -> Array:
    """Rows -> (N, width) records."""
    count = len(rows)
    parts = []
    for field in fields(rows):
        values = getattr(rows, field.name)
        wide = columns.get(field.name, 1)
        missing = len(values) != count
        parts.append(np.full((count, wide), np.nan) if missing else values.reshape(count, wide))
    return np.hstack(parts).astype(np.float64)


def setpoints(records: Array) -> Setpoints:
    """(N, width) records -> rows."""
    return Setpoints(**_columns(records, Setpoints, SETPOINTS))


def feedback(records: Array) -> Feedback:
    """(N, width) records -> rows; a column nobody measured is empty again."""
    found = _columns(records, Feedback, FEEDBACK)
    for name in UNMEASURED:
        if np.isnan(found[name]).all():
            found[name] = found[name][:0]
    return Feedback(**found)


def _columns(
    records: Array, kind: type[Setpoints] | type[Feedback], columns: dict[str, int]
) -> dict[str, Any]:
    found: dict[str, Any] = {}
    at = 0
    for field in fields(kind):
        wide = columns.get(field.name, 1)
        values = records[:, at : at + wide].copy() if wide > 1 else records[:, at].copy()
        found[field.name] = values.astype(np.int64) if field.name in WHOLE else values
        at += wide
    return found
