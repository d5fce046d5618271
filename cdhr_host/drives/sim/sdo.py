"""The SDO server of a node: expedited and segmented transfers, CiA 301 section 7.2.4."""

import struct
from typing import Final

from cdhr_host.drives.sim.dictionary import Abort, Dictionary, Key

TOGGLE: Final = 0x05030000
UNKNOWN_COMMAND: Final = 0x05040001


class SdoServer:
    """Answers requests one by one; ``refused`` maps objects to the abort code their writing gets."""

    def __init__(self, dictionary: Dictionary) -> None:
        self._dictionary = dictionary
        self.refused: dict[Key, int] = {}
        self.unread: set[Key] = set()
        self.altered: dict[Key, int] = {}
        self.silent = False
        self._sending = b""
        self._receiving: tuple[Key, bytes] | None = None
        self._toggle = 0
        self._key: Key = (0, 0)

    def answer(self, request: bytes) -> bytes | None:
        """8 bytes -> 8 bytes; None when there is nothing to say."""
        if self.silent or len(request) != 8 or request[0] == 0x80:
            return None
        command = request[0] >> 5
        if command in (1, 2):
            self._key = struct.unpack_from("<HB", request, 1)
        try:
            if command == 2:
                return self._begin_upload()
            if command == 3:
                return self._send_segment(request)
            if command == 1:
                return self._begin_download(request)
            if command == 0:
                return self._take_segment(request)
            raise Abort(UNKNOWN_COMMAND)
        except Abort as abort:
            return struct.pack("<BHBI", 0x80, *self._key, abort.code)

    def _begin_upload(self) -> bytes:
        if self._key in self.unread:
            raise Abort(0x08000020)
        data = self._dictionary.upload(self._key)
        if self._key in self.altered:
            data = (self.altered[self._key] & (1 << 8 * len(data)) - 1).to_bytes(len(data), "little")
        if len(data) <= 4:
            head = 0x43 | (4 - len(data)) << 2
            return struct.pack("<BHB", head, *self._key) + data.ljust(4, b"\0")
        self._sending, self._toggle = data, 0
        return struct.pack("<BHBI", 0x41, *self._key, len(data))

    def _send_segment(self, request: bytes) -> bytes:
        self._check_toggle(request)
        piece, self._sending = self._sending[:7], self._sending[7:]
        head = request[0] & 0x10 | (7 - len(piece)) << 1 | (not self._sending)
        return bytes([head]) + piece.ljust(7, b"\0")

    def _begin_download(self, request: bytes) -> bytes:
        if request[0] & 0x02:
            length = 4 - (request[0] >> 2 & 3) if request[0] & 1 else 4
            self._write(self._key, request[4 : 4 + length])
        else:
            self._receiving, self._toggle = (self._key, b""), 0
        return struct.pack("<BHB4x", 0x60, *self._key)

    def _take_segment(self, request: bytes) -> bytes:
        if self._receiving is None:
            raise Abort(UNKNOWN_COMMAND)
        self._check_toggle(request)
        key, data = self._receiving
        data += request[1 : 8 - (request[0] >> 1 & 7)]
        self._receiving = key, data
        if request[0] & 1:
            self._receiving = None
            self._write(key, data)
        return bytes([0x20 | request[0] & 0x10]) + bytes(7)

    def _check_toggle(self, request: bytes) -> None:
        if request[0] >> 4 & 1 != self._toggle:
            raise Abort(TOGGLE)
        self._toggle ^= 1

    def _write(self, key: Key, data: bytes) -> None:
        if key in self.refused:
            raise Abort(self.refused[key])
        self._dictionary.download(key, data)
