"""Error codes of EMCY messages and 0x603F, CiA 301 and CiA 402, in words."""

from typing import Final

_CODES: Final = {
    0x2310: "continuous over-current",
    0x2320: "short circuit",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x4210: "device too hot",
    0x4310: "drive too hot",
    0x5441: "safe torque off",
    0x6320: "parameter error",
    0x7121: "motor blocked",
    0x7300: "sensor failed",
    0x7320: "position sensor failed",
    0x8110: "CAN overrun",
    0x8120: "CAN error passive",
    0x8130: "host heartbeat lost",
    0x8140: "recovered from bus-off",
    0x8210: "PDO too short",
    0x8220: "PDO too long",
    0x8240: "SYNC has an unexpected length",
    0x8250: "setpoint watchdog ran out",
    0x8611: "following error",
    0x8612: "reference limit",
}
_CLASSES: Final = {
    0x1: "generic error",
    0x2: "current",
    0x3: "voltage",
    0x4: "temperature",
    0x5: "device hardware",
    0x6: "device software",
    0x7: "additional modules",
    0x8: "monitoring",
    0x9: "external error",
    0xF: "device specific",
}


def meaning(code: int) -> str:
    """``0x8611 following error``."""
    return f"0x{code:04X} {_CODES.get(code) or _CLASSES.get(code >> 12, 'unknown error')}"
