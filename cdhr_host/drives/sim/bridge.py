"""A simulated motion bridge: the far side of the framed link, docs/link.md, in front of the machine."""

import struct
import zlib
from collections import deque
from collections.abc import Callable
from enum import IntEnum
from typing import Final

from cdhr_host.drives.sim.motors import Motors
from cdhr_host.drives.sim.objects import Objects
from cdhr_host.drives.sim.store import CAPACITY, Code, Limits, Nak, Refused, Store, Tick, Violated
from cdhr_host.drives.sim.wire import HELLO, Wire
from cdhr_host.plant import Disturbance, undisturbed
from cdhr_host.profile.schema import Profile

STATUS_EVERY: Final = 0.02
FAULT_EVERY: Final = 0.1
RESEND: Final = 0.1
"""s after which outputs that the host did not take are sent again"""
PER_FRAME: Final = 6
NEAR: Final = 600
"""position units between ARM's start and where the sliders stand"""
LONGEST_RAMP: Final = 2000
NO_TICK: Final = 0xFFFFFFFF


class State(IntEnum):
    """docs/link.md section 6."""

    BOOT = 0
    IDLE = 1
    PRIMING = 2
    RUN = 3
    HOLDING = 4
    HELD = 5
    STOPPING = 6
    FAULT = 7


PLAYING: Final = (State.RUN, State.HOLDING)
TAKING: Final = (State.PRIMING, State.RUN, State.HOLDING, State.HELD)
STANDING: Final = (State.BOOT, State.IDLE, State.FAULT)


class Bridge:
    """Bytes in, bytes out, outputs in between.

    ``received`` has each output once: six position units and the pressure; ``trace`` the time,
    six real positions, the pressure, whether it was an output of the plan, and the clay that left the
    nozzle, mm³/s. An output more than a period and ``grace`` s late is a fault, not played in a burst.
    """

    def __init__(
        self, profile: Profile, now: float, disturbance: Disturbance = undisturbed, *, grace: float = 0.0
    ) -> None:
        self.profile = profile
        self.state = State.BOOT
        self.code = Code.NONE
        self.received: list[Tick] = []
        self.trace: list[tuple[float, ...]] = []
        self.estop = False
        self.gaps = self.late = 0
        self.air = 0
        self.wire = Wire()
        self._grace = grace
        self._period = profile.drives.period
        self._now = self._booted = now
        self._motors = Motors(profile, disturbance)
        self._objects = Objects(profile)
        self._axis = 255
        self._heard = self._status_at = self._fault_at = self._sent_at = self._executed_at = now
        self._config: bytes | None = None
        self._reset((0,) * 6)

    @property
    def dropped(self) -> int:
        """Frames that were none, or not of this session."""
        return self.wire.dropped

    def exchange(self, now: float, data: bytes) -> bytes:
        """Bytes from the host -> bytes to it, by the time ``now``."""
        self._now = now
        for kind, session, payload in self.wire.frames(data):
            self._heard = now
            self._obey(kind, session, payload)
        self._run(now)
        self._speak(now)
        return self.wire.taken()

    def report(self) -> dict[str, object]:
        """What was received, in numbers."""
        return {
            "cycles": len(self.received),
            "received": len(self.received),
            "lost_ticks": self.gaps + self.late,
            "dropped_frames": self.dropped,
            "at_rest": self.state not in (*PLAYING, State.STOPPING),
            "pressure_raw": self.air,
            "states": [self.state.name.lower()],
        }

    def record(self) -> list[Tick]:
        """Six position units and the pressure, in tenths of a kPa, of each output."""
        return self.received

    def _reset(self, start: Tick) -> None:
        """Nothing buffered, standing at ``start``."""
        self.store = Store(start)
        self._executed: deque[Tick] = deque()
        self._output = self._first_kept = self._next_sent = 0
        self._stop_output = NO_TICK
        self._due: float | None = None
        self.air = 0

    def _obey(self, kind: int, session: int, payload: bytes) -> None:
        handler: Callable[[bytes], None] | None = {
            0x02: self._configure,
            0x03: self._clock,
            0x10: self._arm,
            0x11: self._take,
            0x12: self._stop_now,
            0x13: self._disarm,
            0x14: self._fault_reset,
            0x15: self._keepalive,
            0x16: self._change_rate,
            0x17: self._revise,
            0x20: self._read_object,
            0x21: self._write_object,
        }.get(kind)
        try:
            if kind == HELLO:
                self._hello(session)
            elif handler is None:
                raise Refused(Nak.STATE)
            else:
                handler(payload)
        except Refused as refused:
            self.gaps += refused.reason is Nak.GAP
            self._nak(refused)
        except Violated as found:
            self._trip(found.code, found.axis)

    def _hello(self, session: int) -> None:
        if self.state in (*PLAYING, State.HELD, State.STOPPING):
            raise Refused(Nak.STATE)
        self.wire.session = session
        self.state = State.FAULT if self.code else State.IDLE
        self._reset(self._motors.position)
        identity = (1, 1, 2, 6, 1217, 1, 1, 1, bytes(8), CAPACITY, 524, 1000, 20000, 0)
        self.wire.say(0x81, struct.pack("<BBBBIIII8sHHIII", *identity))

    def _configure(self, payload: bytes) -> None:
        self._config = payload
        self._limits = Limits(payload)
        self.wire.say(0x82, struct.pack("<I", zlib.crc32(payload)))

    def _clock(self, payload: bytes) -> None:
        (asked,) = struct.unpack("<Q", payload)
        microseconds = round((self._now - self._booted) * 1e6)
        self.wire.say(0x83, struct.pack("<QQI", asked, microseconds, self.store.tick))

    def _arm(self, payload: bytes) -> None:
        crc, *start = struct.unpack("<I6i", payload)
        near = all(abs(a - b) <= NEAR for a, b in zip(start, self._motors.position, strict=True))
        armable = self.state in (State.IDLE, State.PRIMING) and not self.estop
        if self._config is None or crc != zlib.crc32(self._config) or not near or not armable:
            raise Refused(Nak.STATE)
        if self.state is State.IDLE:
            self._reset(tuple(start))
            self._motors.stand(tuple(start))
        self.state = State.PRIMING

    def _disarm(self, _payload: bytes) -> None:
        if self.state is State.PRIMING or (self.state is State.RUN and not self.store.ticks):
            self.state = State.IDLE
        elif self.state not in STANDING:
            raise Refused(Nak.STATE)

    def _fault_reset(self, _payload: bytes) -> None:
        """An operator's wish; nothing is armed by it."""
        if self.state is not State.FAULT or self.estop:
            raise Refused(Nak.STATE)
        self.code, self.state = Code.NONE, State.IDLE
        self._reset(self._motors.position)

    def _keepalive(self, payload: bytes) -> None:
        _, wanted = struct.unpack("<II", payload)
        while self._executed and self._first_kept < wanted:
            self._executed.popleft()
            self._first_kept += 1
            self._sent_at = self._now

    def _take(self, payload: bytes) -> None:
        """SETPOINTS."""
        if self.state not in TAKING:
            raise Refused(Nak.STATE)
        fresh = self.store.expected is None
        self.store.take(payload, self._limits)
        if fresh:
            self._output = self._first_kept = self._next_sent = self.store.tick
        self._go_when_primed()

    def _revise(self, payload: bytes) -> None:
        """REVISE; once it is carried out STATUS says so."""
        if self.state not in TAKING:
            raise Refused(Nak.STATE)
        if self.store.revise(payload, self._limits):
            self._status_at = -STATUS_EVERY
            self._go_when_primed()

    def _change_rate(self, payload: bytes) -> None:
        """RATE: another playback rate, or none at all."""
        permille, ramp = struct.unpack("<HH", payload)
        if permille > 1000 or not 1 <= ramp <= LONGEST_RAMP:
            raise Refused(Nak.RANGE)
        if self.state not in (*PLAYING, State.HELD) or (self.state is State.HELD and not self._primed):
            raise Refused(Nak.STATE)
        self.store.pace.change(permille, ramp, self.store.fraction)
        self.state = State.RUN if permille else State.HOLDING
        self._start()

    def _read_object(self, payload: bytes) -> None:
        self.wire.say(0xA0, self._objects.read(payload, self._motors.position, self._status_word))

    def _write_object(self, payload: bytes) -> None:
        self.wire.say(0xA1, self._objects.write(payload, standing=self.state in STANDING))

    @property
    def _primed(self) -> bool:
        return self.store.rests or len(self.store.ticks) >= self._limits.low + self._limits.ramp

    def _go_when_primed(self) -> None:
        if self._primed and self.state in (State.PRIMING, State.RUN):
            self.state = State.RUN
            self._start()

    def _start(self) -> None:
        if self._due is None:
            self._due = self._now + self._period

    def _run(self, now: float) -> None:
        """The outputs that are due; watch the link and the air."""
        if self.state in TAKING and now - self._heard > self._limits.watchdog:
            self._trip(Code.LINK_LOST)
        if self.estop and self.state in TAKING:
            self._trip(Code.EMERGENCY_STOP)
        if self._due is not None and now - self._due > self._period + self._grace:
            self.late += 1
            self._due = now
            self._trip(Code.LATE)
        while self._due is not None and self._due <= now + 1e-9:
            self._executed_at = self._due
            self._due += self._period
            self._step()
        if self.air and now - self._executed_at > self._limits.hold + 1e-9:
            self._vent()

    def _step(self) -> None:
        """One output, or the end of them."""
        if self.state is State.STOPPING:
            if self.store.stop:
                self._execute(self.store.stop.popleft())
            else:
                self._rest(State.FAULT if self.code else State.IDLE)
                self.store.ticks.clear()
        elif self.state is State.HOLDING and not self.store.pace.rate and self.store.pace.steady:
            self._rest(State.HELD)
        elif not self.store.ticks:
            self._rest(State.HELD if self.state is State.HOLDING else State.RUN)
        elif not self.store.rests and len(self.store.ticks) <= self._least:
            self._trip(Code.UNDERRUN)
            self._step()
        else:
            self._execute(self.store.play())

    @property
    def _least(self) -> int:
        """Ticks that must be left; a hold under way needs no more than it plays."""
        return self._limits.low if self.state is State.RUN else 2

    def _rest(self, state: State) -> None:
        self._due, self.state = None, state
        if state is not State.RUN:
            self._vent()

    def _vent(self) -> None:
        if self.air:
            self.air = 0
            self.trace.append((self._now, *self._motors.position, 0, False, self._motors.deposited))

    def _execute(self, tick: Tick) -> None:
        self.air = tick[12]
        beyond = self._motors.execute(tick)
        self._executed.append(
            (*tick[:6], *self._motors.position, *self._motors.torque, self._motors.pressure)
        )
        self.received.append((*tick[:6], tick[12]))
        fresh = self.state is not State.STOPPING
        row = *self._motors.position, tick[12], fresh, self._motors.deposited
        self.trace.append((self._executed_at, *row))
        self._output += 1
        if beyond is not None:
            self._trip(Code.FOLLOWING, beyond)

    def _stop_now(self, _payload: bytes) -> None:
        if self.state in (State.PRIMING, State.HELD) or (self.state is State.RUN and not self.store.ticks):
            self._rest(State.IDLE)
            self.store.ticks.clear()
        elif self.state in PLAYING:
            self._begin_stop()

    def _begin_stop(self) -> None:
        self.state, self._stop_output = State.STOPPING, self._output
        self.store.begin_stop(self._limits.ramp)

    def _trip(self, code: Code, axis: int = 255) -> None:
        if self.code:
            return
        self.code, self._axis = code, axis
        self._fault_at = self._now - FAULT_EVERY
        if self.state in PLAYING and self.store.ticks:
            self._begin_stop()
        elif self.state is not State.STOPPING:
            self._rest(State.FAULT)

    def _speak(self, now: float) -> None:
        """EXECUTED, STATUS, FAULT as they are due."""
        if self.state is State.BOOT:
            return
        if now - self._sent_at > RESEND:
            self._next_sent, self._sent_at = self._first_kept, now
        self._say_executed()
        if now - self._status_at >= STATUS_EVERY:
            self._status_at = now
            self.wire.say(0x91, self._status())
        if self.code and now - self._fault_at >= FAULT_EVERY:
            self._fault_at = now
            where = (self.store.tick, 0, *self._motors.position)
            self.wire.say(0x92, struct.pack("<HBBII6i", self.code, self._axis, 1, *where))

    def _say_executed(self) -> None:
        while (skip := self._next_sent - self._first_kept) < len(self._executed):
            batch = [self._executed[k] for k in range(skip, min(skip + PER_FRAME, len(self._executed)))]
            body = b"".join(struct.pack("<6i6i6hH", *row) for row in batch)
            self.wire.say(0x93, struct.pack("<IB3x", self._next_sent, len(batch)) + body)
            self._next_sent += len(batch)

    @property
    def _status_word(self) -> int:
        """Of every drive: operation enabled and following, or switch-on disabled."""
        return 0x0250 if self.state in STANDING else 0x1237

    def _status(self) -> bytes:
        store = self.store
        expected = store.tick if store.expected is None else store.expected
        ticks = (store.tick, expected, self._stop_output, self._output, len(store.ticks), CAPACITY)
        rate = store.pace.rate * 1000 >> 16
        head = struct.pack("<IIIIHHBBHBx", *ticks, self.state, int(not self.estop), rate, store.revision)
        axes = b"".join(
            struct.pack("<ihhH", at, 0, torque, self._status_word)
            for at, torque in zip(self._motors.position, self._motors.torque, strict=True)
        )
        counters = (self.dropped & 0xFFFF, self.gaps & 0xFFFF, self.late & 0xFFFF)
        return head + axes + struct.pack("<H4hHHH", self._motors.pressure, 0, 0, 0, 0, *counters)

    def _nak(self, refused: Refused) -> None:
        expected = self.store.tick if self.store.expected is None else self.store.expected
        number = self.store.revision if refused.revision is None else refused.revision
        self.wire.say(0x94, struct.pack("<IBBH", expected, refused.reason, number, self.store.credit))
