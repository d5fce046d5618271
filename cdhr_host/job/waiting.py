"""Waiting between two feeds."""

from typing import Final

from cdhr_host.drives.clock import Clock
from cdhr_host.drives.link import MachineLink

SLICE: Final = 0.05
"""s of real time after which an interruption is noticed at the latest"""


def wait_for_credit(link: MachineLink, clock: Clock) -> None:
    """Let time pass until about a quarter of the link's buffer is executed, or a slice."""
    quarter = max(link.free + link.buffered, 4) // 4 * link.profile.drives.period
    clock.wait_until(clock.now() + min(SLICE * clock.speed, quarter))
