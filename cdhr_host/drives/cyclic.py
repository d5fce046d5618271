"""A link whose drives take one setpoint a cycle: the buffer is here, the cycle too.

``turn`` is one cycle; whoever owns the link calls it again and again, in time. All other
calls only look at or change what the next cycle will do, except ``open``, ``arm`` and
``close``, which run cycles until they are done.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdhr_host.drives.base import TAKING, BufferedLink
from cdhr_host.drives.canopen.axis import Axis
from cdhr_host.drives.canopen.bus import Bus
from cdhr_host.drives.canopen.machine import DEPTH, CanopenMachine
from cdhr_host.drives.canopen.port import Port
from cdhr_host.drives.canopen.referencing import Referencing
from cdhr_host.drives.canopen.scaling import Scaling
from cdhr_host.drives.checks import check_standing
from cdhr_host.drives.clock import Clock
from cdhr_host.drives.faults import fault
from cdhr_host.drives.link import LinkState, Told, untold
from cdhr_host.drives.reference import ReferenceStore
from cdhr_host.drives.timing import CycleTiming
from cdhr_host.drives.watch import first_fault, underrun
from cdhr_host.errors import DriveError, Problem
from cdhr_host.motion.hold import path_true_stop
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Feedback, Ints, Setpoints

LINGER: Final = 0.05
"""s the drives hold position after a run before their brakes close"""
LEAD: Final = 0.02
"""s between the wish to stop and the stop's first row, in which it is worked out"""
EASE: Final = 25
"""cycles in which the last micrometres to a run's start are covered"""
MOVING = (LinkState.RUNNING, LinkState.STOPPING)


@dataclass(slots=True)
class _Sent:
    row: Setpoints
    counts: Ints


class CyclicLink(BufferedLink):
    """MachineLink over CANopen; ``connect`` opens the bus, ``store`` keeps references."""

    def __init__(
        self, profile: Profile, clock: Clock, connect: Callable[[], Port], store: ReferenceStore
    ) -> None:
        self._lead = math.ceil(LEAD / profile.drives.period)
        super().__init__(profile, clock.speed, self._lead)
        self.resolution = profile.canopen.position_unit
        self._connect = connect
        self._machine: CanopenMachine | None = None
        self._clock = clock
        self._reference = Referencing(profile, store)
        self._scaling = Scaling(profile)
        self._flying: deque[_Sent | None] = deque()
        self._held: Ints = np.zeros(6, dtype=np.int64)
        self._torque: Ints = np.zeros(6, dtype=np.int64)
        self._rested_at: float | None = None
        self._pressure = 0.0
        self._playing = False
        self._told_before: deque[Array] = deque(maxlen=1)
        self._planner: ThreadPoolExecutor | None = None
        self._planning: Future[Setpoints] | None = None

    @property
    def machine(self) -> CanopenMachine:
        """The master; DriveError while the link is closed."""
        if self._machine is None:
            raise DriveError(Problem("state", "the drives are closed, not open"))
        return self._machine

    @property
    def due(self) -> float:
        """When the next ``turn`` begins; infinite when there is no cycle."""
        return math.inf if self._machine is None else self._machine.due

    @property
    def buffered(self) -> int:
        """Rows accepted whose outcome has not come back."""
        return super().buffered + sum(sent is not None for sent in self._flying)

    @property
    def slider(self) -> Array:
        """(6,) m, as last answered."""
        return self._scaling.slider(self.machine.position)

    @property
    def notes(self) -> list[str]:
        """What bring-up and the cycles noticed without stopping."""
        return [*self.machine.found.notes, *self.machine.watch.warnings]

    def timing(self) -> CycleTiming | None:
        """Lateness of the cycles since arming."""
        return self._machine.lateness.summary() if self._machine is not None else None

    def open(self) -> None:
        """CLOSED -> OPEN: bring-up."""
        self._expect(LinkState.CLOSED)
        self._forget()
        self._scaling = Scaling(self.profile)
        port = self._connect()
        try:
            machine = CanopenMachine(self.profile, Bus(port, self._clock))
            machine.open()
        except BaseException:
            port.close()
            raise
        self._machine, self._planner = machine, ThreadPoolExecutor(1, "stop")
        self._planner.submit(int)  # starts the thread now, not in the cycle that wants to stop
        self._reference.adopt(machine)
        self._scaling = Scaling(self.profile, self._reference.zero)
        self.state = LinkState.OPEN

    def arm(self, start: Array) -> None:
        """OPEN or STOPPED -> ARMED: enabled, holding (6,) m ``start``."""
        self._expect(LinkState.OPEN, LinkState.STOPPED)
        self._reference.check(self.machine)
        check_standing(start, self.slider)
        for axis in self.machine.axes:
            self._check_ready(axis)
        self._held = self.machine.enable()
        self._ease(self._scaling.counts(start))
        self.machine.lateness.reset()
        self._buffer.start(start)
        self._flying.clear()
        self._told_before = deque(maxlen=self.machine.watch.stale)
        self._playing = False
        self.stop_tick, self._rested_at = None, None
        self.state = LinkState.ARMED

    def feed(self, setpoints: Setpoints) -> int:
        """Buffer the first rows there is credit for; how many."""
        self._raise_fault()
        self._expect(*TAKING)
        self._scaling.feed_forward(np.where(np.isfinite(setpoints.tension), setpoints.tension, 0.0))
        count = self._buffer.feed(setpoints)
        self._run_when_primed()
        return count

    @property
    def revisable(self) -> int:
        """First tick that ``revise`` may still replace."""
        return self._buffer.revisable

    def revise(self, rows: Setpoints) -> None:
        """Replace what is buffered from ``rows.tick[0]`` on; between two turns, so never half."""
        self._raise_fault()
        self._expect(*TAKING)
        self._scaling.feed_forward(np.where(np.isfinite(rows.tension), rows.tension, 0.0))
        self._buffer.revise(rows)
        self._run_when_primed()

    def room_from(self, tick: int) -> int:
        """Rows a revision from this tick on may have."""
        return self._buffer.room_from(tick)

    @property
    def next_tick(self) -> int:
        """The tick that ``feed`` expects."""
        return self._buffer.next_tick

    def stop(self) -> None:
        """Come to rest on the path, air off."""
        self.interrupted = False
        if self.state is LinkState.CLOSED:
            self._expect(LinkState.OPEN)
        elif self.state is LinkState.ARMED:
            self._buffer.drop()
            self._rest()
        elif self.state is LinkState.RUNNING:
            self._begin_stop()

    def close(self) -> None:
        """-> CLOSED; what moves is stopped on the path first, then the drives lose their voltage."""
        if self.state is LinkState.CLOSED:
            return
        self.stop()
        while self.state is LinkState.STOPPING or self._rested_at is not None:
            self.turn()
        if math.isfinite(self.machine.due):
            self._farewell()
        self.machine.bus.port.close()
        if self._planner is not None:
            self._planner.shutdown()
        self._machine = self._planner = None
        self._executed = []
        self.state = LinkState.CLOSED

    @property
    def referenced(self) -> bool:
        """Whether every axis knows the reference pose."""
        try:
            self._reference.check(self.machine)
        except DriveError:
            return False
        return True

    def home(self, told: Told = untold, *, should_stop: Callable[[], bool] | None = None) -> None:
        """Reference every axis by homing, where the profile says so. OPEN or STOPPED only."""
        self._expect(LinkState.OPEN, LinkState.STOPPED)
        try:
            self._reference.home(self.machine, should_stop or (lambda: self.interrupted), told)
        finally:
            self.interrupted = False

    def set_reference(self) -> None:
        """The machine stands at its reference pose: remember it for each drive's serial number."""
        self._expect(LinkState.OPEN, LinkState.STOPPED)
        self._reference.set(self.machine)
        self._scaling = Scaling(self.profile, self._reference.zero)

    def turn(self) -> None:
        """One cycle: waits for it, listens, and tells the next setpoint."""
        try:
            for finding in self.machine.listen():
                self._trip(finding)
            self._land()
            sent = self._next()
            self._flying.append(sent)
            self._tell(sent)
        except DriveError as gone:
            self._lose(gone)

    def _run_when_primed(self) -> None:
        if self._buffer.primed:
            self.state, self._playing = LinkState.RUNNING, True

    def _tell(self, sent: _Sent | None) -> None:
        if sent is None:
            self._pressure = 0.0
            enabled = self.machine.watch.enabled
            self.machine.hold(self._held if enabled else None, self._torque if enabled else None)
        else:
            self._pressure = float(sent.row.pressure[0])
            self._held = sent.counts
            self._torque = self._scaling.feed_forward(sent.row.tension[0])
            self.machine.tell(sent.counts, self._torque, self._scaling.pressure_raw(self._pressure))

    def _next(self) -> _Sent | None:
        """The row of this cycle; None to hold."""
        self.machine.streaming = self.state in MOVING
        if self.state not in MOVING:
            self._linger()
            return None
        if self._playing and self._buffer.ready <= 0 and len(self._buffer):
            self._trip(underrun(*self._buffer.head()))
        self._stop_when_planned()
        if len(self._buffer) and (self._playing or self.state is LinkState.STOPPING):
            row = self._buffer.take(1)
            return _Sent(row, self._scaling.counts(row.slider[0]))
        self._playing = False
        self._rest_when_landed()
        return None

    def _rest_when_landed(self) -> None:
        if self.state is LinkState.STOPPING and self._planning is None and not any(self._flying):
            self._rest()

    def _land(self) -> None:
        """What the answers just read say about the row told DEPTH cycles ago."""
        done = self._flying.popleft() if len(self._flying) == DEPTH else None
        if done is not None:
            feedback = self._outcome(done)
            self._executed.append(feedback)
            self._told_before.append(feedback.setpoint)
            if first_fault(done.row, feedback, self.profile.drives) is not None:
                found = first_fault(done.row, self._judged(feedback), self.profile.drives)
                if found is not None:
                    self._trip(found[1])
        for finding in self._watched(self._clock.now()):
            self._trip(finding)

    def _judged(self, feedback: Feedback) -> Feedback:
        """With the nearest setpoint that the measured position may be the answer to.

        An answer may be some cycles old where drives answer every n-th SYNC, and where soft real
        time is allowed.
        """
        known = np.concatenate(self._told_before)
        return replace(feedback, setpoint=np.clip(feedback.slider, known.min(axis=0), known.max(axis=0)))

    def _watched(self, now: float) -> Iterator[DriveError]:
        if self.state not in (LinkState.ARMED, *MOVING):
            return
        raw = self.machine.inputs[0]
        yield from self.machine.watch.pressure(now, self._pressure, self._scaling.pressure(raw), raw)
        if self.machine.digital is not None and not self.machine.digital & 1:
            yield fault("emergency-stop", "the emergency stop is pressed")
        elif self.machine.digital is not None and not self.machine.digital & 2:
            yield fault("air-lost", "the coupler reports no air supply")

    def _outcome(self, done: _Sent) -> Feedback:
        position = self.machine.position
        torque = np.array([axis.torque for axis in self.machine.axes], dtype=np.float64)
        raw = self.machine.inputs
        return Feedback(
            tick=done.row.tick,
            setpoint=self._scaling.slider(done.counts)[None],
            slider=self._scaling.slider(position)[None],
            counts=position[None],
            torque=self._scaling.torque(torque)[None],
            pressure=np.array([self._scaling.pressure(raw[0])]),
            force=np.array([[self._scaling.force(value) for value in raw[1:]]]),
        )

    def _trip(self, found: DriveError) -> None:
        if not self._note(found):
            return
        self._reference.forget_lost(self.machine)
        if self.state is LinkState.RUNNING:
            self._begin_stop()
        elif self.state is not LinkState.STOPPING:
            self._rest()

    def _lose(self, gone: DriveError) -> None:
        """The bus is gone: nothing can be told any more; the drives' own watchdogs stop them."""
        self._note(gone)
        self._buffer.drop()
        self._planning = None
        self._flying.clear()
        self._rested_at = None
        self.machine.due = math.inf
        self.state = LinkState.FAULT

    def _begin_stop(self) -> None:
        """Air off at once; the stop is worked out beside the cycles of its lead, not within one."""
        self.state = LinkState.STOPPING
        if len(self._buffer):
            ahead = self._buffer.begin_stop_after(self._lead)
            if len(ahead) and self._planner is not None:
                self.stop_tick = int(ahead.tick[0])
                self._planning = self._planner.submit(path_true_stop, ahead, self.profile)
        self._rest_when_landed()

    def _stop_when_planned(self) -> None:
        """The stop's rows, once those of its lead are played."""
        if self._planning is not None and not len(self._buffer):
            planned, self._planning = self._planning, None
            self._buffer.append_stop(planned.result())

    def _rest(self) -> None:
        self.state = LinkState.FAULT if self._fault is not None else LinkState.STOPPED
        self._rested_at = self._clock.now()

    def _linger(self) -> None:
        """Some time after a run the brakes close."""
        if self._rested_at is not None and self._clock.now() - self._rested_at >= LINGER:
            self._rested_at = None
            self.machine.disable()

    def _ease(self, start: Ints) -> None:
        """From where the axes were enabled to a run's start, smoothly."""
        held = self._held
        for k in range(1, EASE + 1):
            z = k / EASE
            at = np.rint(held + (start - held) * z * z * (3.0 - 2.0 * z)).astype(np.int64)
            if findings := list(self.machine.listen()):
                self.machine.disable()
                raise findings[0]
            self.machine.hold(at)
        self._held = start

    def _farewell(self) -> None:
        """Voltage off and a few cycles to say so; a bus that is gone needs no farewell."""
        self.machine.release()
        for _ in range(3):
            self.turn()

    def _check_ready(self, axis: Axis) -> None:
        if axis.state.value.startswith("fault"):
            raise fault(
                "drive-fault", f"drive {axis.node} is in fault (0x{axis.error:04X}): nothing may move"
            )
