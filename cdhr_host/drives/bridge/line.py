"""A serial line to the bridge."""

from typing import Protocol

from cdhr_host.drives.canopen.port import transport_fault
from cdhr_host.drives.serial_line import SerialLine

PATIENCE = 0.05
"""s the line may take to make room"""

BITS = 10
"""on the line for a byte, 8N1"""


class Line(Protocol):
    """Bytes out and in; raises DriveError of kind ``transport`` once it is gone."""

    @property
    def rate(self) -> float:
        """Bytes a second."""
        ...

    def write(self, data: bytes) -> None:
        """Send all."""
        ...

    def read(self) -> bytes:
        """What has arrived; never waits."""
        ...

    def close(self) -> None:
        """Give the line back."""
        ...


class BridgeLine:
    """A tty."""

    def __init__(self, path: str, baud: int) -> None:
        try:
            self._line = SerialLine(path, baud, PATIENCE)
        except OSError as error:
            raise transport_fault(str(error)) from error
        self.rate = baud / BITS

    def write(self, data: bytes) -> None:
        """Send all, waiting for room a little."""
        try:
            self._line.write(data)
        except OSError as error:
            raise transport_fault(str(error)) from error

    def read(self) -> bytes:
        """All that has arrived."""
        try:
            return self._line.read()
        except OSError as error:
            raise transport_fault(str(error)) from error

    def close(self) -> None:
        """Close the tty."""
        self._line.close()
