"""The host's side of the framed link: a MachineLink over a motion bridge that buffers."""

import math
import secrets
import struct
from collections import deque
from collections.abc import Callable
from typing import Final

import numpy as np

from cdhr_host.drives.bridge import messages as m
from cdhr_host.drives.bridge.frames import Frame, Reader, Type, encoded
from cdhr_host.drives.bridge.line import Line
from cdhr_host.drives.bridge.stop import stop_rows
from cdhr_host.drives.buffer import RowBuffer
from cdhr_host.drives.canopen.scaling import Scaling
from cdhr_host.drives.checks import check_standing
from cdhr_host.drives.clock import Clock
from cdhr_host.drives.faults import fault
from cdhr_host.drives.link import LinkState
from cdhr_host.drives.rows import joined, no_feedback
from cdhr_host.drives.timing import CycleTiming
from cdhr_host.errors import DriveError, Problem
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Feedback, Setpoints

TURN: Final = 0.01
"""s between two turns"""
KEEPALIVE: Final = 0.02
RETRY: Final = 0.1
"""s without progress after which setpoints are sent again"""
ANSWER: Final = 2.0
STATES: Final = {
    m.State.IDLE: LinkState.STOPPED,
    m.State.PRIMING: LinkState.ARMED,
    m.State.RUN: LinkState.RUNNING,
    m.State.STOPPING: LinkState.STOPPING,
    m.State.FAULT: LinkState.FAULT,
}


class BridgeLink:
    """MachineLink over a bridge; ``turn`` moves frames and must be called every TURN or so."""

    def __init__(self, profile: Profile, clock: Clock, connect: Callable[[], Line]) -> None:
        self.profile = profile
        self.state = LinkState.CLOSED
        self.stop_tick: int | None = None
        self.resolution = profile.canopen.position_unit
        self.due = math.inf
        self.naks = 0
        self._clock, self._connect = clock, connect
        self._scaling = Scaling(profile)
        self._buffer = RowBuffer(profile, clock.speed)
        self._config = m.config(profile)
        self._line: Line | None = None
        self._first: int | None = None
        self._fault: DriveError | None = None
        self._told = True

    @property
    def free(self) -> int:
        """Rows that ``feed`` would accept."""
        if self.state not in (LinkState.ARMED, LinkState.RUNNING):
            return 0
        return self._buffer.free - self.buffered

    @property
    def buffered(self) -> int:
        """Rows accepted whose outcome has not come back."""
        return self._last - self._collected if self._first is not None else 0

    @property
    def slider(self) -> Array:
        """(6,) m, as last told."""
        assert self._status is not None
        return self._scaling.slider(np.array(self._status.position, dtype=np.int64))

    def timing(self) -> CycleTiming | None:
        """The bridge keeps time."""
        return None

    def stop_rows(self, ahead: Setpoints) -> Setpoints:
        """What the bridge plays instead of ``ahead``."""
        counts = self._scaling.counts(ahead.slider)
        return stop_rows(ahead, counts, self._scaling.unit, self.profile)

    def open(self) -> None:
        """CLOSED -> OPEN: greet, tell the machine's limits."""
        self._expect(LinkState.CLOSED)
        self._line = self._connect()
        self._reader = Reader()
        self._session, self._seq, self._heard = secrets.randbelow(0xFFFF) + 1, 0, 0
        self._status: m.Status | None = None
        self._acked = self._greeted = False
        self._fault, self._told = None, True
        self._executed: list[Feedback] = []
        self._begin_run()
        self.due = self._clock.now()
        try:
            hello = m.HELLO.pack(1, 1, m.ROLE_HOST, 6, 0, 0, 1, 0, bytes(8))
            self._repeat(Type.HELLO, hello, lambda: self._greeted, "the bridge does not answer")
            self._repeat(Type.CONFIG, self._config, lambda: self._acked, "the bridge keeps another config")
            self._until(lambda: self._status is not None, "the bridge says no status")
        except DriveError:
            self._line.close()
            self.due = math.inf
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
        self._expect(LinkState.ARMED, LinkState.RUNNING)
        torque = self._scaling.feed_forward(np.where(np.isfinite(setpoints.tension), setpoints.tension, 0.0))
        accepted = self._buffer.feed(setpoints, self.free)
        if not accepted:
            return 0
        rows = self._buffer.take(accepted)
        counts = self._scaling.counts(rows.slider)
        if self._first is None:
            self._first = self._collected = self._next = int(rows.tick[0])
        self._last = int(rows.tick[-1]) + 1
        for k in range(accepted):
            self._ticks.append(m.tick(counts[k], torque[k], float(rows.pressure[k])))
        self._rests = self._buffer.at_rest
        self._send_setpoints()
        if self._rests or self.buffered >= m.low_water(self.profile) + m.ramp_ticks(self.profile):
            self.state = LinkState.RUNNING
        return accepted

    def feedback(self) -> Feedback:
        """What was executed since the last call."""
        self._raise_fault()
        executed, self._executed = self._executed, []
        return joined(executed) if executed else no_feedback()

    def stop(self) -> None:
        """Come to rest on the path, air off."""
        if self.state is LinkState.CLOSED:
            self._expect(LinkState.OPEN)
        if self.state not in (LinkState.ARMED, LinkState.RUNNING):
            return
        self._stopping = True
        for _ in range(3):
            self._send(Type.STOP, b"\0")
        self._status = None
        resting = {m.State.STOPPING, m.State.IDLE, m.State.FAULT}
        self._until(lambda: self._status is not None and self._status.state in resting, "no stop")
        if self.state is LinkState.ARMED or self._status is None or self._status.stop_tick is None:
            self._collected = self._last
            self.state = LinkState.STOPPED
        else:
            self.stop_tick = self._status.stop_tick
            self.state = LinkState.STOPPING

    def close(self) -> None:
        """-> CLOSED; what moves is stopped on the path first."""
        if self._line is None:
            return
        try:
            self.stop()
            self._until(lambda: self.state is not LinkState.STOPPING, "no rest", 30.0)
            self._send(Type.DISARM, b"")
        except DriveError as error:
            self._fault = error
        self._line.close()
        self._line, self.due = None, math.inf
        self.state = LinkState.CLOSED

    def turn(self) -> None:
        """Read, answer, send what there is credit for."""
        if self._line is None or self.due == math.inf:
            return
        self._clock.wait_until(self.due)
        self.poll()

    def poll(self) -> None:
        """A turn now, whatever is due."""
        if self._line is None or self.due == math.inf:
            return
        self.due = self._clock.now() + TURN
        try:
            self._read()
            self._send_setpoints()
            if self._clock.now() - self._sent_at >= KEEPALIVE:
                now = int(self._clock.now() * 1e3) & 0xFFFFFFFF
                self._send(Type.KEEPALIVE, m.KEEPALIVE.pack(now, max(self._collected, 0)))
        except DriveError as gone:
            self._trip(gone)
            self.state, self.due = LinkState.FAULT, math.inf

    def _begin_run(self) -> None:
        self._first = None
        self._last = self._collected = self._next = 0
        self._ticks: deque[bytes] = deque()
        self._rests = self._stopping = False
        self._progress = self._sent_at = self._clock.now()
        self.stop_tick = None

    def _read(self) -> None:
        assert self._line is not None
        for frame in self._reader.frames(self._line.read()):
            if frame.session != self._session:
                continue
            self._heard = frame.seq
            try:
                self._take(frame)
            except struct.error:
                self._reader.dropped += 1

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
            self.naks += 1
            if self._first is not None:
                self._next = min(max(m.NAK.unpack(payload)[0], self._last - len(self._ticks)), self._last)
        elif frame.type == Type.FAULT:
            code, axis, _, tick, _, *_ = m.FAULT.unpack(payload)
            kind, text = m.FAULTS.get(code, ("bridge", f"the bridge reports fault {code}"))
            where = f" (slider {axis + 1})" if axis < 6 else ""
            self._trip(fault(kind, f"{text}{where} at tick {tick}"))

    def _take_status(self, told: m.Status) -> None:
        self._status = told
        if self._first is not None and told.expected > self._last - len(self._ticks):
            for _ in range(min(told.expected - (self._last - len(self._ticks)), len(self._ticks))):
                self._ticks.popleft()
            self._next = max(self._next, self._last - len(self._ticks))
            self._progress = self._clock.now()
        if told.stop_tick is not None:
            self.stop_tick = told.stop_tick
        if told.state is m.State.STOPPING:
            self.state = LinkState.STOPPING
        elif told.state is m.State.FAULT and self._fault is not None:
            self.state = LinkState.FAULT
        elif told.state is m.State.IDLE and self.state is LinkState.STOPPING and told.tick <= self._collected:
            self.state = LinkState.FAULT if self._fault else LinkState.STOPPED
            self._last = self._collected

    def _take_executed(self, payload: bytes) -> None:
        start, count = m.EXECUTED.unpack_from(payload)
        if self._first is None or start > self._collected:
            return
        for k in range(self._collected - start, count):
            values = m.EXECUTED_TICK.unpack_from(payload, m.EXECUTED.size + k * m.EXECUTED_TICK.size)
            self._executed.append(self._row(start + k, values))
            self._collected += 1

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
        base = self._last - len(self._ticks)
        if self._next > base and self._clock.now() - self._progress > RETRY:
            self._next, self._progress = base, self._clock.now()
        room = base + self._status.capacity - self._status.buffered
        while self._next < min(self._last, room):
            count = min(m.PER_FRAME, self._last - self._next, room - self._next)
            body = b"".join(self._ticks[self._next - base + k] for k in range(count))
            rests = self._rests and self._next + count == self._last
            self._send(Type.SETPOINTS, m.SETPOINTS.pack(self._next, count, 6, int(rests), 0) + body)
            self._next += count

    def _send(self, kind: Type, payload: bytes) -> None:
        assert self._line is not None
        self._seq = self._seq + 1 & 0xFFFF
        self._line.write(encoded(Frame(kind, self._seq, self._heard, self._session, payload)))
        self._sent_at = self._clock.now()

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

    def _trip(self, found: DriveError) -> None:
        if self._fault is None:
            self._fault, self._told = found, False

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
