"""The ticks a bridge holds: stored, gathered for a revision, and the stop made of them; docs/link.md."""

import struct
from collections import deque
from enum import IntEnum
from typing import Final

from cdhr_host.drives.sim.pace import ONE, Pace, eased

Tick = tuple[int, ...]
"""six positions, six torques, pressure, outputs"""

CAPACITY: Final = 1024
BATCH: Final = 8


class Code(IntEnum):
    """Fault codes."""

    NONE = 0
    LINK_LOST = 1
    UNDERRUN = 2
    RANGE = 3
    STEP = 4
    OVERLAP = 5
    FOLLOWING = 6
    PRESSURE = 8
    EMERGENCY_STOP = 9
    LATE = 10


class Nak(IntEnum):
    """Why a frame is not taken."""

    GAP = 2
    ORDER = 3
    RANGE = 4
    OVERFLOW = 5
    STATE = 7
    LATE = 8


class Refused(Exception):  # noqa: N818 - an answer to the host
    """A frame that is answered by NAK."""

    def __init__(self, reason: Nak, revision: int | None = None) -> None:
        super().__init__(reason.name)
        self.reason = reason
        self.revision = revision


class Violated(Exception):  # noqa: N818 - an answer to the host
    """A tick beyond the limits told: a fault of the machine."""

    def __init__(self, code: Code, axis: int) -> None:
        super().__init__(code.name)
        self.code = code
        self.axis = axis


class Limits:
    """What CONFIG says about setpoints, and the checks that come of it."""

    def __init__(self, config: bytes) -> None:
        self._axes = [struct.unpack_from("<iiIIHbx", config, 8 + 20 * k) for k in range(6)]
        watchdog, self.low, self.ramp, self._most, hold = struct.unpack_from("<HHHHH", config, 128)
        self.watchdog = watchdog * 1e-3
        self.hold = hold * 1e-3

    def check(self, tick: Tick, last: Tick, before: Tick) -> None:
        """Raises Violated unless ``tick`` may follow ``last``, which followed ``before``."""
        for axis, (low, high, step, change, _, _) in enumerate(self._axes):
            at = tick[axis]
            if not low <= at <= high:
                raise Violated(Code.RANGE, axis)
            if abs(at - last[axis]) > step or abs(at - 2 * last[axis] + before[axis]) > change + step // 50:
                raise Violated(Code.STEP, axis)
        if tick[12] > self._most:
            raise Violated(Code.PRESSURE, 255)


class Store:
    """Ticks from ``tick`` on, the one executed next; ``expected`` is the one accepted next."""

    def __init__(self, start: Tick) -> None:
        self.ticks: deque[Tick] = deque()
        self.tick = 0
        self.expected: int | None = None
        self.rests = True
        self.revision = 0
        self.stop: deque[Tick] = deque()
        self.pace = Pace()
        self.fraction = 0
        self._last: tuple[Tick, Tick] = (start, start)
        self._gathering = 0
        self._from = 0
        self._gathered: list[Tick] = []
        self._gathered_last: tuple[Tick, Tick] = (start, start)

    @property
    def credit(self) -> int:
        """Ticks there is room for."""
        return CAPACITY - len(self.ticks)

    def take(self, payload: bytes, limits: Limits) -> None:
        """SETPOINTS: all of a frame or none of it; raises Refused or Violated."""
        start, flags, _, ticks = _unpacked(payload)
        if self.expected is None:
            self.expected = self.tick = start
        if start != self.expected:
            self._out_of_order(start, ticks)
            return
        if len(ticks) > self.credit:
            raise Refused(Nak.OVERFLOW)
        last = self._checked(ticks, self._last, limits)
        self.ticks.extend(ticks)
        self._last = last
        self.expected += len(ticks)
        self.rests = bool(flags & 1)

    def revise(self, payload: bytes, limits: Limits) -> bool:
        """REVISE: gather; whether that was its last frame and it was carried out."""
        start, flags, number, ticks = _unpacked(payload)
        if number == self.revision:
            return False
        if number != self._gathering:
            self._begin(start, number)
        ahead = start - self._from - len(self._gathered)
        if ahead > 0:
            raise Refused(Nak.GAP, number)
        if ahead < 0:
            return False
        if len(self._gathered) + len(ticks) > self.credit:
            raise Refused(Nak.OVERFLOW, number)
        self._gathered_last = self._checked(ticks, self._gathered_last, limits)
        self._gathered += ticks
        if flags & 2:
            self._change_over(rests=bool(flags & 1))
        return bool(flags & 2)

    def play(self) -> Tick:
        """The next output; without air while playback is asked to stand."""
        here = self._between(self.fraction)
        air = here[12:] if self.pace.target else (0, 0)
        self.fraction += self.pace.step()
        while self.fraction >= ONE and self.ticks:
            self.ticks.popleft()
            self.tick += 1
            self.fraction -= ONE
        if not self.ticks:
            self.fraction = 0
        return (*here[:12], *air)

    def begin_stop(self, ramp: int) -> None:
        """From the rate of now to rest over ``ramp`` outputs along what is stored, without air, section 7."""
        time = self.fraction
        for step in range(ramp + 1):
            if step:
                time += self.pace.rate * (ONE - eased(step, ramp)) >> 16
            time = min(time, (len(self.ticks) - 1) * ONE)
            self.stop.append((*self._between(time)[:12], 0, 0))

    def _between(self, time: int) -> Tick:
        """The stored setpoint at a playback time from the first stored tick on."""
        first, share = time >> 16, time & (ONE - 1)
        a, b = self.ticks[first], self.ticks[min(first + 1, len(self.ticks) - 1)]
        return (*(a[k] + ((b[k] - a[k]) * share >> 16) for k in range(6)), *a[6:])

    def _begin(self, start: int, number: int) -> None:
        """Two stored ticks before it must be there, so that its first steps can be checked."""
        before = start - self.tick
        if self.expected is None or not 2 <= before <= len(self.ticks):
            raise Refused(Nak.LATE, number)
        self._gathering, self._gathered, self._from = number, [], start
        self._gathered_last = (self.ticks[before - 2], self.ticks[before - 1])

    def _change_over(self, *, rests: bool) -> None:
        number, self._gathering = self._gathering, 0
        kept = self._from - self.tick
        if kept < 1:
            raise Refused(Nak.LATE, number)
        self.ticks = deque([*list(self.ticks)[:kept], *self._gathered])
        self.expected = self._from + len(self._gathered)
        self._last, self.rests, self.revision = self._gathered_last, rests, number

    def _checked(self, ticks: list[Tick], last: tuple[Tick, Tick], limits: Limits) -> tuple[Tick, Tick]:
        for tick in ticks:
            limits.check(tick, last[1], last[0])
            last = (last[1], tick)
        return last

    def _out_of_order(self, start: int, ticks: list[Tick]) -> None:
        """A gap is refused, a repetition ignored, another content is a fault."""
        assert self.expected is not None
        if start > self.expected:
            raise Refused(Nak.GAP)
        for k, tick in enumerate(ticks):
            at = start + k - self.tick
            if 0 <= at < len(self.ticks) and self.ticks[at] != tick:
                raise Violated(Code.OVERLAP, 255)


def _unpacked(payload: bytes) -> tuple[int, int, int, list[Tick]]:
    """First tick, flags, revision and the ticks of a frame."""
    start, count, _, flags, number = struct.unpack_from("<IBBBB", payload)
    if len(payload) != 8 + 40 * count or not 1 <= count <= BATCH:
        raise Refused(Nak.ORDER, number or None)
    return start, flags, number, [struct.unpack_from("<6i6hHH", payload, 8 + 40 * k) for k in range(count)]
