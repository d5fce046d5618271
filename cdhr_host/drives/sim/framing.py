"""COBS as firmware would do it."""


def cobs(data: bytes) -> bytes:
    """Byte by byte, as firmware would."""
    out, block = bytearray(), bytearray()
    for byte in data:
        if byte:
            block.append(byte)
        if not byte or len(block) == 254:
            out.append(len(block) + 1)
            out += block
            block.clear()
    out.append(len(block) + 1)
    out += block
    return bytes(out)


def plain(data: bytes) -> bytes | None:
    """COBS undone byte by byte; None where it is broken."""
    out = bytearray()
    left, code = 0, 0xFF
    for byte in data:
        if left == 0:
            if byte == 0:
                return None
            if code != 0xFF:
                out.append(0)
            code, left = byte, byte - 1
        else:
            out.append(byte)
            left -= 1
    return bytes(out) if left == 0 else None
