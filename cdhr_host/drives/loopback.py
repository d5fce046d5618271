"""The simulated drives in this process: a buffered far side on the plant.

Time comes from the clock given. Each call first executes all ticks that are due, as one
batch; nothing happens between calls. Between the last setpoint and the next one at rest
no tick passes and the plant stands still.
"""

import math
from typing import Final

import numpy as np

from cdhr_host.drives.checks import STANDS_WITHIN, check_rows, check_standing
from cdhr_host.drives.clock import Clock
from cdhr_host.drives.link import LinkState
from cdhr_host.drives.rows import RowQueue, joined, no_feedback
from cdhr_host.drives.watch import first_fault, underrun
from cdhr_host.errors import DriveError, Problem
from cdhr_host.motion.hold import ends_at_rest, path_true_stop, rows_needed
from cdhr_host.plant import Disturbance, Machine, undisturbed
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Feedback, Setpoints

LOOK_AHEAD: Final = 0.5
"""s of real time the buffer lasts beyond the reserve for a stop"""
MAX_LOOK_AHEAD: Final = 20_000
"""rows beyond the reserve, however fast the clock"""


class Loopback:
    """Six simulated servo axes and a pressure regulator behind a buffer of setpoints.

    The buffer holds LOOK_AHEAD of real time, more rows for a faster clock, and beyond that
    the reserve a path-true stop needs. The reserve is touched only by a stop, or when the
    last row fed is at rest with the air off; a tick that is due when nothing else is left
    is an underrun. The first row is executed when half the look-ahead is there, or a
    rest. ``standing`` (6,) m is where the sliders stand at first, the reference pose if None.
    """

    def __init__(
        self,
        profile: Profile,
        clock: Clock,
        *,
        standing: Array | None = None,
        disturbance: Disturbance = undisturbed,
    ) -> None:
        self.profile = profile
        self.state = LinkState.CLOSED
        self.stop_tick: int | None = None
        self._clock = clock
        self._machine = Machine(profile, disturbance)
        self._plant = self._machine.standing(np.zeros(6) if standing is None else standing)
        self._queue = RowQueue()
        self._executed: list[Feedback] = []
        self._reserve = rows_needed(profile)
        self._look_ahead = math.ceil(min(LOOK_AHEAD * clock.speed / profile.drives.period, MAX_LOOK_AHEAD))
        self._fault: DriveError | None = None
        self._told = True
        self._epoch: float | None = None
        self._ticks = 0
        self._next_tick: int | None = None
        self._tail = np.zeros((2, 6))
        self._silent = True
        self._rested_at = clock.now()

    @property
    def free(self) -> int:
        """Rows that ``feed`` would accept."""
        if self.state not in (LinkState.ARMED, LinkState.RUNNING):
            return 0
        return self._reserve + self._look_ahead - len(self._queue)

    @property
    def buffered(self) -> int:
        """Rows accepted and not executed yet."""
        return len(self._queue)

    def open(self) -> None:
        """CLOSED -> OPEN; an earlier fault is forgotten."""
        self._expect(LinkState.CLOSED)
        self._fault, self._told = None, True
        self.state = LinkState.OPEN

    def arm(self, start: Array) -> None:
        """OPEN or STOPPED -> ARMED, if the sliders stand within STANDS_WITHIN of (6,) ``start``."""
        self._expect(LinkState.OPEN, LinkState.STOPPED)
        check_standing(start, self._plant.slider)
        rested = self._clock.now() - self._rested_at
        self._plant = self._machine.standing(
            self._plant.slider, setpoint=start, pressure=self._plant.pressure, rested=rested
        )
        self.stop_tick, self._next_tick = None, None
        self._tail, self._silent = np.stack([start, start]), True
        self.state = LinkState.ARMED

    def feed(self, setpoints: Setpoints) -> int:
        """Buffer the first rows there is credit for; how many."""
        self._execute_due()
        self._raise_fault()
        self._expect(LinkState.ARMED, LinkState.RUNNING)
        if not len(setpoints):
            return 0
        fresh = self.state is LinkState.ARMED and self._next_tick is None
        reach = STANDS_WITHIN if fresh else None
        check_rows(setpoints, self.profile, tick=self._next_tick, before=self._tail[1], reach=reach)
        accepted = setpoints[: self.free]
        if len(accepted):
            self._accept(accepted)
        return len(accepted)

    def feedback(self) -> Feedback:
        """What was executed since the last call."""
        self._execute_due()
        self._raise_fault()
        executed, self._executed = self._executed, []
        return joined(executed) if executed else no_feedback()

    def stop(self) -> None:
        """Come to rest on the path, air off."""
        self._execute_due()
        if self.state is LinkState.CLOSED:
            self._expect(LinkState.OPEN)
        elif self.state is LinkState.ARMED:
            self._queue.clear()
            self._rest()
        elif self.state is LinkState.RUNNING:
            self._begin_stop()

    def close(self) -> None:
        """-> CLOSED; what moves plays its stop first."""
        if self.state is LinkState.CLOSED:
            return
        self.stop()
        while len(self._queue):
            self._play(self._queue.take(len(self._queue)))
        self._executed = []
        self.state = LinkState.CLOSED

    def _expect(self, *states: LinkState) -> None:
        if self.state is LinkState.FAULT and self._fault is not None:
            raise self._fault
        if self.state not in states:
            wanted = " or ".join(state.value for state in states)
            raise DriveError(Problem("state", f"the drives are {self.state.value}, not {wanted}"))

    def _raise_fault(self) -> None:
        if self._fault is not None and not self._told:
            self._told = True
            raise self._fault

    def _accept(self, rows: Setpoints) -> None:
        self._queue.append(rows)
        self._next_tick = int(rows.tick[-1]) + 1
        self._tail = np.vstack([self._tail, rows.slider[-2:]])[-2:]
        self._silent = bool(rows.pressure[-1] == 0.0)
        primed = len(self._queue) >= self._reserve + self._look_ahead // 2
        if self._epoch is None and (primed or self._may_run_dry()):
            self._epoch, self._ticks = self._clock.now(), 0
            self.state = LinkState.RUNNING

    def _may_run_dry(self) -> bool:
        """Whether the last row fed is at rest with the air off, or ends a stop."""
        return self.state is LinkState.STOPPING or (self._silent and ends_at_rest(self._tail, self.profile))

    def _execute_due(self) -> None:
        """Execute all ticks that are due by the clock, and find out when they run out."""
        while self._epoch is not None:
            due = self._due(self._epoch)
            left = len(self._queue) - (0 if self._may_run_dry() else self._reserve)
            count = min(due, left)
            if count > 0:
                self._ticks += count
                self._play(self._queue.take(count))
            elif not len(self._queue):
                self._rest()
            elif due > 0:
                self._trip(underrun(*self._head()))
            else:
                return

    def _due(self, epoch: float) -> int:
        elapsed = (self._clock.now() - epoch) / self.profile.drives.period
        return math.floor(elapsed + 1e-6) - self._ticks

    def _head(self) -> tuple[int, int]:
        """Tick and line of the next row in the buffer."""
        row = self._queue.take(1)
        self._queue.put_back(row)
        return int(row.tick[0]), int(row.line[0])

    def _play(self, rows: Setpoints) -> None:
        """Execute rows; from the first one out of its windows on, play the stop instead."""
        after, executed = self._machine.step(self._plant, rows)
        found = None if self._fault is not None else first_fault(rows, executed, self.profile.drives)
        if found is None:
            self._plant = after
            self._executed.append(executed)
            return
        row, fault = found
        self._plant, executed = self._machine.step(self._plant, rows[: row + 1])
        self._executed.append(executed)
        self._ticks -= len(rows) - row - 1
        self._queue.put_back(rows[row + 1 :])
        self._trip(fault)

    def _trip(self, fault: DriveError) -> None:
        self._fault, self._told = fault, False
        if self.state is LinkState.RUNNING:
            self._begin_stop()

    def _begin_stop(self) -> None:
        """Replace what is buffered by its path-true stop."""
        self.state = LinkState.STOPPING
        if not len(self._queue):
            self._rest()
            return
        stop = path_true_stop(self._queue.take(len(self._queue)), self.profile)
        self._queue.clear()
        self._queue.append(stop)
        self.stop_tick = int(stop.tick[0])

    def _rest(self) -> None:
        """Nothing is left to execute."""
        self._epoch = None
        self._rested_at = self._clock.now()
        if self._fault is not None:
            self.state = LinkState.FAULT
        elif self.state is not LinkState.RUNNING:
            self.state = LinkState.STOPPED
