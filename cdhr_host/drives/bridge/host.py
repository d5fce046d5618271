"""The host's side of the framed link: a MachineLink over a motion bridge that buffers."""

import math
import struct
from collections.abc import Callable
from typing import Final

import numpy as np

from cdhr_host.drives.base import TAKING, BufferedLink
from cdhr_host.drives.bridge import messages as m
from cdhr_host.drives.bridge.frames import Frame, Type
from cdhr_host.drives.bridge.line import Line
from cdhr_host.drives.bridge.stop import stop_rows
from cdhr_host.drives.bridge.talker import ANSWER, Talker
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

SPARE: Final = 16
"""rows beyond the low water that a revision must have before the bridge changes over"""
GUARD: Final = 0.05
"""s between asking for a revision and its first tick, besides the time the line needs"""
MOVING: Final = (*TAKING, LinkState.STOPPING)
REST: Final = 30.0
"""s a stop may take before the line is closed"""


class BridgeLink(BufferedLink, Talker):
    """MachineLink over a bridge; ``turn`` moves frames and must be called every TURN or so."""

    def __init__(self, profile: Profile, clock: Clock, connect: Callable[[], Line]) -> None:
        BufferedLink.__init__(self, profile, clock.speed)
        Talker.__init__(self, clock, connect)
        self.resolution = profile.canopen.position_unit
        self.naks = 0
        self._scaling = Scaling(profile)
        self._config = m.config(profile)
        self._period = profile.drives.period
        self._staged = m.low_water(profile) + SPARE
        self._number = 0
        self._status: m.Status | None = None
        self._status_at = clock.now()
        self._code = 0
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
        """CLOSED -> OPEN: greet, tell the machine's limits, forget faults that only the link had."""
        self._expect(LinkState.CLOSED)
        self._forget()
        self._begin_run()
        self._status, self._code, self._acked = None, 0, False
        self.greet()
        self._guard = GUARD + self._staged * m.PER_TICK / self.session.line.rate
        try:
            self.repeat(Type.CONFIG, self._config, lambda: self._acked, "the bridge keeps another config")
            self.demand(lambda: self._status is not None, "the bridge says no status")
            self._clear_fault_of_the_link()
        except DriveError:
            self.hang_up()
            raise
        self._forget()
        self.state = LinkState.OPEN

    def arm(self, start: Array) -> None:
        """OPEN or STOPPED -> ARMED, holding (6,) m ``start``."""
        self._expect(LinkState.OPEN, LinkState.STOPPED)
        if self._in_state(m.State.FAULT):
            raise self._said(self._code, 255, "; nothing may move")
        if self._status is not None and not self._status.released:
            raise fault("emergency-stop", "the emergency stop is pressed: nothing may move")
        check_standing(start, self.slider)
        self._begin_run()
        self._buffer.start(start)
        payload = m.ARM.pack(m.config_crc(self._config), *self._scaling.counts(start).tolist())
        self._status = None
        self.repeat(Type.ARM, payload, lambda: self._in_state(m.State.PRIMING), "the bridge does not arm")
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
        self._now(self._speak)
        self._run_when_primed()
        return len(accepted)

    @property
    def revisable(self) -> int:
        """First tick that ``revise`` may still replace: later by what it takes to send one."""
        first = self._buffer.revisable
        if self._in_state(m.State.RUN):
            assert self._status is not None
            ahead = self._clock.now() + self._guard
            told = self._status.tick + math.ceil((ahead - self._status_at) / self._period)
            known = self.sync.playing(ahead, self._period) if self.sync.exchanges else told
            first = max(first, told, min(known, told + math.ceil(self.sync.round_trip / self._period)))
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
        self._number = self._number % 255 + 1
        staged = min(len(rows), self._staged)
        rests = revision.rests(self.profile)
        self._pending = Pending(self._number, revision, self._encoded(rows), staged, rests)
        self._refused_late = False
        self._now(self._send_revision)
        self.until(lambda: self._pending is None or self.state not in TAKING, ANSWER)
        self._pending, unanswered = None, self._pending is not None
        self._raise_fault()
        if self._refused_late:
            raise too_late(revision.first, self.revisable, self._buffer.next_tick)
        if unanswered:
            raise fault("bridge", f"the bridge does not answer a revision in {ANSWER:g} s")

    def set_rate(self, share: float, ramp: float) -> None:
        """Have the bridge play slower, ``share`` 0 to 1 of the plan, within ``ramp`` s; 0 holds.

        For a bridge that is to hold by itself: the rows it plays then are its own (docs/link.md,
        section 6), and what comes back are its outputs. Where rows are to be known beforehand,
        ``revise``. RUNNING only; raises DriveError.
        """
        self._raise_fault()
        self._expect(LinkState.RUNNING)
        permille, ticks = round(share * 1000), max(1, round(ramp / self._period))
        wanted = (m.State.HOLDING, m.State.HELD) if permille == 0 else (m.State.RUN,)
        self._status = None
        self.repeat(
            Type.RATE,
            m.RATE.pack(permille, ticks),
            lambda: self._status is not None and self._status.state in wanted,
            "the bridge does not change its rate",
        )

    @property
    def held(self) -> bool:
        """Whether the bridge stands because it was told rate 0."""
        return self._in_state(m.State.HELD)

    def fault_reset(self) -> None:
        """An operator has looked at the machine: the bridge forgets its fault. OPEN only."""
        self._expect(LinkState.OPEN)
        if self._in_state(m.State.FAULT):
            self.repeat(
                Type.FAULT_RESET, b"", lambda: self._in_state(m.State.IDLE), "the bridge stays in fault"
            )
            self._code = 0

    def stop(self) -> None:
        """Come to rest on the path, air off."""
        if self.state is LinkState.CLOSED:
            self._expect(LinkState.OPEN)
        if self.state not in TAKING:
            return
        self._stopping = True
        for _ in range(3):
            self._now(lambda: self.send(Type.STOP, b"\0"))
        self._status = None
        resting = {m.State.STOPPING, m.State.IDLE, m.State.FAULT}
        self.demand(lambda: self._status is not None and self._status.state in resting, "no stop")
        if self.state is LinkState.ARMED or self._status is None or self._status.stop_output is None:
            self._buffer.drop()
            self.state = LinkState.STOPPED
        else:
            self.stop_tick = self._status.stop_output
            self.state = LinkState.STOPPING

    def close(self) -> None:
        """-> CLOSED; what moves is stopped on the path first."""
        if self._session is None:
            return
        try:
            self.stop()
            self.demand(lambda: self.state is not LinkState.STOPPING, "no rest", REST)
            self.send(Type.DISARM)
        except DriveError as error:
            self._fault = error
        self.hang_up()
        self.state = LinkState.CLOSED

    def _begin_run(self) -> None:
        self._first, self._pending = None, None
        self._collected = 0
        self._window = Window()
        self._committed = 0
        self._refused_late = self._stopping = False
        self._progress = self._clock.now()
        self.stop_tick = None

    def _clear_fault_of_the_link(self) -> None:
        """A fault that only the link had is over with it; one of the machine waits for an operator."""
        if not self._in_state(m.State.FAULT):
            return
        self.demand(lambda: self._code != 0, "the bridge says no fault")
        if self._code not in m.OF_THE_MACHINE:
            self.repeat(
                Type.FAULT_RESET, b"", lambda: self._in_state(m.State.IDLE), "the bridge stays in fault"
            )

    def _take(self, frame: Frame) -> None:
        payload = frame.payload
        if frame.type == Type.CONFIG_ACK:
            self._acked = struct.unpack("<I", payload)[0] == m.config_crc(self._config)
        elif frame.type == Type.STATUS:
            self._take_status(m.status(payload))
        elif frame.type == Type.EXECUTED:
            self._take_executed(payload)
        elif frame.type == Type.NAK:
            self._take_nak(*m.NAK.unpack(payload))
        elif frame.type == Type.FAULT:
            code, axis, _, tick, _, *_ = m.FAULT.unpack(payload)
            self._code = code
            if self.state in MOVING:
                self._note(self._said(code, axis, f" at tick {tick}"))
        else:
            super()._take(frame)

    def _take_status(self, told: m.Status) -> None:
        self._status, self._status_at = told, self._clock.now()
        if self._pending is not None and told.revision == self._pending.number:
            self._revised(self._pending)
        elif self._pending is not None and told.tick > self._pending.revision.first:
            self._pending, self._refused_late = None, True
        current = self._first is not None and told.revision == self._committed
        if current and (self._window.acknowledge(told.expected) or not self._window.unanswered):
            self._progress = self._clock.now()
        if told.stop_output is not None:
            self.stop_tick = told.stop_output
        if told.state is m.State.STOPPING:
            self.state = LinkState.STOPPING
        elif told.state is m.State.FAULT and self._fault is not None and self.state in MOVING:
            self.state = LinkState.FAULT
        elif (
            told.state is m.State.IDLE and self.state is LinkState.STOPPING and told.output <= self._collected
        ):
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
        self._release()

    def _release(self) -> None:
        """Forget rows whose outcome is here; outputs and ticks differ once the rate was changed."""
        told = self._status
        more = told.output - told.tick if told is not None else 0
        played = self._collected - more - (self._buffer.next_tick - len(self._buffer))
        if played > 0 and len(self._buffer):
            self._buffer.take(min(played, len(self._buffer)))

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

    def _speak(self) -> None:
        """What the bridge has room for, in frames of up to eight ticks."""
        if self._first is None or self._stopping or self._status is None or self._fault is not None:
            return
        overdue = self._clock.now() - self._progress > self.retry
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
            self.send(Type.SETPOINTS, payload)

    def _wanted(self) -> int:
        return max(self._collected, 0)

    def _check(self) -> None:
        self._raise_fault()

    def _now(self, action: Callable[[], None]) -> None:
        """Send something outside a turn; a line that is gone is the link's fault, told here."""
        try:
            action()
        except DriveError as gone:
            self.due = math.inf
            self._lost(gone)
            self._raise_fault()
            raise

    def _lost(self, gone: DriveError) -> None:
        self._note(gone)
        if self.state is not LinkState.CLOSED:
            self.state = LinkState.FAULT

    def _send_revision(self) -> None:
        """All of its frames; the last one has the bridge carry it out."""
        assert self._pending is not None
        self._progress = self._clock.now()
        for payload in self._pending.payloads():
            self.send(Type.REVISE, payload)

    def _revised(self, done: Pending) -> None:
        """The bridge has carried the revision out."""
        self._pending, self._committed = None, done.number
        self._buffer.replace(done.revision)
        rest = done.ticks[done.staged :]
        self._window.replace(done.revision.first + done.staged, rest, rests=self._buffer.at_rest)

    def _run_when_primed(self) -> None:
        if self._buffer.at_rest or self.buffered >= m.low_water(self.profile) + m.ramp_ticks(self.profile):
            self.state = LinkState.RUNNING

    def _encoded(self, rows: Setpoints) -> list[bytes]:
        """Each row as the bridge gets it; raises DriveError for what does not fit the wire."""
        torque = self._scaling.feed_forward(rows.tension)
        counts = self._scaling.counts(rows.slider)
        return [m.tick(counts[k], torque[k], float(rows.pressure[k])) for k in range(len(rows))]

    def _in_state(self, state: m.State) -> bool:
        return self._status is not None and self._status.state is state

    def _said(self, code: int, axis: int, when: str) -> DriveError:
        """A fault the bridge told."""
        kind, text = m.FAULTS.get(code, ("bridge", f"the bridge reports fault {code}"))
        where = f" (slider {axis + 1})" if axis < 6 else ""
        return fault(kind, f"{text}{where}{when}")
