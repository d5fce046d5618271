"""The frames whose bytes docs/link.md shows; ``python tests/drives/golden_frames.py`` prints its section."""

import struct
import sys
import textwrap
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from cdhr_host.drives.bridge import messages as m
from cdhr_host.drives.bridge.frames import Frame, Type, encoded

SESSION = 0x1234
PAGE = Path(__file__).resolve().parents[2] / "docs" / "link.md"


def golden():
    """Words of the page -> the frame."""
    row = m.tick(np.arange(1, 7) * 1000, np.arange(6), 80e3)
    axis = m.AXIS.pack(-10_000_000, 10_000_000, 8002, 324, 1000, 1)
    config = m.CONFIG.pack(4000, 100_000) + 6 * axis + m.CONFIG_END.pack(250, 228, 100, 2000, 100)
    where = [1000 * (k + 1) for k in range(6)]
    status = (
        m.STATUS.pack(42, 50, m.NO_TICK, 42, 8, 1024, m.State.RUN, 1, 1000, 7)
        + b"".join(m.STATUS_AXIS.pack(at, 0, k, 0x1237) for k, at in enumerate(where))
        + m.STATUS_END.pack(800, 0, 0, 0, 0, 0, 0, 0)
    )
    payloads = {
        "HELLO: versions 1 to 1, host, six axes, firmware 1": (
            Type.HELLO,
            m.HELLO.pack(1, 1, m.ROLE_HOST, 6, 0, 0, 1, 0, bytes(8)),
        ),
        "CONFIG: 4 ms, 0.1 µm, travel ± 1 m, steps 8002 and 324, 1000 ‰; 250 ms, 228, 100, 200 kPa, 100 ms": (
            Type.CONFIG,
            config,
        ),
        "CONFIG_ACK of it": (Type.CONFIG_ACK, struct.pack("<I", m.config_crc(config))),
        "CLOCK_REQ: 1 s": (Type.CLOCK_REQ, m.CLOCK_REQ.pack(1_000_000_000)),
        "CLOCK: the same, bridge at 2.5 s, next tick 42": (
            Type.CLOCK,
            m.CLOCK.pack(1_000_000_000, 2_500_000, 42),
        ),
        "ARM of this CONFIG at 0": (Type.ARM, m.ARM.pack(m.config_crc(config), 0, 0, 0, 0, 0, 0)),
        "SETPOINTS: tick 42, positions 1000, 2000 ... 6000, torques 0 ... 5 ‰, 80.0 kPa, flag 1": (
            Type.SETPOINTS,
            m.SETPOINTS.pack(42, 1, 6, 1, 0) + row,
        ),
        "REVISE: the same setpoint for tick 40, flags 3, revision 7": (
            Type.REVISE,
            m.SETPOINTS.pack(40, 1, 6, 3, 7) + row,
        ),
        "STOP: mode 0": (Type.STOP, b"\0"),
        "FAULT_RESET": (Type.FAULT_RESET, b""),
        "RATE: 0 within 100 outputs": (Type.RATE, m.RATE.pack(0, 100)),
        "KEEPALIVE: 1000 ms, output 42 wanted": (Type.KEEPALIVE, m.KEEPALIVE.pack(1000, 42)),
        "OD_READ: node 3, 0x6065:00": (Type.OD_READ, m.OD_READ.pack(3, 0x6065, 0)),
        "OD_READ_ACK: 10000": (
            Type.OD_READ_ACK,
            m.OD_ACK.pack(3, 0x6065, 0, 0, 4) + struct.pack("<I", 10000),
        ),
        "OD_WRITE: node 3, 0x6065:00 = 5000": (
            Type.OD_WRITE,
            m.OD_WRITE.pack(3, 0x6065, 0, 4) + struct.pack("<I", 5000),
        ),
        "STATUS: running, tick 42 next, 8 stored": (Type.STATUS, status),
        "EXECUTED: output 42, exactly there, 80.0 kPa": (
            Type.EXECUTED,
            m.EXECUTED.pack(42, 1) + m.EXECUTED_TICK.pack(*where, *where, *range(6), 800),
        ),
        "FAULT: 6, slider 3, tick 42": (Type.FAULT, m.FAULT.pack(6, 2, 1, 42, 0, *where)),
        "NAK: 50 expected, gap, credit 1016": (Type.NAK, m.NAK.pack(50, 2, 7, 1016)),
    }
    return {
        words: Frame(kind, 2 + k, 1, SESSION, payload)
        for k, (words, (kind, payload)) in enumerate(payloads.items())
    }


def section():
    """The page's last section."""
    lines = [
        "## 10. Golden frames",
        "",
        "Bytes on the wire, session 0x1234, ack 1, seq 2, 3 and so on; from",
        "`python tests/drives/golden_frames.py`, checked by `tests/drives/test_bridge.py`.",
    ]
    for words, frame in golden().items():
        text = textwrap.fill(encoded(frame).hex(" "), 95, initial_indent="    ", subsequent_indent="    ")
        lines += ["", words, "", text]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(page[: page.index("## 10. Golden frames")] + section(), encoding="utf-8")
    print(PAGE)
