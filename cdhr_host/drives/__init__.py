"""Setpoints to wires: the MachineLink protocol and the ways to the drives."""

import difflib
from typing import Final

from cdhr_host.drives.clock import Clock, MonotonicClock, PacedClock
from cdhr_host.drives.link import LinkState, MachineLink
from cdhr_host.drives.loopback import Loopback
from cdhr_host.errors import DriveError, Problem
from cdhr_host.profile.schema import Profile

__all__ = ["Clock", "LinkState", "Loopback", "MachineLink", "MonotonicClock", "PacedClock", "open_link"]

_FORMS: Final = {
    "loopback": "loopback:",
    "slcan": "slcan:PATH@BITRATE",
    "socketcan": "socketcan:CHANNEL",
    "link": "link:PATH@BAUD",
}


def open_link(url: str, profile: Profile, clock: Clock) -> MachineLink:
    """The link a drives URL names, opened. DriveError when there is no such link."""
    scheme, colon, rest = url.partition(":")
    if scheme not in _FORMS or not colon:
        raise _unknown(url, scheme)
    if scheme != "loopback":
        raise _refusal(
            f"drives '{url}' are not available yet in this version", "use loopback:, the simulated drives"
        )
    if rest:
        raise _refusal(f"drives '{url}': loopback: takes nothing after the colon", "use loopback:")
    link = Loopback(profile, clock)
    link.open()
    return link


def _unknown(url: str, scheme: str) -> DriveError:
    near = difflib.get_close_matches(scheme.lower(), _FORMS, n=1, cutoff=0.5)
    hint = f"did you mean {_FORMS[near[0]]}?" if near else f"known are {', '.join(_FORMS.values())}"
    return _refusal(f"drives '{url}' are not known", hint)


def _refusal(message: str, hint: str) -> DriveError:
    return DriveError(Problem("drives-url", message, hint=hint))
