"""What every controller is given and gives: one protocol for forces and for positions."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol, TypeVar

from cdhr_host.control.pose import PoseSample
from cdhr_host.values import Array


class Mode(Enum):
    """What a controller is doing; every change of it comes with a notice."""

    CLOSED = "closed loop"
    OPEN = "open loop"
    """no measurement: what was corrected so far is held"""
    STOP = "stop"
    """the error left its bounds: come to rest on the path"""


@dataclass(frozen=True, slots=True)
class Plan:
    """Where the platforms should be now; displacements from the reference pose."""

    t: float
    """s since the program's start"""
    position: Array
    """(6,) m: x, y, z of the lower platform, then of the upper one"""
    velocity: Array
    """(6,) m/s"""
    acceleration: Array
    """(6,) m/s²"""


@dataclass(frozen=True, slots=True)
class Seen:
    """What is measured now."""

    position: Array
    """(6,) m, from the slider encoders by forward kinematics"""
    velocity: Array
    """(6,) m/s, same"""
    tension: Array | None = None
    """(6,) N, from the force sensors"""
    nozzle: PoseSample | None = None
    """newest pose of the lower platform from outside"""


@dataclass(frozen=True, slots=True)
class Action:
    """What to do until the next step: forces, or shifted positions, never both."""

    mode: Mode
    tension: Array | None = None
    """(6,) N to command"""
    shift: Array | None = None
    """(6,) m to add to the planned positions before they become sliders"""
    notice: str = ""
    """said when the mode changes, empty otherwise"""


S = TypeVar("S")


class Controller(Protocol[S]):
    """Pure and stepwise: all memory is in the state."""

    def start(self) -> S:
        """The state before the first step."""
        ...

    def step(self, state: S, plan: Plan, seen: Seen, dt: float) -> tuple[S, Action]:
        """The state after ``dt`` s, and what to do meanwhile."""
        ...
