"""Rows in a queue: batches of setpoints or feedback, joined and cut as needed."""

from collections import deque
from collections.abc import Sequence
from dataclasses import fields
from typing import TypeVar

import numpy as np

from cdhr_host.values import Feedback, Setpoints

T = TypeVar("T", Setpoints, Feedback)


def joined(parts: Sequence[T]) -> T:
    """One or more batches of rows -> one batch."""
    if len(parts) == 1:
        return parts[0]
    names = [field.name for field in fields(parts[0])]
    return type(parts[0])(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def no_feedback() -> Feedback:
    """Feedback of no tick at all."""
    none, six = np.zeros(0), np.zeros((0, 6))
    ticks = np.zeros(0, dtype=np.int64)
    return Feedback(ticks, six, six.copy(), np.zeros((0, 6), dtype=np.int64), six.copy(), none)


class RowQueue:
    """Setpoints first in, first out; batches are not copied until they must be joined."""

    def __init__(self) -> None:
        self._parts: deque[Setpoints] = deque()
        self._length = 0

    def __len__(self) -> int:
        return self._length

    def append(self, rows: Setpoints) -> None:
        """Put ``rows`` behind those already queued."""
        if len(rows):
            self._parts.append(rows)
            self._length += len(rows)

    def put_back(self, rows: Setpoints) -> None:
        """Put ``rows`` before those already queued."""
        if len(rows):
            self._parts.appendleft(rows)
            self._length += len(rows)

    def take(self, count: int) -> Setpoints:
        """Remove and return the first ``count`` rows; 1 <= count <= len."""
        parts = []
        wanted = count
        while wanted:
            part = self._parts.popleft()
            if len(part) > wanted:
                self._parts.appendleft(part[wanted:])
                part = part[:wanted]
            parts.append(part)
            wanted -= len(part)
        self._length -= count
        return joined(parts)

    def cut(self, count: int) -> None:
        """Drop all rows but the first ``count``."""
        if count < self._length:
            kept = self.take(count) if count else None
            self.clear()
            if kept is not None:
                self.append(kept)

    def first_tick(self) -> int:
        """Tick of the next row; the queue must not be empty."""
        return int(self._parts[0].tick[0])

    def clear(self) -> None:
        """Drop all rows."""
        self._parts.clear()
        self._length = 0
