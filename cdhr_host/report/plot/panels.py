"""Which curves stand together, with their windows: rows of panels for each picture over time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from cdhr_host.report.plot.passing import Drawn
from cdhr_host.units import MM

LOWER, UPPER = range(1, 4), range(4, 7)


@dataclass(frozen=True, slots=True)
class Curve:
    """One column of the log, or of what is derived from it."""

    column: str
    label: str
    dashed: bool = False


@dataclass(frozen=True, slots=True)
class Panel:
    """Curves of one unit."""

    title: str
    unit: str
    curves: tuple[Curve, ...]
    window: tuple[float, float] | None = None
    """in the unit; None where there is none, or the machine is not known"""

    def of(self, drawn: Drawn) -> "Panel":
        """The curves that a log has."""
        there = tuple(curve for curve in self.curves if curve.column in drawn)
        return Panel(self.title, self.unit, there, self.window)


Rows = list[list[Panel]]


def slider_panels(drawn: Drawn) -> Rows:
    """Position, speed, acceleration and jerk of the lower and the upper three."""
    limits = None if drawn.profile is None else drawn.profile.sliders
    most = [None] * 3 if limits is None else [limits.speed_max, limits.acceleration_max, limits.jerk_max]
    kinds = (
        ("position", "mm", "mm", None),
        ("speed", "mm/s", "speed_mm_s", most[0]),
        ("acceleration", "mm/s²", "acceleration_mm_s2", most[1]),
        ("jerk", "mm/s³", "jerk_mm_s3", most[2]),
    )
    return [
        [
            Panel(
                f"{kind}, sliders {group[0]} to {group[-1]}",
                unit,
                tuple(Curve(f"slider{i}_{column}", f"{i}") for i in group),
                None if limit is None else (-limit / MM, limit / MM),
            )
            for group in (LOWER, UPPER)
        ]
        for kind, unit, column, limit in kinds
    ]


def force_panels(drawn: Drawn) -> Rows:
    """Pairs, their single cables, the upper cables, each against its window."""
    windows: list[tuple[float, float] | None] = [None] * 3
    if drawn.profile is not None:
        forces = drawn.profile.forces
        pairs, upper = (forces.lower_min, forces.lower_max), (forces.upper_min, forces.upper_max)
        windows = [pairs, (forces.single_min, forces.single_max), upper]
    six = [tuple(Curve(f"tension{i}_n", f"{i}") for i in group) for group in (LOWER, UPPER)]
    sides = (("left", False), ("right", True))
    nine = tuple(
        Curve(f"tension{i}_{side}_n", f"{i} {side}", dashed) for i in LOWER for side, dashed in sides
    )
    return [
        [Panel("pairs of cables 1 to 3", "N", six[0], windows[0])],
        [Panel("their single cables", "N", nine, windows[1])],
        [Panel("cables 4 to 6", "N", six[1], windows[2])],
    ]


def air_panels(drawn: Drawn) -> Rows:
    """Clay wanted and deposited, pressure commanded and measured."""
    supply = None if drawn.profile is None else (0.0, drawn.profile.extruder.pressure_max / 1e3)
    flow = Curve("flow_mm3_s", "wanted"), Curve("deposited_mm3_s", "deposited")
    pressure = Curve("pressure_kpa", "commanded"), Curve("pressure_actual_kpa", "measured")
    return [[Panel("clay", "mm³/s", flow)], [Panel("air pressure, gauge", "kPa", pressure, supply)]]


def following_panels(drawn: Drawn) -> Rows:
    """What came back: errors of the sliders, torques, pressure away from its command."""
    drives = None if drawn.profile is None else drawn.profile.drives
    error = None if drives is None else drives.following_error_max / MM
    torque = None if drives is None else drives.torque_max
    window = None if error is None else (-error, error)
    errors = [tuple(Curve(f"slider{i}_error_mm", f"{i}") for i in group) for group in (LOWER, UPPER)]
    torques = tuple(Curve(f"torque{i}_nm", f"{i}") for i in range(1, 7))
    away = (Curve("pressure_deviation_kpa", "measured − commanded"),)
    return [
        [Panel("following error, sliders 1 to 3", "mm", errors[0], window)],
        [Panel("following error, sliders 4 to 6", "mm", errors[1], window)],
        [Panel("motor torque", "N m", torques, None if torque is None else (-torque, torque))],
        [Panel("pressure away from its command", "kPa", away)],
    ]


PICTURES: Final[dict[str, tuple[str, Callable[[Drawn], Rows]]]] = {
    "sliders": ("Sliders", slider_panels),
    "forces": ("Cable forces", force_panels),
    "air": ("Clay and air", air_panels),
    "following": ("Following", following_panels),
}
"""of what stands over time: name -> title, panels"""


def panels_of(drawn: Drawn, name: str) -> Rows:
    """Rows of panels that have anything to show; none for a log that knows nothing of it."""
    rows: Sequence[Sequence[Panel]] = PICTURES[name][1](drawn)
    present = [[panel.of(drawn) for panel in row] for row in rows]
    return [row for row in present if any(panel.curves for panel in row)]
