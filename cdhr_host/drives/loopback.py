"""The simulated drives in this process: a buffered far side on the plant.

Time comes from the clock given. Each call first executes all ticks that are due, as one
batch; nothing happens between calls. Between the last setpoint and the next one at rest
no tick passes and the plant stands still.
"""

import math

import numpy as np

from cdhr_host.drives.base import TAKING, BufferedLink
from cdhr_host.drives.checks import check_standing
from cdhr_host.drives.clock import Clock
from cdhr_host.drives.link import LinkState
from cdhr_host.drives.watch import first_fault, underrun
from cdhr_host.errors import DriveError
from cdhr_host.plant import Disturbance, Machine, undisturbed
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Setpoints


class Loopback(BufferedLink):
    """Six simulated servo axes and a pressure regulator behind a buffer of setpoints.

    A tick that is due when only the reserve for a stop is left is an underrun. The first row
    is executed when half the look-ahead is there, or a rest. ``standing`` (6,) m is where the
    sliders stand at first, the reference pose if None.
    """

    def __init__(
        self,
        profile: Profile,
        clock: Clock,
        *,
        standing: Array | None = None,
        disturbance: Disturbance = undisturbed,
    ) -> None:
        super().__init__(profile, clock.speed)
        self._clock = clock
        self._machine = Machine(profile, disturbance)
        self._plant = self._machine.standing(np.zeros(6) if standing is None else standing)
        self._epoch: float | None = None
        self._ticks = 0
        self._rested_at = clock.now()

    @property
    def resolution(self) -> float:
        """M: the rows are taken as they are."""
        return 0.0

    @property
    def slider(self) -> Array:
        """(6,) m, of the simulated machine."""
        return self._plant.slider

    def open(self) -> None:
        """CLOSED -> OPEN; an earlier fault is forgotten."""
        self._expect(LinkState.CLOSED)
        self._forget()
        self.state = LinkState.OPEN

    def arm(self, start: Array) -> None:
        """OPEN or STOPPED -> ARMED, if the sliders stand within STANDS_WITHIN of (6,) ``start``."""
        self._expect(LinkState.OPEN, LinkState.STOPPED)
        check_standing(start, self._plant.slider)
        rested = self._clock.now() - self._rested_at
        self._plant = self._machine.standing(
            self._plant.slider, setpoint=start, pressure=self._plant.pressure, rested=rested
        )
        self.stop_tick = None
        self._buffer.start(start)
        self.state = LinkState.ARMED

    def feed(self, setpoints: Setpoints) -> int:
        """Buffer the first rows there is credit for; how many."""
        self._catch_up()
        self._raise_fault()
        self._expect(*TAKING)
        count = self._buffer.feed(setpoints)
        self._run_when_primed()
        return count

    @property
    def revisable(self) -> int:
        """First tick that ``revise`` may still replace."""
        self._catch_up()
        return self._buffer.revisable

    def revise(self, rows: Setpoints) -> None:
        """Replace what is buffered from ``rows.tick[0]`` on."""
        self._catch_up()
        self._raise_fault()
        self._expect(*TAKING)
        self._buffer.revise(rows)
        self._run_when_primed()

    def stop(self) -> None:
        """Come to rest on the path, air off."""
        self._catch_up()
        if self.state is LinkState.CLOSED:
            self._expect(LinkState.OPEN)
        elif self.state is LinkState.ARMED:
            self._buffer.drop()
            self._rest()
        elif self.state is LinkState.RUNNING:
            self._begin_stop()

    def close(self) -> None:
        """-> CLOSED; what moves plays its stop first."""
        if self.state is LinkState.CLOSED:
            return
        self.stop()
        while len(self._buffer):
            self._play(self._buffer.take(len(self._buffer)))
        self._executed = []
        self.state = LinkState.CLOSED

    def _run_when_primed(self) -> None:
        if self._epoch is None and self._buffer.primed:
            self._epoch, self._ticks = self._clock.now(), 0
            self.state = LinkState.RUNNING

    def _catch_up(self) -> None:
        """Execute all ticks that are due by the clock, and find out when they run out."""
        while self._epoch is not None:
            due = self._due(self._epoch)
            count = min(due, self._buffer.ready)
            if count > 0:
                self._ticks += count
                self._play(self._buffer.take(count))
            elif not len(self._buffer):
                self._rest()
            elif due > 0:
                self._trip(underrun(*self._buffer.head()))
            else:
                return

    def _due(self, epoch: float) -> int:
        elapsed = (self._clock.now() - epoch) / self.profile.drives.period
        return math.floor(elapsed + 1e-6) - self._ticks

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
        self._buffer.put_back(rows[row + 1 :])
        self._trip(fault)

    def _trip(self, fault: DriveError) -> None:
        self._note(fault)
        if self.state is LinkState.RUNNING:
            self._begin_stop()

    def _begin_stop(self) -> None:
        """Replace what is buffered by its path-true stop."""
        self.state = LinkState.STOPPING
        self.stop_tick = self._buffer.begin_stop()
        if self.stop_tick is None:
            self._rest()

    def _rest(self) -> None:
        """Nothing is left to execute."""
        self._epoch = None
        self._rested_at = self._clock.now()
        if self._fault is not None:
            self.state = LinkState.FAULT
        elif self.state is not LinkState.RUNNING:
            self.state = LinkState.STOPPED
