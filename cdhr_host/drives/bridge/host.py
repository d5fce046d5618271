"""The host's side of the framed link: a MachineLink over a motion bridge that buffers."""

import math
import struct
from collections.abc import Callable
from contextlib import suppress
from typing import Final

import numpy as np

from cdhr_host.drives.base import TAKING, BufferedLink
from cdhr_host.drives.bridge import messages as m
from cdhr_host.drives.bridge.frames import Frame, Type
from cdhr_host.drives.bridge.line import Line
from cdhr_host.drives.bridge.session import Session
from cdhr_host.drives.bridge.stop import stop_rows
from cdhr_host.drives.bridge.window import Pending, Window
from cdhr_host.drives.buffer import too_late
from cdhr_host.drives.canopen.scaling import Scaling
from cdhr_host.drives.checks import check_shapes, check_standing
from cdhr_host.drives.clock import Clock
from cdhr_host.drives.faults import fault
from cdhr_host.drives.link import LinkState
from cdhr_host.errors import DriveError
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Feedback, Setpoints

TURN: Final = 0.01
"""s between two turns"""
KEEPALIVE: Final = 0.02
RETRY: Final = 0.1
"""s without progress after which setpoints are sent again"""
ANSWER: Final = 2.0
SPARE: Final = 16
"""rows beyond the low water that a revision must have before the bridge changes over"""
GUARD: Final = 0.05
"""s between asking for a revision and its first tick, besides the time the line needs"""
STATES: Final = {
    m.State.IDLE: LinkState.STOPPED,
    m.State.PRIMING: LinkState.ARMED,
    m.State.RUN: LinkState.RUNNING,
    m.State.STOPPING: LinkState.STOPPING,
    m.State.FAULT: LinkState.FAULT,
}


class BridgeLink(BufferedLink):
    """MachineLink over a bridge; ``turn`` moves frames and must be called every TURN or so."""

    def __init__(self, profile: Profile, clock: Clock, connect: Callable[[], Line]) -> None:
        super().__init__(profile, clock.speed)
        self.resolution = profile.canopen.position_unit
        self.due = math.inf
        self.naks = 0
        self._clock, self._connect = clock, connect
        self._scaling = Scaling(profile)
        self._config = m.config(profile)
        self._session: Session | None = None
        self._period = profile.drives.period
        self._staged = m.low_water(profile) + SPARE
        self._number = 0
        self._status: m.Status | None = None
        self._status_at = clock.now()
        self._first: int | None = None
        self._pending: Pending | None = None
        self._begin_run()

    @property
    def slider(self) -> Array:
        """(6,) m, as last told."""
        assert self._status is not None
        return self._scaling.slider(np.array(self._status.position, dtype=np.int64))

    def stop_rows(self, ahead: Setpoints) -> Setpoints:
        """What the bridge plays instead of ``ahead``."""
        counts = self._scaling.counts(ahead.slider)
        return stop_rows(ahead, counts, self._scaling.unit, self.profile)

    def open(self) -> None:
        """CLOSED -> OPEN: greet, tell the machine's limits."""
        self._expect(LinkState.CLOSED)
        line = self._connect()
        self._session = Session(line, self._clock)
        self._status = None
        self._guard = GUARD + self._staged * m.PER_TICK / line.rate
        self._acked = self._greeted = False
        self._forget()
        self._begin_run()
        self.due = self._clock.now()
        try:
            hello = m.HELLO.pack(1, 1, m.ROLE_HOST, 6, 0, 0, 1, 0, bytes(8))
            self._repeat(Type.HELLO, hello, lambda: self._greeted, "the bridge does not answer")
            self._repeat(Type.CONFIG, self._config, lambda: self._acked, "the bridge keeps another config")
            self._until(lambda: self._status is not None, "the bridge says no status")
        except DriveError:
            line.close()
            self._session, self.due = None, math.inf
            raise
        self.state = LinkState.OPEN

    def arm(self, start: Array) -> None:
        """OPEN or STOPPED -> ARMED, holding (6,) m ``start``."""
        self._expect(LinkState.OPEN, LinkState.STOPPED)
        check_standing(start, self.slider)
        self._begin_run()
        self._buffer.start(start)
        counts = self._scaling.counts(start)
        payload = m.ARM.pack(m.config_crc(self._config), *counts.tolist())
        self._status = None
        armed = self._in_state(m.State.PRIMING)
        self._repeat(Type.ARM, payload, armed, "the bridge does not arm")
        self.state = LinkState.ARMED

    def feed(self, setpoints: Setpoints) -> int:
        """Take the first rows there is credit for; how many."""
        self._raise_fault()
        self._expect(*TAKING)
        self._scaling.feed_forward(np.where(np.isfinite(setpoints.tension), setpoints.tension, 0.0))
        accepted = setpoints[: self._buffer.feed(setpoints)]
        if not len(accepted):
            return 0
        if self._first is None:
            self._first = self._collected = int(accepted.tick[0])
            self._window.begin(self._first)
        self._window.add(self._encoded(accepted), rests=self._buffer.at_rest)
        self._send_setpoints()
        self._run_when_primed()
        return len(accepted)

    @property
    def revisable(self) -> int:
        """First tick that ``revise`` may still replace: later by what it takes to send one."""
        first = self._buffer.revisable
        if self._status is not None and self._status.state is m.State.RUN:
            told = self._clock.now() - self._status_at
            first = max(first, self._status.tick + math.ceil((told + self._guard) / self._period))
        return min(first, self._buffer.next_tick)

    def revise(self, rows: Setpoints) -> None:
        """Replace what is buffered from ``rows.tick[0]`` on, at the bridge and here."""
        self._raise_fault()
        self._expect(*TAKING)
        check_shapes(rows)
        if len(rows) and int(rows.tick[0]) < self.revisable:
            raise too_late(int(rows.tick[0]), self.revisable, self._buffer.next_tick)
        revision = self._buffer.revision(rows)
        if revision.first == self._buffer.next_tick:
            self.feed(rows)
            return
        staged = min(len(rows), self._staged)
        self._number = self._number % 255 + 1
        self._pending = Pending(
            self._number, revision, self._encoded(rows), staged, revision.rests(self.profile)
        )
        self._refused_late = False
        self._send_revision()
        self._wait(
            lambda: self._pending is None or self.state not in TAKING or self._fault is not None, ANSWER
        )
        self._raise_fault()
        if self._refused_late:
            raise too_late(revision.first, self.revisable, self._buffer.next_tick)
        if self._pending is not None:
            self._pending = None
            raise fault("bridge", f"the bridge does not answer a revision in {ANSWER:g} s")

    def stop(self) -> None:
        """Come to rest on the path, air off."""
        if self.state is LinkState.CLOSED:
            self._expect(LinkState.OPEN)
        if self.state not in TAKING:
            return
        self._stopping = True
        for _ in range(3):
            self._send(Type.STOP, b"\0")
        self._status = None
        resting = {m.State.STOPPING, m.State.IDLE, m.State.FAULT}
        self._until(lambda: self._status is not None and self._status.state in resting, "no stop")
        if self.state is LinkState.ARMED or self._status is None or self._status.stop_tick is None:
            self._buffer.drop()
            self.state = LinkState.STOPPED
        else:
            self.stop_tick = self._status.stop_tick
            self.state = LinkState.STOPPING

    def close(self) -> None:
        """-> CLOSED; what moves is stopped on the path first."""
        if self._session is None:
            return
        try:
            self.stop()
            self._until(lambda: self.state is not LinkState.STOPPING, "no rest", 30.0)
            self._send(Type.DISARM, b"")
        except DriveError as error:
            self._fault = error
        self._session.line.close()
        self._session, self.due = None, math.inf
        self.state = LinkState.CLOSED

    def turn(self) -> None:
        """Read, answer, send what there is credit for."""
        if self._session is None or self.due == math.inf:
            return
        self._clock.wait_until(self.due)
        self.poll()

    def poll(self) -> None:
        """A turn now, whatever is due."""
        if self._session is None or self.due == math.inf:
            return
        self.due = self._clock.now() + TURN
        try:
            self._read()
            self._send_setpoints()
            if self._clock.now() - self._session.sent_at >= KEEPALIVE:
                now = int(self._clock.now() * 1e3) & 0xFFFFFFFF
                self._send(Type.KEEPALIVE, m.KEEPALIVE.pack(now, max(self._collected, 0)))
        except DriveError as gone:
            self._note(gone)
            self.state, self.due = LinkState.FAULT, math.inf

    def _begin_run(self) -> None:
        self._first, self._pending = None, None
        self._collected = 0
        self._window = Window()
        self._committed = 0
        self._refused_late = self._stopping = False
        self._progress = self._clock.now()
        self.stop_tick = None

    def _read(self) -> None:
        assert self._session is not None
        for frame in self._session.frames():
            with suppress(struct.error):
                self._take(frame)

    def _take(self, frame: Frame) -> None:
        payload = frame.payload
        if frame.type == Type.HELLO_ACK:
            self._greeted = m.HELLO_ACK.unpack(payload)[3] == 6
        elif frame.type == Type.CONFIG_ACK:
            self._acked = struct.unpack("<I", payload)[0] == m.config_crc(self._config)
        elif frame.type == Type.STATUS:
            self._take_status(m.status(payload))
        elif frame.type == Type.EXECUTED:
            self._take_executed(payload)
        elif frame.type == Type.NAK:
            self._take_nak(*m.NAK.unpack(payload))
        elif frame.type == Type.FAULT:
            code, axis, _, tick, _, *_ = m.FAULT.unpack(payload)
            kind, text = m.FAULTS.get(code, ("bridge", f"the bridge reports fault {code}"))
            where = f" (slider {axis + 1})" if axis < 6 else ""
            self._note(fault(kind, f"{text}{where} at tick {tick}"))

    def _take_status(self, told: m.Status) -> None:
        self._status = told
        self._status_at = self._clock.now()
        if self._pending is not None and told.revision == self._pending.number:
            self._revised(self._pending)
        elif self._pending is not None and told.tick > self._pending.revision.first:
            self._pending, self._refused_late = None, True
        current = self._first is not None and told.revision == self._committed
        if current and (self._window.acknowledge(told.expected) or not self._window.unanswered):
            self._progress = self._clock.now()
        if told.stop_tick is not None:
            self.stop_tick = told.stop_tick
        if told.state is m.State.STOPPING:
            self.state = LinkState.STOPPING
        elif told.state is m.State.FAULT and self._fault is not None:
            self.state = LinkState.FAULT
        elif told.state is m.State.IDLE and self.state is LinkState.STOPPING and told.tick <= self._collected:
            self.state = LinkState.FAULT if self._fault else LinkState.STOPPED
            self._buffer.drop()

    def _take_nak(self, expected: int, reason: int, revision: int, _credit: int) -> None:
        self.naks += 1
        if reason == m.LATE and self._pending is not None and revision == self._pending.number:
            self._pending, self._refused_late = None, True
        elif self._first is not None and self._pending is None and revision == self._committed:
            self._window.back_to(expected)

    def _take_executed(self, payload: bytes) -> None:
        start, count = m.EXECUTED.unpack_from(payload)
        if self._first is None or start > self._collected:
            return
        for k in range(self._collected - start, count):
            values = m.EXECUTED_TICK.unpack_from(payload, m.EXECUTED.size + k * m.EXECUTED_TICK.size)
            self._executed.append(self._row(start + k, values))
            self._collected += 1
            if len(self._buffer):
                self._buffer.take(1)

    def _row(self, tick: int, values: tuple[int, ...]) -> Feedback:
        position = np.array([values[6:12]], dtype=np.int64)
        return Feedback(
            tick=np.array([tick], dtype=np.int64),
            setpoint=self._scaling.slider(np.array([values[:6]], dtype=np.int64)),
            slider=self._scaling.slider(position),
            counts=position,
            torque=self._scaling.torque(np.array([values[12:18]], dtype=np.float64)),
            pressure=np.array([values[18] * m.PRESSURE_UNIT]),
        )

    def _send_setpoints(self) -> None:
        """What the bridge has room for, in frames of up to eight ticks."""
        if self._first is None or self._stopping or self._status is None or self._fault is not None:
            return
        overdue = self._clock.now() - self._progress > RETRY
        if overdue:
            self._progress = self._clock.now()
        if self._pending is not None:
            if overdue:
                self._send_revision()
            return
        if overdue:
            self._window.back_to(self._window.base)
        room = self._window.base + self._status.capacity - self._status.buffered
        for payload in self._window.payloads(room):
            self._send(Type.SETPOINTS, payload)

    def _send_revision(self) -> None:
        """All of its frames; the last one has the bridge carry it out."""
        assert self._pending is not None
        self._progress = self._clock.now()
        for payload in self._pending.payloads():
            self._send(Type.REVISE, payload)

    def _revised(self, done: Pending) -> None:
        """The bridge has carried the revision out."""
        self._pending, self._committed = None, done.number
        self._buffer.replace(done.revision)
        self._window.replace(
            done.revision.first + done.staged, done.ticks[done.staged :], rests=self._buffer.at_rest
        )

    def _run_when_primed(self) -> None:
        if self._buffer.at_rest or self.buffered >= m.low_water(self.profile) + m.ramp_ticks(self.profile):
            self.state = LinkState.RUNNING

    def _encoded(self, rows: Setpoints) -> list[bytes]:
        """Each row as the bridge gets it; raises DriveError for what does not fit the wire."""
        torque = self._scaling.feed_forward(rows.tension)
        counts = self._scaling.counts(rows.slider)
        return [m.tick(counts[k], torque[k], float(rows.pressure[k])) for k in range(len(rows))]

    def _send(self, kind: Type, payload: bytes) -> None:
        assert self._session is not None
        self._session.send(kind, payload)

    def _repeat(self, kind: Type, payload: bytes, done: Callable[[], bool], what: str) -> None:
        """Send until something is so."""
        end = self._clock.now() + ANSWER
        while not done():
            if self._clock.now() > end:
                raise fault("bridge", what)
            self._send(kind, payload)
            self._wait(done, RETRY)
            self._raise_fault()

    def _until(self, done: Callable[[], bool], what: str, patience: float = ANSWER) -> None:
        if not self._wait(done, patience):
            raise fault("bridge", f"{what} in {patience:g} s")

    def _wait(self, done: Callable[[], bool], patience: float) -> bool:
        end = self._clock.now() + patience
        while not done() and self._clock.now() < end:
            if self.due == math.inf:
                self._raise_fault()
                return done()
            self.turn()
        return done()

    def _in_state(self, state: m.State) -> Callable[[], bool]:
        return lambda: self._status is not None and self._status.state is state
