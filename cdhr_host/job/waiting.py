"""Waiting between two feeds."""

from typing import Final

from cdhr_host.drives.clock import Clock
from cdhr_host.drives.link import MachineLink

SLICE: Final = 0.05
"""s of real time after which an interruption is noticed at the latest"""

TURN: Final = 0.004
"""s of real time between two looks at what is asked, while the machine moves"""


def wait_for_credit(link: MachineLink, clock: Clock) -> None:
    """Let time pass until about a quarter of the link's buffer is executed, or a slice."""
    quarter = max(link.free + link.buffered, 4) // 4 * link.profile.drives.period
    clock.wait_until(clock.now() + min(SLICE * clock.speed, quarter))


def wait_a_little(link: MachineLink, clock: Clock) -> None:
    """Let a turn of real time pass, but no more than about a quarter of the link's buffer."""
    period = link.profile.drives.period
    quarter = max(link.free + link.buffered, 4) // 4 * period
    clock.wait_until(clock.now() + min(max(TURN * clock.speed, period), quarter))
