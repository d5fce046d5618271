"""A simulated servo drive: the state machine, modes and supervision of CiA 402.

Positions are in position units. The machine the drive turns is told ``commanded`` after
each SYNC and answers with ``moved``.
"""

import math
from enum import IntEnum
from typing import Final

from cdhr_host.drives.sim.node import Node


class State(IntEnum):
    """States; the value is the status word's pattern."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    ENABLED = 0x27
    QUICK_STOP = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


S = State
BRAKE: Final = 0.05
"""s a brake takes to open"""
HELD_BY_BRAKE: Final = (S.NOT_READY, S.SWITCH_ON_DISABLED, S.READY, S.SWITCHED_ON, S.FAULT)
GUESSES: Final = 2
"""cycles without a setpoint of its own after which a drive says so"""
CSP, IP, HOMING = 8, 7, 6


def _switched(state: State, word: int) -> State:
    """Shutdown (6), switch on (7) and enable (15) in the states that know them."""
    if state is S.QUICK_STOP:
        return state
    if state is S.SWITCH_ON_DISABLED:
        return S.READY if word == 0x06 else state
    if word == 0x0F:
        return S.SWITCHED_ON if state is S.READY else S.ENABLED
    return {0x06: S.READY, 0x07: S.SWITCHED_ON}.get(word, state)


class Drive(Node):
    """One axis; ``stubborn`` states are never left, ``home_at`` is where its home switch sits."""

    def __init__(self, node_id: int, period: float) -> None:
        super().__init__("drive.eds", node_id)
        self.drive_state = S.SWITCH_ON_DISABLED
        self.actual = 0
        self.shift = 0
        self.home_at = 0
        self.stubborn: set[State] = set()
        self.ignored_modes: set[int] = set()
        self.status_mask = 0xFFFF
        self.status_extra = 0
        self.commanded = 0
        self.fresh = True
        self.lost = 0
        self._period = period
        self._speed = 0.0
        self._guessed = self._starved = 0
        self._exact = 0.0
        self._released_at = 0.0
        self._away_since: float | None = None
        self._reset_before = False
        self._homed = False
        self._now = 0.0
        self.dictionary.hooks[0x6060] = self._mode_written

    @property
    def following(self) -> bool:
        """Whether the axis follows its setpoints: enabled, brake open."""
        return self.drive_state is S.ENABLED and self._now >= self._released_at

    @property
    def _on_target(self) -> bool:
        """Bit 12: it follows what the host told; not when a second SYNC in a row brought nothing."""
        return self.following and self._starved < GUESSES

    @property
    def moving(self) -> bool:
        """Whether the axis is told to move."""
        return self._speed != 0.0

    def receive(self, now: float, cob: int, data: bytes) -> None:
        """A control word that came by SDO acts at once."""
        before = self.values[0x6040, 0]
        super().receive(now, cob, data)
        if cob == 0x600 + self.id and self.values[0x6040, 0] != before:
            self._control()
            self._publish()

    def reset(self, now: float, *, communication: bool = False) -> None:
        """Boot: the axis falls into its brake."""
        super().reset(now, communication=communication)
        self.drive_state, self._homed, self._speed = S.SWITCH_ON_DISABLED, False, 0.0
        self._publish()

    def synchronise(self, now: float) -> None:
        """Take what the last cycle's RPDO brought, run the state machine, find the next setpoint."""
        self._now = now
        self.fresh = self.apply_sync()
        self._starved = 0 if self.fresh else self._starved + 1
        self._control()
        self.commanded = self._next_setpoint()
        self._publish()

    def coast(self, now: float) -> None:
        """A cycle without SYNC."""
        self._now, self.fresh = now, False
        self.commanded = self._next_setpoint()
        self._publish()

    def moved(self, encoder: int, torque: int) -> None:
        """Where the axis is after the cycle, and its torque in thousandths of the rated one."""
        self.actual = encoder - self.shift
        self.values[0x6077, 0] = max(-32768, min(32767, torque))
        self._supervise()
        self._publish()

    def fault(self, code: int) -> None:
        """A fault of the drive: EMCY, fault reaction, fault."""
        if self.drive_state in (S.FAULT, S.FAULT_REACTION):
            return
        self.values[0x603F, 0] = code
        self.emergency(code)
        self.drive_state = S.FAULT_REACTION if self.drive_state is S.ENABLED else S.FAULT
        self._publish()

    def drop(self, state: State) -> None:
        """Leave the enabled state unasked, as STO does."""
        self.drive_state = state
        self._publish()

    def host_lost(self) -> None:
        """0x6007: 1 fault, 2 disable, 3 quick stop."""
        action = self.values.get((0x6007, 0), 0)
        if self.drive_state is S.ENABLED:
            if action == 1:
                self.fault(0x8130)
            elif action == 2:
                self.drop(S.SWITCH_ON_DISABLED)
            elif action == 3:
                self.drop(S.QUICK_STOP)
        super().host_lost()

    def setpoints_lost(self) -> None:
        """The setpoint watchdog stops the axis by its own ramp."""
        if self.drive_state is S.ENABLED:
            self.drop(S.QUICK_STOP)

    def _mode_written(self, key: tuple[int, int], value: int) -> None:  # noqa: ARG002
        if value not in self.ignored_modes and self.values[0x6502, 0] >> (value - 1) & 1:
            self.values[0x6061, 0] = value

    def _control(self) -> None:
        word = self.values[0x6040, 0]
        reset, self._reset_before = bool(word & 0x80) and not self._reset_before, bool(word & 0x80)
        after = self._after(word, reset)
        if after is self.drive_state or self.drive_state in self.stubborn:
            return
        if after is S.ENABLED:
            self._released_at = self._now + BRAKE
            self.values[0x607A, 0] = self.values[0x607A, 0] if self.fresh else self.actual
        if self.drive_state is S.FAULT:
            self.values[0x603F, 0] = 0
            self.emergency(0)
        self.drive_state = after

    def _after(self, word: int, reset: bool) -> State:
        """The state this control word leads to."""
        state = self.drive_state
        if state in (S.FAULT, S.FAULT_REACTION, S.NOT_READY):
            return S.SWITCH_ON_DISABLED if reset and state is S.FAULT else state
        if word & 0x06 != 0x06:
            slows = word & 0x02 and state in (S.ENABLED, S.QUICK_STOP)
            return S.QUICK_STOP if slows else S.SWITCH_ON_DISABLED
        return _switched(state, word & 0x0F)

    def _next_setpoint(self) -> int:
        """Position units the position loop gets for the coming cycle, before the home shift."""
        if self.drive_state in HELD_BY_BRAKE or (self.drive_state is S.ENABLED and not self.following):
            self._speed, self._guessed, self._exact = 0.0, 0, float(self.actual)
            return self.actual
        if self.drive_state in (S.QUICK_STOP, S.FAULT_REACTION):
            return self._ramped_down()
        if self.values[0x6061, 0] == HOMING:
            return self._homing()
        return self._cyclic()

    def _cyclic(self) -> int:
        wanted = self.values[(0x607A, 0) if self.values[0x6061, 0] == CSP else (0x60C1, 1)]
        self._guessed = 0 if self.fresh else self._guessed + 1
        self.lost += not self.fresh
        if self._guessed == 1:
            wanted = round(self._exact + self._speed)
        elif self._guessed:
            wanted = round(self._exact)
        low, high = self.values[0x607D, 1], self.values[0x607D, 2]
        wanted = min(max(wanted, low), high)
        self._speed, self._exact = wanted - self._exact, float(wanted)
        return wanted

    def _ramped_down(self) -> int:
        slower = max(abs(self._speed) - self.values[0x6085, 0] * self._period**2, 0.0)
        self._speed = math.copysign(slower, self._speed)
        self._exact += self._speed
        if not self._speed:
            self.drive_state = S.FAULT if self.drive_state is S.FAULT_REACTION else S.SWITCH_ON_DISABLED
        return round(self._exact)

    def _homing(self) -> int:
        if not self.values[0x6040, 0] & 0x10 or self._homed:
            return self.actual
        if self.values[0x6098, 0] in (35, 37):
            self._home()
            return self.actual
        step = self.values[0x6099, 1] * self._period
        left = self.home_at - self.shift - self._exact
        self._exact += math.copysign(min(step, abs(left)), left)
        if not left:
            self._home()
        return round(self._exact)

    def _home(self) -> None:
        """The position here becomes the home offset."""
        moved = self.actual - self.values[0x607C, 0]
        self.shift += moved
        self.actual -= moved
        self._exact = float(self.actual)
        self._homed = True

    def _supervise(self) -> None:
        """Following error: window 0x6065 for longer than 0x6066 ms."""
        error = round(self._exact) - self.actual
        self.values[0x60F4, 0] = error
        window = self.values[0x6065, 0]
        if self.drive_state is not S.ENABLED or window in (0, 0xFFFFFFFF) or abs(error) <= window:
            self._away_since = None
            return
        if self._away_since is None:
            self._away_since = self._now
        if self._now - self._away_since >= self.values[0x6066, 0] * 1e-3:
            self.fault(0x8611)

    def _publish(self) -> None:
        word = self.drive_state | 0x200 | (0x10 if self.drive_state is not S.FAULT else 0)
        if self.drive_state is S.ENABLED:
            word |= 0x1400 if self.values[0x6061, 0] == HOMING and self._homed else 0
            word |= 0x1000 if self.values[0x6061, 0] != HOMING and self._on_target else 0
        self.values[0x6041, 0] = (word | self.status_extra) & self.status_mask
        self.values[0x6064, 0] = self.actual
        self.values[0x60FE, 1] = int(self.drive_state in HELD_BY_BRAKE)
