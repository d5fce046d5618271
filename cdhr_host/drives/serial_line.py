"""A serial line, written in bulk and read by a thread of its own.

A tty's bytes are handed over by a kernel worker of ordinary priority, and ``poll`` and ``read`` of a tty
that is empty wait until that worker has run (``tty_buffer_flush_work``): tens of milliseconds on a
busy computer, whatever the priority of who asks. The thread waits; whoever calls ``read`` does not.
"""

import os
import select
import threading
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Final

import serial

CHUNK: Final = 65536
"""bytes taken at a time"""


class SerialLine:
    """A tty; ``patience`` s is what it may take to make room. Raises OSError that says what is wrong.

    ``heard`` counts the bytes that have arrived, ``gone`` says why no more will.
    """

    def __init__(self, path: str, baud: int, patience: float) -> None:
        try:
            self._port = serial.Serial(path, baudrate=baud, timeout=0, exclusive=True)
        except (OSError, ValueError) as error:
            raise OSError(f"cannot open {path}: {error}") from error
        self._patience = patience
        self._fd = self._port.fileno()
        self.heard = 0
        self._arrived: SimpleQueue[bytes] = SimpleQueue()
        self.gone: str | None = None
        self._ended, self._end = os.pipe()
        self._reader = threading.Thread(target=self._read_on, name="serial line", daemon=True)
        self._reader.start()

    def write(self, data: bytes) -> None:
        """Send all, waiting for room a little."""
        view = memoryview(data)
        while view:
            try:
                view = view[os.write(self._fd, view) :]
            except BlockingIOError:
                if not select.select([], [self._fd], [], self._patience)[1]:
                    raise OSError(f"{self._port.port} takes no more bytes") from None
            except OSError as error:
                raise OSError(f"{self._port.port} is gone: {error.strerror}") from error

    def read(self, timeout: float = 0.0) -> bytes:
        """All that has arrived; waits up to ``timeout`` s for the first byte."""
        found = []
        if timeout:
            with suppress(Empty):
                found.append(self._arrived.get(timeout=timeout))
        while not self._arrived.empty():
            found.append(self._arrived.get())
        if self.gone is not None:
            raise OSError(self.gone)
        return b"".join(found)

    def close(self) -> None:
        """Give the tty back."""
        if self._port.is_open:
            os.write(self._end, b"\0")
            self._reader.join()
            os.close(self._ended)
            os.close(self._end)
            self._port.close()

    def _read_on(self) -> None:
        """The thread: until the line is closed or gone."""
        poll = select.poll()
        poll.register(self._fd, select.POLLIN)
        poll.register(self._ended, select.POLLIN)
        while self.gone is None:
            events = dict(poll.poll())
            if self._ended in events:
                return
            data = self._taken(readable=bool(events[self._fd] & select.POLLIN))
            self._arrived.put(data)
            self.heard += len(data)

    def _taken(self, *, readable: bool) -> bytes:
        """What the tty holds; nothing, and ``gone`` set, where it is gone."""
        why = ""
        try:
            data = os.read(self._fd, CHUNK) if readable else b""
        except OSError as error:
            data, why = b"", f": {error.strerror}"
        if not data:
            self.gone = f"{self._port.port} is gone{why}"
        return data
