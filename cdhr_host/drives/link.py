"""What every way to the drives offers."""

from collections.abc import Callable
from enum import Enum
from typing import Protocol

from cdhr_host.drives.timing import CycleTiming
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Feedback, Setpoints

Told = Callable[[int], None]
"""hears the number of a drive, 1 to 6"""


def untold(drive: int) -> None:
    """Nobody wants to know."""


class LinkState(Enum):
    """Where a link is in its life."""

    CLOSED = "closed"
    OPEN = "open"
    """the far side answers, nothing may move"""
    ARMED = "armed"
    """holding position, setpoints are buffered, none is executed yet"""
    RUNNING = "running"
    """executing setpoints, or standing at rest after the last one"""
    STOPPING = "stopping"
    """coming to rest on the path, air off"""
    STOPPED = "stopped"
    """at rest, air off; may be armed again"""
    FAULT = "fault"
    """at rest, air off, after a fault; only closing helps"""


class MachineLink(Protocol):
    """A buffered far side: absolute ticks in, feedback of executed ticks out.

    A link whose drives take one setpoint a cycle keeps its buffer in its own sender. Calls
    raise DriveError. A fault of the far side is raised by the next ``feed`` or ``feedback``
    after it; from then on ``feed`` refuses, and ``feedback`` gives the rows of the stop.
    ``state``, ``free``, ``buffered`` and ``stop_tick`` are as of the last call.
    """

    @property
    def profile(self) -> Profile:
        """The machine at the far side."""
        ...

    @property
    def state(self) -> LinkState:
        """Where the link is in its life."""
        ...

    @property
    def free(self) -> int:
        """Rows that ``feed`` would accept."""
        ...

    @property
    def buffered(self) -> int:
        """Rows accepted and not executed yet."""
        ...

    @property
    def stop_tick(self) -> int | None:
        """First tick of the path-true stop (``motion.hold``) since arming; None when there is none."""
        ...

    @property
    def resolution(self) -> float:
        """M a setpoint is rounded to on its way; 0 when it is not."""
        ...

    @property
    def slider(self) -> Array:
        """(6,) m from the reference pose, where the sliders stand, as measured last; not while CLOSED."""
        ...

    @property
    def notes(self) -> list[str]:
        """What an operator should know after ``open``: oddities of the drives, the timing test."""
        ...

    def timing(self) -> CycleTiming | None:
        """How punctual the cycles since arming were; None for a link without cycles of its own."""
        ...

    def stop_rows(self, ahead: Setpoints) -> Setpoints:
        """Rows fed for ``stop_tick`` and later -> the rows the link plays instead."""
        ...

    def open(self) -> None:
        """CLOSED -> OPEN: find the drives."""
        ...

    @property
    def referenced(self) -> bool:
        """Whether every axis knows the reference pose; ``arm`` refuses otherwise. Not while CLOSED."""
        ...

    def home(self, told: Told = untold) -> None:
        """Find the reference pose by the drives' homing, one slider after the other. OPEN or STOPPED.

        ``told`` hears the number of each drive as its turn comes. Nothing to do where the profile's
        drives know it by themselves. Raises DriveError, also once ``interrupt`` was called.
        """
        ...

    def interrupt(self) -> None:
        """End ``home`` within a cycle, from any thread; harmless when nothing is being homed."""
        ...

    def arm(self, start: Array) -> None:
        """OPEN or STOPPED -> ARMED: hold position, without a bump. (6,) m, where the sliders stand."""
        ...

    def feed(self, setpoints: Setpoints) -> int:
        """Buffer the first rows there is credit for; how many. Checks all rows before it takes any."""
        ...

    @property
    def revisable(self) -> int:
        """First tick that ``revise`` may still replace: what is played next, and a small guard.

        The tick ``feed`` expects where nothing that can be replaced is buffered.
        """
        ...

    def revise(self, rows: Setpoints) -> None:
        """Replace everything buffered from ``rows.tick[0]`` on by ``rows``, all of them or none.

        Checked as in ``feed``; the first row continues the one before it. Kind
        ``late-revision`` when that tick is due already, or will be before the far side has
        the rows: plan anew from ``revisable``. ``rows`` of less than the reserve of a stop that
        do not end at rest are an underrun unless more is fed at once.
        """
        ...

    def feedback(self) -> Feedback:
        """What was executed since the last call; may be of no row."""
        ...

    def stop(self) -> None:
        """Come to rest on the path within what was fed, air off. Harmless when nothing moves."""
        ...

    def close(self) -> None:
        """-> CLOSED; what moves is stopped on the path first."""
        ...
