"""The bridge's end of the line: bytes to frames of its session and back; docs/link.md, section 1."""

import struct
import zlib
from collections.abc import Iterator

from cdhr_host.drives.sim.framing import cobs, plain

HELLO = 0x01


class Wire:
    """``dropped`` counts what was no frame of this session."""

    def __init__(self) -> None:
        self.session = 0
        self.dropped = 0
        self._sequence = self._heard = 0
        self._text = bytearray()
        self._out = bytearray()

    def frames(self, data: bytes) -> Iterator[tuple[int, int, bytes]]:
        """Type, session and payload of what the host sent; of another session only HELLO."""
        for byte in data:
            if byte:
                self._text.append(byte)
                continue
            text, self._text = bytes(self._text), bytearray()
            if (frame := self._frame(text)) is not None:
                yield frame

    def say(self, kind: int, payload: bytes) -> None:
        """One frame to the host."""
        self._sequence = self._sequence + 1 & 0xFFFF
        body = struct.pack("<BBHHH", 1, kind, self._sequence, self._heard, self.session) + payload
        self._out += cobs(body + struct.pack("<I", zlib.crc32(body))) + b"\0"

    def taken(self) -> bytes:
        """All that is to be sent, once."""
        out, self._out = bytes(self._out), bytearray()
        return out

    def _frame(self, text: bytes) -> tuple[int, int, bytes] | None:
        body = plain(text)
        if body is None or len(body) < 12 or zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
            self.dropped += bool(text)
            return None
        version, kind, sequence, _, session = struct.unpack_from("<BBHHH", body)
        if version != 1 or (kind != HELLO and session != self.session):
            self.dropped += 1
            return None
        self._heard = sequence
        return kind, session, body[8:-4]
