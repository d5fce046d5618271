"""The paper's double-layer ring: a closed circle of one bead, laid twice."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import pi

from cdhr_host.samples.words import words
from cdhr_host.units import MINUTE, MM, MM3

CLEARANCE = 10 * MM
"""how far above the clay the nozzle travels"""
TRAVEL_SPEED = 50 * MM
"""m/s without clay"""


@dataclass(frozen=True, slots=True)
class Ring:
    """A ring to print, SI."""

    diameter: float
    """m, of the bead's centre line"""
    layers: int
    bead: float
    """m, width of the bead"""
    layer_height: float
    """m"""
    speed: float
    """m/s while clay flows"""

    @property
    def section(self) -> float:
        """m² of clay across a bead: a rectangle with round flanks, as slicers reckon it."""
        return (self.bead - self.layer_height) * self.layer_height + pi * self.layer_height**2 / 4


def _circle(radius: float, e: float, speed: float) -> Iterator[str]:
    """Four quarter arcs, counter-clockwise from (radius, 0); mm, mm³ of E in all, mm/min."""
    corners = [(radius, 0.0), (0.0, radius), (-radius, 0.0), (0.0, -radius), (radius, 0.0)]
    for quarter, ((x, y), (to_x, to_y)) in enumerate(pairwise(corners), 1):
        yield f"G3 {words(X=to_x, Y=to_y, I=-x, J=-y, E=e * quarter / 4, F=speed)}"


def ring(shape: Ring) -> Iterator[str]:
    """Lines of the program. E counts mm³, which is mm of a filament of 1.1284 mm."""
    radius, height, clear = shape.diameter / 2 / MM, shape.layer_height / MM, CLEARANCE / MM
    volume = shape.section * pi * shape.diameter / MM3
    travel = TRAVEL_SPEED / MM * MINUTE
    yield f"; bead {shape.bead / MM:g} x {height:g} mm, {volume:.1f} mm3 of clay a layer"
    yield "; E in mm3, which is mm of a filament of 1.1284 mm"
    yield "G21 ; millimetres"
    yield "G90 ; absolute"
    yield "M82 ; absolute E"
    yield "G92 E0"
    yield f"G0 {words(Z=clear, F=travel)}"
    yield f"G0 {words(X=radius, Y=0)}"
    for layer in range(shape.layers):
        yield f";LAYER:{layer}"
        yield f"G0 {words(Z=(layer + 1) * height, F=travel)}"
        yield "G92 E0"
        yield from _circle(radius, volume, shape.speed / MM * MINUTE)
    yield f"G0 {words(Z=shape.layers * height + clear, F=travel)}"
    yield "G28 ; back to the reference, above the clay"
    yield "M84 ; cables stay taut"
