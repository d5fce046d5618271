"""Programs that show a clay's flow: cups to weigh, lines to measure, steps over a scale.

E pushes the flow that the profile's clay is thought to have at that pressure. What comes is what
is measured; only the pressure has to be right, and it is.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cdhr_host.samples.ring import CLEARANCE, TRAVEL_SPEED
from cdhr_host.samples.words import words
from cdhr_host.units import KPA, MINUTE, MM, MM3, MS

CUP_HEIGHT = 100 * MM
"""room under the nozzle for a cup"""
LINE_LENGTH = 120 * MM


@dataclass(frozen=True, slots=True)
class Push:
    """One pressure, SI."""

    pressure: float
    """Pa"""
    flow: float
    """m³/s that the profile's clay has at it"""
    duration: float
    """s"""


@dataclass(frozen=True, slots=True)
class Bead:
    """What a line is drawn with, SI."""

    height: float
    """m of the nozzle above the bed"""
    speed: float
    """m/s"""
    spacing: float
    """m from line to line"""


def cups(pushes: Sequence[Push], clay_per_e: float) -> Iterator[str]:
    """A pause for every cup, then clay; ``clay_per_e`` is m³ for one E."""
    yield from _head()
    yield f"G0 {words(Z=CUP_HEIGHT / MM, F=TRAVEL_SPEED / MM * MINUTE)}"
    for number, push in enumerate(pushes, 1):
        volume = push.flow * push.duration / clay_per_e
        yield f"M0 cup {number} of {len(pushes)}: {push.pressure / KPA:g} kPa for {push.duration:g} s"
        yield "G92 E0"
        push_at_rest = words(E=volume, F=push.flow / clay_per_e * MINUTE)
        yield f"G1 {push_at_rest} ; {push.flow / MM3:.1f} mm3/s expected"
    yield "M0 weigh the last cup"
    yield from _tail(CUP_HEIGHT)


def lines(pushes: Sequence[Push], beads: Sequence[Bead], clay_per_e: float) -> Iterator[str]:
    """Straight lines along x, from the front to the back, each at its pressure and speed."""
    yield from _head()
    clear, travel = CLEARANCE / MM, TRAVEL_SPEED / MM * MINUTE
    half, y = LINE_LENGTH / 2 / MM, -sum(bead.spacing for bead in beads) / 2 / MM
    yield f"G0 {words(Z=clear, F=travel)}"
    for number, (push, bead) in enumerate(zip(pushes, beads, strict=True), 1):
        yield f"M117 line {number}: {push.pressure / KPA:g} kPa, {bead.speed / MM:g} mm/s"
        yield f"G0 {words(X=-half, Y=y)}"
        yield f"G0 {words(Z=bead.height / MM)}"
        yield "G92 E0"
        feed, volume = bead.speed / MM * MINUTE, push.flow * push.duration / clay_per_e
        yield f"G1 {words(X=half, E=volume, F=feed)}"
        yield f"G0 {words(Z=clear, F=travel)}"
        y += bead.spacing / MM
    yield from _tail(CLEARANCE)


def steps(pushes: Sequence[Push], repeats: int, rest: float, clay_per_e: float) -> Iterator[str]:
    """Clay and ``rest`` s of none in turns, every pressure ``repeats`` times, over a scale."""
    yield from _head()
    yield f"G0 {words(Z=CUP_HEIGHT / MM, F=TRAVEL_SPEED / MM * MINUTE)}"
    yield "M0 tare the scale and have it write"
    for _ in range(repeats):
        for push in pushes:
            yield f"G4 P{rest / MS:g}"
            yield "G92 E0"
            volume, rate = push.flow * push.duration / clay_per_e, push.flow / clay_per_e * MINUTE
            yield f"G1 {words(E=volume, F=rate)} ; {push.pressure / KPA:g} kPa"
    yield f"G4 P{2.0 * rest / MS:g}"
    yield from _tail(CUP_HEIGHT)


def _head() -> Iterator[str]:
    yield from ("G21 ; millimetres", "G90 ; absolute", "M82 ; absolute E", "G92 E0")


def _tail(height: float) -> Iterator[str]:
    yield f"G0 {words(Z=height / MM, F=TRAVEL_SPEED / MM * MINUTE)}"
    yield "G28 ; back to the reference, above the clay"
    yield "M84 ; cables stay taut"
