"""What is carried down the staircase: frozen values, arrays read-only, SI units.

Positions end in the letter of their frame: ``_G`` program coordinates, fixed to the
machine (no G92 offset left), ``_W`` machine world (origin at the centre of the lower
pulleys, z up). Index letters: ``n`` sample or move, ``i`` cable.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


def _freeze(value: Any) -> None:
    """Make every array of a dataclass read-only."""
    for each in fields(value):
        item = getattr(value, each.name)
        if isinstance(item, np.ndarray):
            item.flags.writeable = False


@dataclass(frozen=True, slots=True)
class _Frozen:
    """Base of values that hold arrays."""

    def __post_init__(self) -> None:
        _freeze(self)


@dataclass(frozen=True, slots=True)
class Moves(_Frozen):
    """N straight moves in program order, from ``start_G`` through each row of ``end_G``.

    Commands have absolute positions and no modal state left in them.
    """

    line: Ints
    """(N,) source line of each move"""
    start_G: Array
    """(3,) m, where the first move begins"""
    end_G: Array
    """(N, 3) m, where each move ends"""
    speed: Array
    """(N,) m/s, the programmed nozzle speed"""
    clay: Array
    """(N,) m³ laid along each move; 0 on travel"""
    air: Array
    """(N,) Pa held by air words along each move, whatever the speed; 0 where E rules"""


class Plane(Enum):
    """A plane of arcs: its two axes, then its normal, right-handed (x, y, z are 0, 1, 2)."""

    XY = (0, 1, 2)
    """G17"""
    ZX = (2, 0, 1)
    """G18"""
    YZ = (1, 2, 0)
    """G19"""


@dataclass(frozen=True, slots=True)
class Arc(_Frozen):
    """One circular or helical move (G2, G3)."""

    line: int
    start_G: Array
    """(3,) m"""
    end_G: Array
    """(3,) m"""
    centre_G: Array
    """(2,) m, the axis on the plane's two axes in their order: x y, z x or y z"""
    sweep: float
    """rad, signed: positive is counter-clockwise (G3), seen from the normal's positive end"""
    speed: float
    """m/s along the helix"""
    clay: float
    """m³ laid along the arc"""
    air: float
    """Pa held by air words; 0 where E rules"""
    plane: Plane = Plane.XY


@dataclass(frozen=True, slots=True)
class Spline(_Frozen):
    """One cubic Bézier move (G5, and G5.1 raised to a cubic)."""

    line: int
    control_G: Array
    """(4, 3) m: start, two control points, end"""
    speed: float
    """m/s along the curve"""
    clay: float
    """m³ laid along the curve, evenly by its length"""
    air: float
    """Pa held by air words; 0 where E rules"""


@dataclass(frozen=True, slots=True)
class Blend:
    """How corners are taken from here on (G61, G64)."""

    line: int
    tolerance: float | None
    """m, greatest deviation from the drawn path; None for the profile's"""
    exact: bool
    """the end of every move is an exact stop"""


@dataclass(frozen=True, slots=True)
class Dwell:
    """Stand still (G4): an exact stop, air off."""

    line: int
    duration: float
    """s"""


@dataclass(frozen=True, slots=True)
class Prime:
    """Push clay while standing still (a G1 with E alone)."""

    line: int
    clay: float
    """m³, positive"""
    flow: float
    """m³/s, positive"""


@dataclass(frozen=True, slots=True)
class Pause:
    """Stand still until the operator goes on (M0, M1): an exact stop, air off."""

    line: int
    message: str


@dataclass(frozen=True, slots=True)
class Stop:
    """Come to rest before going on (M400, G28, M84, end): an exact stop, nothing else."""

    line: int


@dataclass(frozen=True, slots=True)
class Notice:
    """Something to tell the operator: a display text, a warning, a new layer."""

    line: int
    kind: str
    """``"layer"``, ``"display"``, ``"warning"`` or ``"progress"``"""
    text: str


Command = Moves | Arc | Spline | Blend | Dwell | Prime | Pause | Stop | Notice


@dataclass(frozen=True, slots=True)
class ToolTrack(_Frozen):
    """The nozzle over time: N samples on the drives' ticks."""

    tick: Ints
    """(N,) consecutive ticks since the program's start"""
    line: Ints
    """(N,) line being executed"""
    position_G: Array
    """(N, 3) m"""
    velocity: Array
    """(N, 3) m/s"""
    acceleration: Array
    """(N, 3) m/s²"""
    flow: Array
    """(N,) m³/s"""
    air: Array
    """(N,) Pa held by air words; 0 where flow rules"""

    def __getitem__(self, rows: slice | Flags) -> "ToolTrack":
        return ToolTrack(*(getattr(self, field.name)[rows] for field in fields(self)))

    @classmethod
    def joined(cls, parts: "Sequence[ToolTrack]") -> "ToolTrack":
        """One after the other."""
        columns = ([getattr(part, field.name) for part in parts] for field in fields(cls))
        return cls(*(np.concatenate(column) for column in columns))


@dataclass(frozen=True, slots=True)
class CableState(_Frozen):
    """The six equivalent cables over time: 1-3 carry the lower platform, 4-6 the upper."""

    length: Array
    """(N, 6) m"""
    rate: Array
    """(N, 6) m/s"""
    acceleration: Array
    """(N, 6) m/s²"""
    tension: Array
    """(N, 6) N"""


@dataclass(frozen=True, slots=True)
class Setpoints(_Frozen):
    """What the drives get: N consecutive ticks, and one row of the log for each."""

    tick: Ints
    """(N,) consecutive ticks since the program's start"""
    t: Array
    """(N,) s since the program's start, tick times the period"""
    line: Ints
    """(N,) G-code line being executed"""
    nozzle_G: Array
    """(N, 3) m, displacement of the lower (nozzle) platform"""
    upper: Array
    """(N, 3) m, displacement of the upper platform from its reference"""
    slider: Array
    """(N, 6) m, cable length minus its length at the reference pose; positive is paid out"""
    tension: Array
    """(N, 6) N, planned cable forces"""
    flow: Array
    """(N,) m³/s of clay"""
    pressure: Array
    """(N,) Pa, gauge"""

    def __len__(self) -> int:
        return len(self.tick)

    def __getitem__(self, rows: slice | Flags | Ints) -> "Setpoints":
        return Setpoints(*(getattr(self, field.name)[rows] for field in fields(self)))


@dataclass(frozen=True, slots=True)
class Feedback(_Frozen):
    """What came back from the drives: N executed ticks."""

    tick: Ints
    """(N,) tick that was executed"""
    setpoint: Array
    """(N, 6) m, slider setpoint as the far side received it"""
    slider: Array
    """(N, 6) m, measured slider position"""
    counts: Ints
    """(N, 6) encoder counts"""
    torque: Array
    """(N, 6) N m at the motor"""
    pressure: Array
    """(N,) Pa, measured"""
    force: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(N, 3) N, measured forces of cables 1-3; (0, 3) where there are no sensors"""
    deposited: Array = field(default_factory=lambda: np.zeros(0))
    """(N,) m³/s of clay that left the nozzle, simulated; (0,) where nobody can know"""

    def __len__(self) -> int:
        return len(self.tick)

    def __getitem__(self, rows: slice | Flags | Ints) -> "Feedback":
        columns = (getattr(self, field.name) for field in fields(self))
        return Feedback(*(column[rows] if len(column) else column for column in columns))
