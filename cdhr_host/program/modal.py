"""Modal state of a program as one frozen value, and what its comments tell."""

import math
from dataclasses import dataclass
from typing import Final

from cdhr_host.profile.schema import Bead
from cdhr_host.units import MM, MM3
from cdhr_host.values import Plane

Point = tuple[float, float, float]
Point2 = tuple[float, float]

GRID_DIGITS: Final = 12
"""Positions are kept on a grid of one picometre, so that the rounding left by G91 and G92
cannot become a move."""
CLAY_LEAST: Final = 1e-3 * MM3
"""m³; a step of E below this is the rounding of the file's four or five decimals, not clay: a
travel must not open the air for it. A 5 mm bead has as much in a tenth of a micrometre."""


@dataclass(frozen=True, slots=True)
class Metadata:
    """The latest of what the slicer says in comments; None where it has not said it."""

    flavour: str | None = None
    """G-code dialect the slicer was set to (``;FLAVOR:``)"""
    layers: int | None = None
    """layers announced (``;LAYER_COUNT:``)"""
    feature: str | None = None
    """what is being printed (``;TYPE:``)"""
    width: float | None = None
    """m, of the bead (``;WIDTH:``)"""
    height: float | None = None
    """m, of the layer (``;HEIGHT:``)"""
    z: float | None = None
    """m, of the layer (``;Z:``)"""


@dataclass(frozen=True, slots=True)
class Laying:
    """What is laid where a program does not say how much, and more or less on the first layer."""

    area: float = 0.0
    """m² of the bead's cross-section: a rectangle with half circles at its sides"""
    first_height: float = 0.0
    """m: moves that stay up to this height are of the first layer"""
    first_factor: float = 1.0
    """of the clay, on the first layer"""

    @classmethod
    def of(cls, bead: Bead) -> "Laying":
        """The bead of a profile; where it is higher than wide, an ellipse of the same sides."""
        width, height = bead.width, bead.layer_height
        rounded = (width - height) * height + math.pi / 4 * height**2
        area = rounded if width >= height else math.pi / 4 * width * height
        return cls(area, 1.5 * height, bead.first_layer)

    def share(self, low: float, high: float) -> float:
        """Factor of the clay of a move between two heights, m."""
        return self.first_factor if max(low, high) <= self.first_height else 1.0


@dataclass(frozen=True, slots=True)
class Modal:
    """What a line inherits from the lines before it."""

    position: Point
    """m, the nozzle in G"""
    offset: Point = (0.0, 0.0, 0.0)
    """m, what G92 adds to programmed numbers"""
    e: float = 0.0
    """programmed E, in mm of filament or in mm³"""
    unit: float = MM
    """m in one programmed X, Y, Z, I, J, R, F (G20, G21)"""
    absolute: bool = True
    """X Y Z (G90, G91)"""
    absolute_e: bool = True
    """E (M82, M83)"""
    plane: Plane = Plane.XY
    """of arcs (G17, G18, G19)"""
    onward: Point2 | None = None
    """m, x and y of the first control offset that goes on from the last G5; None after other moves"""
    feed: float | None = None
    """m/s, None before the first F"""
    volumetric: bool = False
    """E counts mm³ (M200, profile)"""
    filament_diameter: float = 1e-3
    """m, what a linear E is of"""
    speed_factor: float = 1.0
    """M220"""
    flow_factor: float = 1.0
    """M221"""
    debt: float = 0.0
    """m³ taken back by negative E and not yet given again"""
    air: float = 0.0
    """Pa held by air words"""
    laying: Laying = Laying()
    open: float = 0.0
    """share of the bead that air words lay, on every move without E"""
    marked: bool = False
    """whether comments say that G1 to G5 without E lay the bead"""
    top: float = -math.inf
    """m, the highest the nozzle was while it laid clay"""
    near: float = math.inf
    """m, the nearest it came to the reference axis while it laid clay"""
    layer: int = 0
    """layers begun"""
    layer_mark: str = ""
    """the comment that marks layers in this program"""
    warned: frozenset[str] = frozenset()
    """warnings already given"""
    ended: bool = False
    """M2 or M30 was read"""
    lines: int = 0
    """lines read"""
    metadata: Metadata = Metadata()

    @property
    def e_unit(self) -> float:
        """mm of filament, or mm³, in one programmed E; in inches as Marlin has it."""
        return (self.unit / MM) ** (3 if self.volumetric else 1)

    @property
    def clay_per_e(self) -> float:
        """m³ of clay in 1 mm of filament, or in 1 mm³."""
        return MM3 if self.volumetric else MM * math.pi / 4 * self.filament_diameter**2

    def bead(self, *, travels: bool) -> float:
        """m³/m that a move without E lays; ``travels`` for G0."""
        share = self.open or float(self.marked and not travels)
        return share * self.laying.area * self.flow_factor

    def flow(self, feed: float) -> float:
        """m³/s of an E that is alone in its line, with F as its rate."""
        return feed / MM * self.clay_per_e * self.speed_factor
