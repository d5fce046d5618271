"""A serial line to the bridge."""

import os
import select
from typing import Protocol

import serial

from cdhr_host.drives.canopen.port import transport_fault

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


class SerialLine:
    """A tty."""

    def __init__(self, path: str, baud: int) -> None:
        try:
            self._port = serial.Serial(path, baudrate=baud, timeout=0, exclusive=True)
        except (OSError, ValueError) as error:
            raise transport_fault(f"cannot open {path}: {error}") from error
        self._fd = self._port.fileno()
        self.rate = baud / BITS

    def write(self, data: bytes) -> None:
        """Send all, waiting for room a little."""
        view = memoryview(data)
        while view:
            try:
                view = view[os.write(self._fd, view) :]
            except BlockingIOError:
                if not select.select([], [self._fd], [], PATIENCE)[1]:
                    raise transport_fault("the bridge takes no more bytes") from None
            except OSError as error:
                raise transport_fault(f"{self._port.port} is gone: {error.strerror}") from error

    def read(self) -> bytes:
        """All that has arrived."""
        if not select.select([self._fd], [], [], 0)[0]:
            return b""
        try:
            data = os.read(self._fd, 65536)
        except OSError as error:
            raise transport_fault(f"{self._port.port} is gone: {error.strerror}") from error
        if not data:
            raise transport_fault(f"{self._port.port} is gone")
        return data

    def close(self) -> None:
        """Close the tty."""
        self._port.close()
