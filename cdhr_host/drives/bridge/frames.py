"""Frames of the link: COBS( header | payload | CRC-32 ) 00; docs/link.md."""

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

VERSION: Final = 1
HEADER: Final = struct.Struct("<BBHHH")
MAX_PAYLOAD: Final = 512
LARGEST: Final = HEADER.size + MAX_PAYLOAD + 4


class Type(IntEnum):
    """What a frame is."""

    HELLO = 0x01
    CONFIG = 0x02
    CLOCK_REQ = 0x03
    ARM = 0x10
    SETPOINTS = 0x11
    STOP = 0x12
    DISARM = 0x13
    FAULT_RESET = 0x14
    KEEPALIVE = 0x15
    RATE = 0x16
    REVISE = 0x17
    OD_READ = 0x20
    OD_WRITE = 0x21
    HELLO_ACK = 0x81
    CONFIG_ACK = 0x82
    CLOCK = 0x83
    STATUS = 0x91
    FAULT = 0x92
    EXECUTED = 0x93
    NAK = 0x94
    OD_READ_ACK = 0xA0
    OD_WRITE_ACK = 0xA1


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame; ``ack`` is the last in-order ``seq`` its sender has received."""

    type: int
    seq: int
    ack: int
    session: int
    payload: bytes = b""


def encoded(frame: Frame) -> bytes:
    """The bytes on the wire, the closing 00 included."""
    head = HEADER.pack(VERSION, frame.type, frame.seq, frame.ack, frame.session)
    body = head + frame.payload
    return stuffed(body + struct.pack("<I", zlib.crc32(body))) + b"\0"


def decoded(data: bytes) -> Frame | None:
    """What stood between two 00; None for anything that is not one whole frame of this version."""
    body = unstuffed(data)
    if body is None or not HEADER.size + 4 <= len(body) <= LARGEST:
        return None
    (crc,) = struct.unpack_from("<I", body, len(body) - 4)
    if crc != zlib.crc32(body[:-4]) or body[0] != VERSION:
        return None
    _, kind, seq, ack, session = HEADER.unpack_from(body)
    return Frame(kind, seq, ack, session, body[HEADER.size : -4])


def stuffed(data: bytes) -> bytes:
    """COBS: the same bytes without a 00."""
    out = bytearray()
    for part in data.split(b"\0"):
        whole = len(part) // 254 * 254
        for at in range(0, whole, 254):
            out += b"\xff" + part[at : at + 254]
        out += bytes([len(part) - whole + 1]) + part[whole:]
    return bytes(out)


def unstuffed(data: bytes) -> bytes | None:
    """COBS undone; None where it is broken."""
    out, at = bytearray(), 0
    while at < len(data):
        code = data[at]
        block = data[at + 1 : at + code]
        if not code or len(block) != code - 1:
            return None
        out += block
        at += code
        if code < 0xFF and at < len(data):
            out += b"\0"
    return bytes(out)


class Reader:
    """Finds frames in a stream of bytes; ``dropped`` counts what was none."""

    def __init__(self) -> None:
        self.dropped = 0
        self._tail = b""

    def frames(self, data: bytes) -> list[Frame]:
        """All frames that are complete now."""
        *whole, self._tail = (self._tail + data).split(b"\0")
        if len(self._tail) > 2 * LARGEST:
            self._tail = b""
            self.dropped += 1
        found = []
        for piece in whole:
            frame = decoded(piece) if piece else None
            if frame is not None:
                found.append(frame)
            elif piece:
                self.dropped += 1
        return found
