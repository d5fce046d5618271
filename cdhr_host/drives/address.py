"""What follows the colon of a drives URL."""

import difflib

import can

from cdhr_host.drives.canopen.port import CanPort, Port, SlcanPort
from cdhr_host.errors import DriveError, Problem

BIT_RATE = 1_000_000


def split_rate(url: str, what: str, default: int) -> tuple[str, int]:
    """``PATH@RATE`` -> path and rate; raises DriveError."""
    scheme, _, rest = url.partition(":")
    path, _at, rate = rest.rpartition("@") if "@" in rest else (rest, "", str(default))
    if not path or not rate.isdecimal():
        raise DriveError(
            Problem(
                "drives-url", f"drives '{url}' are not {scheme}:PATH@{what}", hint=f"{scheme}:/dev/ttyACM0"
            )
        )
    return path, int(rate)


def port_of(url: str) -> Port:
    """The bus a URL names, opened; raises DriveError."""
    scheme, _, channel = url.partition(":")
    if scheme == "slcan":
        return SlcanPort(*split_rate(url, "BITRATE", BIT_RATE))
    if scheme not in can.VALID_INTERFACES:
        near = difflib.get_close_matches(scheme, ["slcan", *can.VALID_INTERFACES], n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}:{channel}?" if near else "slcan:PATH@BITRATE or socketcan:CHANNEL"
        raise DriveError(Problem("drives-url", f"drives '{url}' are not known", hint=hint))
    if not channel:
        raise DriveError(Problem("drives-url", f"drives '{url}' name no channel", hint=f"{scheme}:can0"))
    return CanPort(scheme, channel)
