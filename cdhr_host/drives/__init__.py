"""Setpoints to wires: the MachineLink protocol and the ways to the drives."""

import difflib
from importlib.util import find_spec
from typing import Final

from cdhr_host.drives.clock import Clock, MonotonicClock, PacedClock
from cdhr_host.drives.link import LinkState, MachineLink
from cdhr_host.drives.loopback import Loopback
from cdhr_host.drives.timing import CycleTiming
from cdhr_host.errors import DriveError, Problem
from cdhr_host.profile.schema import Profile

__all__ = [
    "Clock",
    "CycleTiming",
    "LinkState",
    "Loopback",
    "MachineLink",
    "MonotonicClock",
    "PacedClock",
    "make_link",
    "open_link",
]

_FORMS: Final = {
    "loopback": "loopback:",
    "slcan": "slcan:PATH@BITRATE",
    "socketcan": "socketcan:CHANNEL",
    "link": "link:PATH@BAUD",
}


def open_link(url: str, profile: Profile, clock: Clock) -> MachineLink:
    """The link a drives URL names, opened. DriveError when there is no such link."""
    link = make_link(url, profile, clock)
    link.open()
    return link


def make_link(url: str, profile: Profile, clock: Clock) -> MachineLink:
    """The link a drives URL names, still closed.

    DriveError when there is no such link, ProfileError when the bus would be too full.
    """
    scheme, colon, rest = url.partition(":")
    if not colon or not (scheme in _FORMS or _interface(scheme)):
        raise _unknown(url, scheme)
    if scheme == "loopback":
        if rest:
            raise _refusal(f"drives '{url}': loopback: takes nothing after the colon", "use loopback:")
        return Loopback(profile, clock)
    return _wired(url, scheme, profile)


def _wired(url: str, scheme: str, profile: Profile) -> MachineLink:
    """A link to drives outside this process; their libraries are imported only here."""
    from cdhr_host.drives.address import split_rate  # noqa: PLC0415
    from cdhr_host.drives.bridge.pumped import PumpedBridge  # noqa: PLC0415
    from cdhr_host.drives.canopen.load import BIT_RATE, bus_share  # noqa: PLC0415
    from cdhr_host.drives.reference import default_store  # noqa: PLC0415
    from cdhr_host.drives.sender import SenderLink  # noqa: PLC0415

    if scheme == "link":
        return PumpedBridge(profile, *split_rate(url, "BAUD", 921_600))
    bus_share(profile, split_rate(url, "BITRATE", BIT_RATE)[1] if scheme == "slcan" else BIT_RATE)
    return SenderLink(url, profile, default_store())


def _interface(scheme: str) -> bool:
    """Whether python-can has an interface of this name."""
    return scheme.isidentifier() and find_spec(f"can.interfaces.{scheme}") is not None


def _unknown(url: str, scheme: str) -> DriveError:
    near = difflib.get_close_matches(scheme.lower(), _FORMS, n=1, cutoff=0.5)
    hint = f"did you mean {_FORMS[near[0]]}?" if near else f"known are {', '.join(_FORMS.values())}"
    return _refusal(f"drives '{url}' are not known", hint)


def _refusal(message: str, hint: str) -> DriveError:
    return DriveError(Problem("drives-url", message, hint=hint))
