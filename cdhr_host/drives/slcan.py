"""CAN over a serial line: the LAWICEL text protocol, read and written in bulk.

One read takes what has arrived and one write sends a whole cycle of frames, so that 250 cycles
of 14 frames a second cost a few percent of a core. A line that hung up is noticed by the next
``receive`` or ``transmit``, whichever comes first.
"""

import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Final

import can
from can.typechecking import CanFilters

from cdhr_host.drives.serial_line import SerialLine

Frame = tuple[int, bytes]
"""11-bit identifier and up to 8 bytes"""

BITRATES: Final = {
    10_000: "S0",
    20_000: "S1",
    50_000: "S2",
    100_000: "S3",
    125_000: "S4",
    250_000: "S5",
    500_000: "S6",
    800_000: "S7",
    1_000_000: "S8",
}
BAUD: Final = 1_000_000
"""of the serial line; USB adapters ignore it"""
MAX_LINE: Final = 64
"""bytes after which a line without an end is noise"""
PATIENCE: Final = 0.02
"""s the adapter may take to make room for what is written"""
BUS_ERROR: Final = 0x80
ERROR_PASSIVE: Final = 0x20
TX_FULL: Final = 0x02


def encoded(frames: Sequence[Frame]) -> bytes:
    """Frames as one piece of text."""
    return "".join(f"t{cob:03X}{len(data)}{data.hex().upper()}\r" for cob, data in frames).encode()


def decoded(line: bytes) -> Frame | None:
    """The frame of a line without its end; None for anything but a whole data frame."""
    if len(line) < 5 or line[:1] != b"t":
        return None
    try:
        cob, length, data = int(line[1:4], 16), int(line[4:5]), bytes.fromhex(line[5:].decode())
    except ValueError:
        return None
    return (cob, data) if len(data) == length <= 8 and cob < 0x800 and len(line) == 5 + 2 * length else None


class SlcanBus(can.BusABC):
    """A serial CAN adapter; ``channel`` is its path.

    ``dropped`` counts lines that were no frame, ``rejected`` the adapter's refusals (BELL),
    ``flags`` is its last status byte. Raises can.CanInitializationError when it cannot be
    opened, can.CanOperationError when it is gone.
    """

    def __init__(self, channel: str, bitrate: int = 1_000_000, **kwargs: Any) -> None:
        if bitrate not in BITRATES:
            known = ", ".join(map(str, BITRATES))
            raise can.CanInitializationError(f"bit rate {bitrate} is not one of {known}")
        try:
            self._line = SerialLine(channel, BAUD, PATIENCE)
        except OSError as error:
            raise can.CanInitializationError(str(error)) from error
        self._closed = False
        self._tail = b""
        self._waiting: deque[can.Message] = deque()
        self.dropped = self.rejected = self.flags = 0
        self._write(f"C\r{BITRATES[bitrate]}\rO\r".encode())
        super().__init__(channel=channel, **kwargs)

    @property
    def heard(self) -> int:
        """Bytes that have arrived."""
        return self._line.heard

    def transmit(self, frames: Sequence[Frame]) -> None:
        """Send frames with one write; raises can.CanOperationError."""
        self._write(encoded(frames))

    def receive(self, timeout: float = 0.0) -> list[Frame]:
        """All frames that have arrived, waiting up to ``timeout`` s for the first byte."""
        try:
            data = self._line.read(timeout)
        except OSError as error:
            raise can.CanOperationError(f"the adapter {error}") from error
        return self._frames(data) if data else []

    def ask_status(self) -> None:
        """Ask for the status byte; it arrives among the frames and is kept in ``flags``."""
        self._write(b"F\r")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002
        """One frame of python-can; extended, remote and FD frames are refused."""
        if msg.is_extended_id or msg.is_remote_frame or msg.is_fd:
            raise can.CanOperationError("only classic data frames with 11-bit identifiers are sent")
        self.transmit([(msg.arbitration_id, bytes(msg.data))])

    def shutdown(self) -> None:
        """Close the channel and the line."""
        super().shutdown()
        if not self._closed:
            self._closed = True
            with suppress(can.CanOperationError):
                self._write(b"C\r")
            self._line.close()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._waiting:
            now = time.time()
            self._waiting.extend(
                can.Message(timestamp=now, arbitration_id=cob, data=data, is_extended_id=False)
                for cob, data in self.receive(3600.0 if timeout is None else timeout)
            )
        return (self._waiting.popleft() if self._waiting else None), False

    def _apply_filters(self, filters: CanFilters | None) -> None:
        """Frames are filtered by python-can."""

    def _frames(self, data: bytes) -> list[Frame]:
        lines = (self._tail + data.replace(b"\a", b"\a\r")).split(b"\r")
        self._tail = lines.pop()
        if len(self._tail) > MAX_LINE:
            self._tail = b""
            self.dropped += 1
        frames = []
        for line in lines:
            if (frame := decoded(line)) is not None:
                frames.append(frame)
            elif line:
                self._other(line)
        return frames

    def _other(self, line: bytes) -> None:
        """What is no frame: acknowledgements, refusals, the status byte, noise."""
        if line in (b"z", b"Z"):
            return
        if line.endswith(b"\a"):
            self.rejected += 1
            self.dropped += len(line) > 1
        elif len(line) == 3 and line[:1] == b"F" and line[1:].isalnum():
            try:
                self.flags = int(line[1:], 16)
            except ValueError:
                self.dropped += 1
        else:
            self.dropped += 1

    def _write(self, data: bytes) -> None:
        try:
            self._line.write(data)
        except OSError as error:
            raise can.CanOperationError(f"the adapter {error}") from error
