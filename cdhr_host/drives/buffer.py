"""Rows fed and not executed yet: credit, order, reserve, and the stop."""

import math
from typing import Final

import numpy as np

from cdhr_host.drives.checks import STANDS_WITHIN, check_rows
from cdhr_host.drives.rows import RowQueue
from cdhr_host.motion.hold import ends_at_rest, path_true_stop, rows_needed
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Setpoints

LOOK_AHEAD: Final = 0.5
"""s of real time the buffer lasts beyond the reserve for a stop"""
MAX_LOOK_AHEAD: Final = 20_000
"""rows beyond the reserve, however fast the clock"""


class RowBuffer:
    """The buffer of a far side.

    It holds LOOK_AHEAD of real time, more rows for a faster clock, and beyond that the
    ``reserve`` a path-true stop needs, which is touched only by a stop or when the last row
    fed is at rest with the air off.
    """

    def __init__(self, profile: Profile, speed: float = 1.0) -> None:
        self._profile = profile
        self._queue = RowQueue()
        self.reserve = rows_needed(profile)
        self.look_ahead = math.ceil(min(LOOK_AHEAD * speed / profile.drives.period, MAX_LOOK_AHEAD))
        self.start(np.zeros(6))

    def __len__(self) -> int:
        return len(self._queue)

    def start(self, at: Array) -> None:
        """Empty, for a run that begins at (6,) m."""
        self._queue.clear()
        self._tail, self._silent = np.stack([at, at]), True
        self._next_tick: int | None = None
        self.stopping = False

    @property
    def free(self) -> int:
        """Rows there is room for."""
        return self.reserve + self.look_ahead - len(self._queue)

    @property
    def at_rest(self) -> bool:
        """Whether the last row fed is at rest with the air off, or ends a stop."""
        return self.stopping or (self._silent and ends_at_rest(self._tail, self._profile))

    @property
    def primed(self) -> bool:
        """Whether the first row may be executed."""
        return bool(len(self._queue)) and (
            len(self._queue) >= self.reserve + self.look_ahead // 2 or self.at_rest
        )

    @property
    def ready(self) -> int:
        """Rows that may be executed without a stop."""
        return len(self._queue) - (0 if self.at_rest else self.reserve)

    def feed(self, rows: Setpoints, room: int | None = None) -> int:
        """Check all rows, take the first there is ``room`` for; how many. Raises DriveError."""
        if not len(rows):
            return 0
        fresh = self._next_tick is None
        reach = STANDS_WITHIN if fresh else None
        check_rows(rows, self._profile, tick=self._next_tick, before=self._tail[1], reach=reach)
        accepted = rows[: self.free if room is None else max(room, 0)]
        if len(accepted):
            self._queue.append(accepted)
            self._next_tick = int(accepted.tick[-1]) + 1
            self._tail = np.vstack([self._tail, accepted.slider[-2:]])[-2:]
            self._silent = bool(accepted.pressure[-1] == 0.0)
        return len(accepted)

    def take(self, count: int) -> Setpoints:
        """The first rows, 1 <= count <= len."""
        return self._queue.take(count)

    def put_back(self, rows: Setpoints) -> None:
        """Rows taken too many."""
        self._queue.put_back(rows)

    def head(self) -> tuple[int, int]:
        """Tick and line of the next row."""
        row = self._queue.take(1)
        self._queue.put_back(row)
        return int(row.tick[0]), int(row.line[0])

    def begin_stop(self) -> int | None:
        """Replace the rows by their path-true stop; its first tick, None when there are no rows."""
        self.stopping = True
        if not len(self._queue):
            return None
        stop = path_true_stop(self._queue.take(len(self._queue)), self._profile)
        self._queue.clear()
        self._queue.append(stop)
        return int(stop.tick[0])

    def drop(self) -> None:
        """Forget all rows."""
        self._queue.clear()
