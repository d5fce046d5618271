"""One axis as the cycle sees it."""

import struct
from typing import Final

from cdhr_host.drives.canopen.cia402 import DISABLE_VOLTAGE, State, decoded

FEEDBACK: Final = struct.Struct("<Hih")
SETPOINT: Final = struct.Struct("<Hih")
SLOW: Final = struct.Struct("<HbI")


class Axis:
    """Last feedback and control word of a drive; ``missed`` counts cycles without feedback,
    ``jump`` is the greatest movement a cycle."""

    def __init__(self, node: int) -> None:
        self.node = node
        self.status = 0
        self.position = 0
        self.torque = 0
        self.error = 0
        self.mode = 0
        self.inputs = 0
        self.word = DISABLE_VOLTAGE
        self.answers = 0
        self.missed = 0
        self.unfollowing = 0
        self.misfit: int | None = None
        self.jump = 0.0
        self._known = False

    @property
    def state(self) -> State:
        """What the status word says."""
        return decoded(self.status)

    def heard(self, data: bytes) -> None:
        """TPDO 1; one of another length is remembered as ``misfit``."""
        if len(data) != FEEDBACK.size:
            self.misfit = len(data)
            return
        before = self.position
        self.status, self.position, self.torque = FEEDBACK.unpack(data)
        if self._known:
            self.jump = max(self.jump, abs(self.position - before) / max(self.missed, 1))
        self._known = True
        self.answers += 1
        self.missed = 0

    def heard_slow(self, data: bytes) -> None:
        """TPDO 2."""
        if len(data) == SLOW.size:
            self.error, self.mode, self.inputs = SLOW.unpack(data)
