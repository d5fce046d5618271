"""A simulated motion bridge: the far side of the framed link, docs/link.md, in front of the machine."""

import struct
import zlib
from collections import deque
from collections.abc import Callable
from enum import IntEnum
from typing import Final

import numpy as np

from cdhr_host.drives.sim.framing import cobs, plain
from cdhr_host.drives.sim.store import CAPACITY, Code, Limits, Nak, Refused, Store, Violated
from cdhr_host.plant import Disturbance, Machine, undisturbed
from cdhr_host.profile.schema import Profile
from cdhr_host.units import KPA
from cdhr_host.values import Array, Setpoints

STATUS_EVERY: Final = 0.02
FAULT_EVERY: Final = 0.1
RESEND: Final = 0.1
"""s after which executed ticks that the host did not take are sent again"""


class State(IntEnum):
    """docs/link.md section 6."""

    BOOT = 0
    IDLE = 1
    PRIMING = 2
    RUN = 3
    STOPPING = 6
    FAULT = 7


TAKING: Final = (State.PRIMING, State.RUN)


class Bridge:
    """Bytes in, bytes out, ticks in between. ``received`` has each executed setpoint once."""

    def __init__(self, profile: Profile, now: float, disturbance: Disturbance = undisturbed) -> None:
        self.profile = profile
        self.state = State.BOOT
        self.code = Code.NONE
        self.received: list[tuple[int, ...]] = []
        self.estop = False
        self._now = now
        self._unit = profile.canopen.position_unit
        self._machine = Machine(profile, disturbance)
        self._plant = self._machine.standing(np.zeros(6))
        self._position: tuple[int, ...] = (0,) * 6
        self._torque: tuple[int, ...] = (0,) * 6
        self._pressure = 0
        self._text = bytearray()
        self._out = bytearray()
        self._session = self._seq = self._ack = 0
        self.dropped = self.gaps = self.late = 0
        self._heard = self._status_at = self._fault_at = self._sent_at = now
        self._told = True
        self._config: bytes | None = None
        self._reset((0,) * 6)

    def exchange(self, now: float, data: bytes) -> bytes:
        """Bytes from the host -> bytes to it, by the time ``now``."""
        self._now = now
        for byte in data:
            if byte:
                self._text.append(byte)
            else:
                text, self._text = bytes(self._text), bytearray()
                self._frame(text)
        self._run(now)
        self._speak(now)
        out, self._out = bytes(self._out), bytearray()
        return out

    def report(self) -> dict[str, object]:
        """What was received, in numbers."""
        return {
            "cycles": len(self.received),
            "received": len(self.received),
            "lost_ticks": self.gaps,
            "dropped_frames": self.dropped,
            "at_rest": self.state not in (State.RUN, State.STOPPING),
            "pressure_raw": self._air if self.state in (State.RUN, State.STOPPING) else 0,
            "states": [self.state.name.lower()],
        }

    def record(self) -> list[tuple[int, ...]]:
        """Six position units and the pressure, in tenths of a kPa, of each executed tick."""
        return self.received

    def _reset(self, start: tuple[int, ...]) -> None:
        """Nothing buffered, standing at ``start``."""
        self.store = Store(start)
        self._executed: deque[tuple[int, ...]] = deque()
        self._first_kept = self._next_sent = 0
        self._due: float | None = None
        self._air = 0

    def _frame(self, text: bytes) -> None:
        body = plain(text)
        if body is None or len(body) < 12 or zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
            self.dropped += bool(text)
            return
        version, kind, seq, _, session = struct.unpack_from("<BBHHH", body)
        if version != 1 or (kind != 1 and session != self._session):
            self.dropped += 1
            return
        self._heard, self._ack = self._now, seq
        payload = body[8:-4]
        handler: Callable[[], None] | None = {
            0x01: lambda: self._hello(session),
            0x02: lambda: self._configure(payload),
            0x10: lambda: self._arm(payload),
            0x11: lambda: self._take(payload),
            0x12: self._stop_now,
            0x13: self._disarm,
            0x15: lambda: self._keepalive(payload),
            0x17: lambda: self._revise(payload),
        }.get(kind)
        try:
            if handler is None:
                raise Refused(Nak.STATE)
            handler()
        except Refused as refused:
            self.gaps += refused.reason is Nak.GAP
            self._nak(refused)
        except Violated as found:
            self._trip(found.code, found.axis)

    def _hello(self, session: int) -> None:
        if self.state in (State.RUN, State.STOPPING):
            raise Refused(Nak.STATE)
        self._session, self.code, self._told = session, Code.NONE, True
        self.state = State.IDLE
        self._reset(self._position)
        self._say(
            0x81,
            struct.pack(
                "<BBBBIIII8sHHIII", 1, 1, 2, 6, 1217, 1, 1, 1, bytes(8), CAPACITY, 524, 1000, 20000, 0
            ),
        )

    def _configure(self, payload: bytes) -> None:
        self._config = payload
        self._limits = Limits(payload)
        self._say(0x82, struct.pack("<I", zlib.crc32(payload)))

    def _arm(self, payload: bytes) -> None:
        crc, *start = struct.unpack("<I6i", payload)
        near = all(abs(a - b) <= 600 for a, b in zip(start, self._position, strict=True))
        armable = self.state in (State.IDLE, State.PRIMING) and not self.estop
        if self._config is None or crc != zlib.crc32(self._config) or not near or not armable:
            raise Refused(Nak.STATE)
        if self.state is State.IDLE:
            self._reset(tuple(start))
            told = np.array(start) * self._unit
            self._plant = self._machine.standing(self._plant.slider, setpoint=told)
        self.state = State.PRIMING

    def _disarm(self) -> None:
        if self.state is not State.FAULT:
            self.state = State.IDLE

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
            self._first_kept = self._next_sent = self.store.tick
        self._go_when_primed()

    def _revise(self, payload: bytes) -> None:
        """REVISE; once it is carried out STATUS says so."""
        if self.state not in TAKING:
            raise Refused(Nak.STATE)
        if self.store.revise(payload, self._limits):
            self._status_at = -STATUS_EVERY
            self._go_when_primed()

    def _go_when_primed(self) -> None:
        if self.store.rests or len(self.store.ticks) >= self._limits.low + self._limits.ramp:
            self._go()

    def _go(self) -> None:
        if self.state is State.PRIMING or self._due is None:
            self.state = State.RUN
            self._due = self._now + self.profile.drives.period

    def _run(self, now: float) -> None:
        """Execute the ticks that are due; watch the link."""
        if self.state in (State.PRIMING, State.RUN) and now - self._heard > self._limits.watchdog:
            self._trip(Code.LINK_LOST, 255)
        if self.estop and self.state in (State.PRIMING, State.RUN):
            self._trip(Code.EMERGENCY_STOP, 255)
        while self._due is not None and self._due <= now + 1e-9:
            self._due += self.profile.drives.period
            self._step()

    def _step(self) -> None:
        if self.state is State.STOPPING:
            if self.store.stop:
                self._execute(self.store.stop.popleft())
            else:
                self._due, self.state = None, State.FAULT if self.code else State.IDLE
                self.store.ticks.clear()
            return
        if not self.store.ticks:
            self._due = None
            return
        if not self.store.rests and len(self.store.ticks) <= self._limits.low:
            self._trip(Code.UNDERRUN, 255)
            self._step()
            return
        self._execute(self.store.ticks.popleft())

    def _execute(self, tick: tuple[int, ...]) -> None:
        self._air = tick[12]
        slider = np.array([tick[:6]]) * self._unit
        torque = np.array([tick[6:12]]) * 1e-3 * self.profile.canopen.rated_torque
        turned = 2.0 * np.pi * self.profile.drives.screw_efficiency / self.profile.sliders.screw_lead
        self._plant, feedback = self._machine.step(self._plant, self._row(slider, torque * turned))
        self._position = tuple(int(v) for v in np.rint(feedback.slider[0] / self._unit))
        self._torque = tuple(
            int(v) for v in np.rint(feedback.torque[0] / self.profile.canopen.rated_torque * 1e3)
        )
        self._pressure = round(feedback.pressure[0] / (0.1 * KPA))
        self._executed.append((*tick[:6], *self._position, *self._torque, self._pressure))
        self.received.append((*tick[:6], tick[12]))
        self.store.tick += 1
        away = [abs(a - b) for a, b in zip(self._position, tick[:6], strict=True)]
        if max(away) * self._unit > self.profile.drives.following_error_max and not self.code:
            self._trip(Code.FOLLOWING, away.index(max(away)))

    def _row(self, slider: Array, tension: Array) -> Setpoints:
        zero = np.zeros((1, 3))
        tick = np.array([self.store.tick])
        pressure = np.array([self._air * 0.1 * KPA])
        return Setpoints(
            tick, tick * 1.0, tick * 0, zero, zero.copy(), slider, tension, np.zeros(1), pressure
        )

    def _stop_now(self) -> None:
        if self.state is State.PRIMING or (self.state is State.RUN and not self.store.ticks):
            self.state = State.IDLE
            self.store.ticks.clear()
        elif self.state is State.RUN:
            self._begin_stop()

    def _begin_stop(self) -> None:
        self.state = State.STOPPING
        self.store.begin_stop(self._limits.ramp)

    def _trip(self, code: Code, axis: int) -> None:
        if self.code:
            return
        self.code, self._axis, self._told = code, axis, False
        self._fault_at = self._now - FAULT_EVERY
        if self.state is State.RUN and self.store.ticks:
            self._begin_stop()
        elif self.state is not State.STOPPING:
            self.state, self._due = State.FAULT, None

    def _speak(self, now: float) -> None:
        """EXECUTED, STATUS, FAULT as they are due."""
        if self.state is State.BOOT:
            return
        if now - self._sent_at > RESEND:
            self._next_sent, self._sent_at = self._first_kept, now
        self._say_executed()
        if now - self._status_at >= STATUS_EVERY:
            self._status_at = now
            self._say(0x91, self._status())
        if self.code and now - self._fault_at >= FAULT_EVERY:
            self._fault_at = now
            self._say(
                0x92, struct.pack("<HBBII6i", self.code, self._axis, 1, self.store.tick, 0, *self._position)
            )

    def _say_executed(self) -> None:
        while (skip := self._next_sent - self._first_kept) < len(self._executed):
            batch = [self._executed[k] for k in range(skip, min(skip + 6, len(self._executed)))]
            body = b"".join(struct.pack("<6i6i6hH", *row) for row in batch)
            self._say(0x93, struct.pack("<IB3x", self._next_sent, len(batch)) + body)
            self._next_sent += len(batch)

    def _status(self) -> bytes:
        none = 0xFFFFFFFF
        head = struct.pack(
            "<IIIHHBBHBx",
            self.store.tick,
            self.store.tick if self.store.expected is None else self.store.expected,
            none if self.store.stop_tick is None else self.store.stop_tick,
            len(self.store.ticks),
            CAPACITY,
            self.state,
            int(not self.estop),
            1000,
            self.store.revision,
        )
        axes = b"".join(
            struct.pack("<ihhH", at, 0, torque, 0x1237)
            for at, torque in zip(self._position, self._torque, strict=True)
        )
        counters = (self.dropped & 0xFFFF, self.gaps & 0xFFFF)
        return head + axes + struct.pack("<H4hHHH", self._pressure, 0, 0, 0, 0, *counters, self.late)

    def _nak(self, refused: Refused) -> None:
        expected = self.store.tick if self.store.expected is None else self.store.expected
        number = self.store.revision if refused.revision is None else refused.revision
        self._say(0x94, struct.pack("<IBBH", expected, refused.reason, number, self.store.credit))

    def _say(self, kind: int, payload: bytes) -> None:
        self._seq = self._seq + 1 & 0xFFFF
        body = struct.pack("<BBHHH", 1, kind, self._seq, self._ack, self._session) + payload
        self._out += cobs(body + struct.pack("<I", zlib.crc32(body))) + b"\0"
