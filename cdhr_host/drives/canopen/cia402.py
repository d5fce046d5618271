"""The state machine of a drive as a table, CiA 402."""

from enum import Enum
from typing import Final


class State(Enum):
    """What a drive's status word says."""

    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch-on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    ENABLED = "operation enabled"
    QUICK_STOP = "quick stop active"
    FAULT_REACTION = "fault reaction active"
    FAULT = "fault"
    UNKNOWN = "unknown"


_BY_4F: Final = {
    0x00: State.NOT_READY,
    0x40: State.SWITCH_ON_DISABLED,
    0x0F: State.FAULT_REACTION,
    0x08: State.FAULT,
}
_BY_6F: Final = {
    0x21: State.READY,
    0x23: State.SWITCHED_ON,
    0x27: State.ENABLED,
    0x07: State.QUICK_STOP,
}

FOLLOWS_TARGET: Final = 1 << 12
FOLLOWING_ERROR: Final = 1 << 13
INTERNAL_LIMIT: Final = 1 << 11
TARGET_REACHED: Final = 1 << 10

DISABLE_VOLTAGE: Final = 0x00
SHUTDOWN: Final = 0x06
SWITCH_ON: Final = 0x07
ENABLE: Final = 0x0F
QUICK_STOP: Final = 0x02
FAULT_RESET: Final = 0x80
START_HOMING: Final = 0x1F
INTERPOLATE: Final = 0x1F

STEPS_UP: Final = ((SHUTDOWN, State.READY), (SWITCH_ON, State.SWITCHED_ON), (ENABLE, State.ENABLED))
"""control word to send, state to wait for, one after the other; never a fault reset"""


def decoded(status: int) -> State:
    """The state in a status word."""
    return _BY_6F.get(status & 0x6F) or _BY_4F.get(status & 0x4F, State.UNKNOWN)
