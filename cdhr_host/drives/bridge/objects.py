"""Objects of the drives behind a bridge: OD_READ and OD_WRITE; docs/link.md, section 9."""

from collections.abc import Callable
from typing import Final

from canopen.sdo.exceptions import SdoAbortedError

from cdhr_host.drives.bridge import messages as m
from cdhr_host.drives.bridge.frames import Frame, Type
from cdhr_host.drives.bridge.line import Line
from cdhr_host.drives.bridge.talker import Talker
from cdhr_host.drives.canopen.bus import NODES, Abort, number_of, object_bytes
from cdhr_host.drives.clock import Clock

NO_NODE: Final = 0x05040000
"""abort code: the node does not answer"""


class BridgeObjects(Talker):
    """ObjectAccess through a bridge; nothing is armed and nothing moves."""

    def __init__(self, clock: Clock, connect: Callable[[], Line]) -> None:
        super().__init__(clock, connect)
        self._answer: tuple[int, bytes] | None = None
        self._wanted_key: tuple[int, int, int] = (0, 0, 0)
        self._state: m.State | None = None
        self.greet()

    def nodes(self) -> list[int]:
        """Ids of the nodes that answer; raises DriveError."""
        return [node for node in NODES if self._exists(node)]

    def upload(self, node: int, index: int, sub: int = 0) -> bytes:
        """The bytes of an object; raises Abort, DriveError."""
        return self._ask(Type.OD_READ, m.OD_READ.pack(node, index, sub))

    def read(self, node: int, index: int, sub: int = 0) -> int:
        """A number; raises Abort, DriveError."""
        return number_of(self.upload(node, index, sub), node, index, sub)

    def write(self, node: int, index: int, sub: int, value: int, size: int | None = None) -> None:
        """Write a number; raises Abort, DriveError."""
        data = object_bytes(node, index, sub, value, size)
        self._ask(Type.OD_WRITE, m.OD_WRITE.pack(node, index, sub, len(data)) + data)

    def forget_fault(self) -> None:
        """An operator has looked at the machine: FAULT_RESET."""
        self.demand(lambda: self._state is not None, "the bridge says no status")
        if self._state is m.State.FAULT:
            out = lambda: self._state is not m.State.FAULT  # noqa: E731
            self.repeat(Type.FAULT_RESET, b"", out, "the bridge stays in fault")

    def close(self) -> None:
        """Give the line back."""
        self.hang_up()

    def _exists(self, node: int) -> bool:
        try:
            self.upload(node, 0x1000)
        except Abort as abort:
            return abort.code != NO_NODE
        return True

    def _ask(self, kind: Type, request: bytes) -> bytes:
        self._wanted_key, self._answer = m.OD_READ.unpack_from(request), None
        self.repeat(
            kind, request, lambda: self._answer is not None, "the bridge knows no objects of its drives"
        )
        assert self._answer is not None
        code, data = self._answer
        if code:
            raise Abort(code, str(SdoAbortedError(code)))
        return data

    def _take(self, frame: Frame) -> None:
        if frame.type in (Type.OD_READ_ACK, Type.OD_WRITE_ACK):
            *key, code, length = m.OD_ACK.unpack_from(frame.payload)
            if tuple(key) == self._wanted_key:
                self._answer = code, frame.payload[m.OD_ACK.size : m.OD_ACK.size + length]
        elif frame.type == Type.STATUS:
            self._state = m.status(frame.payload).state
        else:
            super()._take(frame)
