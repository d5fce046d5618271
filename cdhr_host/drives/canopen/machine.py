"""The cycle: SYNC, answers, checks, setpoints; everything else of the master around it.

At the moment a cycle is due SYNC goes out: the drives sample and answer, and apply what the
cycle before told them. After ``ANSWERS`` of the period the answers are read and checked,
then the next setpoints leave. A setpoint told in cycle k acts from SYNC k+1 on, and what
became of it is in the answers to SYNC k+2: ``DEPTH`` cycles later.
"""

import math
from collections.abc import Callable, Iterator
from typing import Final

import numpy as np

from cdhr_host.drives.canopen.axis import SETPOINT, Axis
from cdhr_host.drives.canopen.bus import COUPLER, HOST, NODES, Bus, node_name
from cdhr_host.drives.canopen.cia402 import (
    DISABLE_VOLTAGE,
    FOLLOWS_TARGET,
    INTERPOLATE,
    STEPS_UP,
    SWITCH_ON,
    State,
)
from cdhr_host.drives.canopen.port import transport_fault
from cdhr_host.drives.canopen.setup import PRE_OPERATIONAL, START, Found, bring_up, drop_counter
from cdhr_host.drives.canopen.watch import Watch
from cdhr_host.drives.faults import fault
from cdhr_host.drives.slcan import Frame
from cdhr_host.drives.timing import Lateness
from cdhr_host.errors import DriveError
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Ints

ANSWERS: Final = 0.3
"""of the period until the answers to a SYNC are read"""
AT_LEAST: Final = 0.1
"""of the period the answers get when SYNC was late"""
DEPTH: Final = 2
HEARTBEAT: Final = 0.05
"""s between two heartbeats of the host; only the cycle sends them"""
TRANSITION: Final = 1.0
"""s a transition of a drive may take"""
SYNC_LENGTH: Final = 0x8240
"""EMCY code of a node that expects a SYNC of another length"""
ALIVE: Final = 3
"""answers each drive must have given before anything is enabled"""


def _nothing() -> None:
    """No cycle runs yet."""


class CanopenMachine:
    """Six axes and a coupler, one cycle at a time. Raises DriveError.

    ``due`` is when the next cycle begins; being late is a fault only while ``streaming``.
    """

    def __init__(self, profile: Profile, bus: Bus) -> None:
        self.profile = profile
        self.bus = bus
        self.axes = [Axis(node) for node in NODES[:6]]
        self.watch = Watch(profile, bus, self.axes)
        settings = profile.canopen
        watchdog = int(settings.setpoint_watchdog / profile.drives.period) - 1
        self.lateness = Lateness(watchdog if settings.allow_soft_realtime else 0)
        self.inputs = (0, 0, 0, 0)
        self.digital: int | None = None
        self.due = math.inf
        self.streaming = False
        self.found = Found()
        self._period = profile.drives.period
        self._beat = -math.inf
        self._counter = 0
        self._valve = -1
        self._feedback = {0x180 + axis.node: axis.heard for axis in self.axes}
        self._feedback |= {0x280 + axis.node: axis.heard_slow for axis in self.axes}
        self._late = False
        self._target: Ints = np.zeros(6, dtype=np.int64)
        self._pending: list[DriveError] = []

    @property
    def position(self) -> Ints:
        """(6,) position units, as last answered."""
        return np.array([axis.position for axis in self.axes], dtype=np.int64)

    def open(self) -> None:
        """Bring-up, then cycles until every drive has answered."""
        self.bus.on_frame, self.bus.background = self._take, _nothing
        self.found = bring_up(self.bus, self.profile)
        self.due = self.bus.clock.now() + self._period
        self.bus.command(START)
        for axis in self.axes:
            axis.answers = axis.missed = 0
        self.bus.boots.clear()
        try:
            self._await_answers()
        except DriveError:
            if not self.found.sync_counter or SYNC_LENGTH not in self.watch.codes:
                raise
            self._without_counter()
            self._await_answers()
        self.bus.background = self._keep_alive

    def _await_answers(self) -> None:
        self.run_until(lambda: all(axis.answers >= ALIVE for axis in self.axes), "answer SYNC", self._silent)

    def _without_counter(self) -> None:
        """A node that took 0x1019 and refuses its SYNC all the same: nobody gets a counter."""
        self.bus.command(PRE_OPERATIONAL)
        drop_counter(self.bus, self.found)
        self.bus.emergencies.clear()
        self.due = self.bus.clock.now() + self._period
        self.bus.command(START)

    def listen(self) -> Iterator[DriveError]:
        """Wait for the cycle, send SYNC, read and check the answers; what is wrong."""
        clock = self.bus.clock
        clock.wait_until(self.due)
        self._wake(clock.now())
        self.bus.port.send(self._beginning(clock.now()))
        for axis in self.axes:
            axis.missed += 1
        clock.wait_until(max(self.due + ANSWERS * self._period, clock.now() + AT_LEAST * self._period))
        self.bus.pump()
        pending, self._pending = self._pending, []
        yield from pending
        if (trouble := self.bus.port.trouble) is not None:
            yield transport_fault(trouble)
        yield from self.watch.findings(clock.now(), streaming=self.streaming)
        late, self._late = self._late, False
        if late and self.streaming:
            worst = self.lateness.summary().max
            yield fault(
                "setpoint-late", f"setpoints came too late for the drives, {worst * 1e3:.1f} ms at worst"
            )

    def tell(self, target: Ints, feed_forward: Ints, pressure: int) -> None:
        """(6,) position units, (6,) thousandths of rated torque, raw pressure; ends the cycle."""
        self._target = target
        frames = [
            (0x200 + axis.node, SETPOINT.pack(axis.word, int(at), int(torque)))
            for axis, at, torque in zip(self.axes, target, feed_forward, strict=True)
        ]
        frames.append((0x300 + COUPLER, pressure.to_bytes(2, "little", signed=True) + bytes(6)))
        if self._valve != (valve := int(pressure > 0)):
            self._valve = valve
            frames.append((0x200 + COUPLER, bytes([valve])))
        self.bus.port.send(frames)
        self.due += self._period

    def hold(self, target: Ints | None = None, feed_forward: Ints | None = None) -> None:
        """Tell every axis to stay: at ``target``, or where it is; air off."""
        torque = np.zeros(6, dtype=np.int64) if feed_forward is None else feed_forward
        self.tell(self.position if target is None else target, torque, 0)

    def enable(self) -> Ints:
        """Step by step to operation enabled, without a bump; (6,) where the axes are held.

        Axes that are still enabled from the run before stay so.
        """
        if self.watch.enabled:
            return self._target
        held = self.position
        try:
            for word, state in STEPS_UP:
                for axis in self.axes:
                    axis.word = word
                self.run_until(self._all(state), f"become {state.value}", self._not(state), held)
            self._released(held)
        except DriveError:
            self.disable()
            raise
        for axis in self.axes:
            axis.unfollowing = 0
            if self.profile.canopen.mode == "ip":
                axis.word = INTERPOLATE
        self.watch.enabled = True
        return held

    def disable(self) -> None:
        """Torque off, brakes closed: switched on where enabled, nothing anywhere else."""
        self.watch.enabled = False
        for axis in self.axes:
            axis.word = DISABLE_VOLTAGE if axis.word == DISABLE_VOLTAGE else SWITCH_ON

    def release(self) -> None:
        """Voltage off: the last words before closing."""
        self.watch.enabled = False
        for axis in self.axes:
            axis.word = DISABLE_VOLTAGE

    def run_until(
        self,
        done: Callable[[], bool],
        what: str,
        waiting: Callable[[Axis], bool],
        held: Ints | None = None,
    ) -> None:
        """Run cycles that hold still until something is so; names the axes that hang after TRANSITION."""
        deadline = self.bus.clock.now() + TRANSITION
        while True:
            if findings := list(self.listen()):
                raise findings[0]
            self.hold(held)
            if done():
                return
            if self.bus.clock.now() > deadline:
                names = ", ".join(node_name(axis.node) for axis in self.axes if waiting(axis))
                states = {axis.state.value for axis in self.axes if waiting(axis)}
                raise fault("axis-hangs", f"{names} did not {what} in {TRANSITION:g} s: {', '.join(states)}")

    def _keep_alive(self) -> None:
        """A cycle that holds still, while someone waits for an SDO."""
        if self.bus.clock.now() >= self.due:
            self._pending = list(self.listen())
            self.hold()

    def _released(self, held: Ints) -> None:
        """Wait for the brakes, then for every axis to follow its target."""
        open_at = self.bus.clock.now() + self.profile.canopen.brake_release
        self.run_until(
            lambda: self.bus.clock.now() >= open_at and all(a.status & FOLLOWS_TARGET for a in self.axes),
            "follow its target (status word bit 12)",
            lambda axis: not axis.status & FOLLOWS_TARGET,
            held,
        )

    def _all(self, state: State) -> Callable[[], bool]:
        return lambda: all(axis.state is state for axis in self.axes)

    def _not(self, state: State) -> Callable[[Axis], bool]:
        return lambda axis: axis.state is not state

    def _silent(self, axis: Axis) -> bool:
        return axis.answers < ALIVE

    def _wake(self, now: float) -> None:
        """SYNC is ours: less than a period late it only jitters, beyond that cycles are skipped."""
        late = now - self.due
        self.lateness.woke(max(late, 0.0))
        if late >= self._period:
            skipped = math.floor(late / self._period)
            self.due += skipped * self._period
            self._late |= self.lateness.missed(skipped)

    def _beginning(self, now: float) -> list[Frame]:
        """SYNC, and the host's heartbeat when it is due."""
        self._counter = self._counter % 240 + 1
        sync: Frame = (0x80, bytes([self._counter]) if self.found.sync_counter else b"")
        if now - self._beat < HEARTBEAT - 1e-9:
            return [sync]
        self._beat = now
        return [sync, (0x700 + HOST, b"\x05")]

    def _take(self, frame: Frame) -> bool:
        """Process data; whether the frame was that."""
        cob, data = frame
        if handler := self._feedback.get(cob):
            handler(data)
        elif cob == 0x280 + COUPLER and len(data) == 8:
            pair = np.frombuffer(data, "<i2").tolist()
            self.inputs = (pair[0], pair[1], pair[2], pair[3])
        elif cob == 0x180 + COUPLER and len(data) == 1:
            self.digital = data[0]
        else:
            return False
        return True
