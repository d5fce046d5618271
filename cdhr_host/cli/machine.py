"""The machine a command works on: its profile, its drives, its log."""

from pathlib import Path
from typing import TYPE_CHECKING

from cdhr_host.cli.refusals import Refusal, about, check_file, say

if TYPE_CHECKING:
    from cdhr_host.drives import Clock, MachineLink
    from cdhr_host.profile import Profile

SIMULATED = "loopback:"


def open_machine(profile: str, material: str | None = None) -> "Profile":
    """The profile, with this clay if one is named; its refusals name it."""
    from cdhr_host.pipeline import open_profile

    with about(profile):
        machine = open_profile(profile, material)
    if machine.clay.example:
        say(f"{machine.clay.name}: an example, not your clay; cdhr calibrate clay finds yours")
    return machine


def opened(drives: str, machine: "Profile", speed: float) -> "tuple[MachineLink, Clock]":
    """The link and the clock it runs by; raises DriveError, Refusal for a speed real drives lack."""
    from cdhr_host.drives import MonotonicClock, PacedClock, open_link

    simulated = drives == SIMULATED
    if speed != 1.0 and not simulated:
        raise Refusal("cdhr: error: --speed is for simulated drives only\nhint: use M220 to print faster")
    clock = PacedClock(speed) if simulated else MonotonicClock()
    link = open_link(drives, machine, clock)
    for note in link.notes:
        say(f"{drives}: {note}")
    return link, clock


def check_log(log: Path | None, *, compact: bool = False) -> None:
    """Refuse a log that could not be written, before any work."""
    if log is None:
        return
    from cdhr_host.report import compact as packed
    from cdhr_host.report.log import WRITERS

    check_file(log, packed.WRITERS if compact else WRITERS, "--log")
