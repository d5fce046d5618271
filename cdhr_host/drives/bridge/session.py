"""One session on a line: frames numbered, stale ones left out."""

import secrets
from collections.abc import Iterator

from cdhr_host.drives.bridge.frames import Frame, Reader, Type, encoded
from cdhr_host.drives.bridge.line import Line
from cdhr_host.drives.clock import Clock


class Session:
    """Frames out and in; ``sent_at`` is when the last one left. Raises DriveError once the line is gone."""

    def __init__(self, line: Line, clock: Clock) -> None:
        self.line = line
        self.sent_at = clock.now()
        self._clock = clock
        self._reader = Reader()
        self._number = secrets.randbelow(0xFFFF) + 1
        self._sequence = self._heard = 0

    @property
    def number(self) -> int:
        """What tells this session from others."""
        return self._number

    def send(self, kind: Type, payload: bytes = b"") -> None:
        """One frame."""
        self._sequence = self._sequence + 1 & 0xFFFF
        self.line.write(encoded(Frame(kind, self._sequence, self._heard, self._number, payload)))
        self.sent_at = self._clock.now()

    def frames(self) -> Iterator[Frame]:
        """What has arrived of this session."""
        for frame in self._reader.frames(self.line.read()):
            if frame.session == self._number:
                self._heard = frame.seq
                yield frame
