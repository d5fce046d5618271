"""Rows fed and not executed yet: credit, order, reserve, and the stop."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdhr_host.drives.checks import STANDS_WITHIN, check_rows
from cdhr_host.drives.rows import RowQueue
from cdhr_host.errors import DriveError, Problem
from cdhr_host.motion.hold import ends_at_rest, path_true_stop, rows_needed
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Setpoints

LOOK_AHEAD: Final = 0.5
"""s of real time the buffer lasts beyond the reserve for a stop"""
MAX_LOOK_AHEAD: Final = 20_000
"""rows beyond the reserve, however fast the clock"""
FIRM: Final = 2
"""rows at the head of a buffer that are never replaced"""


@dataclass(frozen=True, slots=True)
class Revision:
    """Rows that are to replace buffered ones, and what comes before them."""

    first: int
    rows: Setpoints
    tail: Array
    silent: bool

    def rests(self, profile: Profile) -> bool:
        """Whether the rows end at rest with the air off."""
        end = np.vstack([self.tail, self.rows.slider[-2:]])[-2:]
        return bool(self.rows.pressure[-1] == 0.0) and ends_at_rest(end, profile)


class RowBuffer:
    """The buffer of a far side.

    It holds LOOK_AHEAD of real time, more rows for a faster clock, and beyond that the
    ``reserve`` a path-true stop needs, ``lead`` rows before it included, which is touched only
    by a stop or when the last row fed is at rest with the air off.
    """

    def __init__(self, profile: Profile, speed: float = 1.0, lead: int = 0) -> None:
        self._profile = profile
        self._queue = RowQueue()
        self.reserve = rows_needed(profile) + lead
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
        self._append(accepted)
        return len(accepted)

    @property
    def next_tick(self) -> int:
        """The tick that ``feed`` expects; 0 before the first row of a run."""
        return self._next_tick or 0

    @property
    def revisable(self) -> int:
        """The first tick that ``revise`` may replace; ``next_tick`` where nothing can be replaced."""
        if not len(self._queue):
            return self.next_tick
        return min(self._queue.first_tick() + FIRM, self.next_tick)

    def revise(self, rows: Setpoints) -> None:
        """Put ``rows`` in the place of everything from their first tick on, or raise DriveError.

        They are checked as in ``feed``, and continue the row before them. All must fit.
        """
        self.replace(self.revision(rows))

    def revision(self, rows: Setpoints) -> "Revision":
        """Checked, and nothing changed yet; raises DriveError."""
        if self._next_tick is None:
            raise DriveError(Problem("state", "there is nothing to revise: no row was fed yet"))
        first = int(rows.tick[0]) if len(rows) else self.next_tick
        if not self.revisable <= first <= self.next_tick:
            raise too_late(first, self.revisable, self.next_tick)
        if len(rows) > (room := self.room_from(first)):
            message = f"{len(rows)} rows from tick {first} on do not fit: there is room for {room}"
            raise DriveError(Problem("overflow", message, value=len(rows), limit=room))
        tail, silent = self._tail_before(first)
        check_rows(rows, self._profile, tick=first, before=tail[-1], reach=None)
        return Revision(first, rows, tail, silent)

    def replace(self, revision: "Revision") -> None:
        """Carry a revision out; what was taken of it meanwhile is not put in again."""
        first = revision.first
        at = self._queue.first_tick() if len(self._queue) else self.next_tick
        self._queue.cut(max(first - at, 0))
        self._next_tick, self._tail, self._silent = first, revision.tail, revision.silent
        self._append(revision.rows)
        if at > first:
            self._queue.take(at - first)

    def room_from(self, tick: int) -> int:
        """Rows there is room for from a buffered tick on."""
        return self.free + self.next_tick - tick

    def _tail_before(self, first: int) -> tuple[Array, bool]:
        """The last two rows before a tick, and whether the air is off in the last."""
        if first == self.next_tick:
            return self._tail, self._silent
        rows = self._queue.take(len(self._queue))
        self._queue.put_back(rows)
        before = rows[: first - int(rows.tick[0])]
        return before.slider[-2:], bool(before.pressure[-1] == 0.0)

    def _append(self, rows: Setpoints) -> None:
        if len(rows):
            self._queue.append(rows)
            self._next_tick = int(rows.tick[-1]) + 1
            self._tail = np.vstack([self._tail, rows.slider[-2:]])[-2:]
            self._silent = bool(rows.pressure[-1] == 0.0)

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

    def begin_stop_after(self, lead: int) -> Setpoints:
        """Keep ``lead`` rows, without air; the rows from which the stop is to be made."""
        self.stopping = True
        rows = self._queue.take(len(self._queue))
        ahead = rows[:lead]
        none = np.zeros(len(ahead))
        self._queue.append(replace(ahead, flow=none, pressure=none.copy()))
        return rows[lead:]

    def append_stop(self, stop: Setpoints) -> None:
        """The rows of a stop, behind those kept for its lead."""
        self._queue.append(stop)

    def drop(self) -> None:
        """Forget all rows."""
        self._queue.clear()


def too_late(first: int, revisable: int, expected: int) -> DriveError:
    """A revision that begins at a tick that is due already, or behind a gap."""
    if first > expected:
        return DriveError(Problem("order", f"tick {first} came where tick {expected} is due"))
    return DriveError(
        Problem(
            "late-revision",
            f"tick {first} can no longer be replaced: the first that can is tick {revisable}",
            value=first,
            limit=revisable,
            hint="plan the rest anew from the link's revisable tick on",
        )
    )
