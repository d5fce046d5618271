"""The program a clay is measured with, and the table to fill in."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from cdhr_host.cli.refusals import Refusal, check_file, say, writing
from cdhr_host.extrusion import flow_law
from cdhr_host.extrusion.identify import bead_section
from cdhr_host.samples.clay import LINE_LENGTH, Bead, Push
from cdhr_host.units import KPA, MM, MM3

if TYPE_CHECKING:
    from cdhr_host.profile import Profile

COUNT: Final = 8
CUP: Final = 8e-6
"""m³ of clay wanted in a cup"""
SHORTEST: Final = 10.0
LONGEST: Final = 60.0
"""s of clay into a cup"""
MOST: Final = 0.8
"""greatest pressure over the air's: some is kept for the changes of flow"""
SLOWEST: Final = 2.0 * MM
"""m/s of a line"""


def write_pattern(path: Path, machine: "Profile", by: str, pressures: str | None, options: str) -> None:
    """Write the program and, beside it, the table that wants its measurements."""
    from cdhr_host import samples

    check_file(path, [".gcode"], "--pattern")
    table = path.with_suffix(".csv")
    if table.exists():
        hint = "hint: give the pattern another name"
        raise Refusal(f"cdhr: error: {table} exists and may hold your measurements\n{hint}")
    flows = _flows(machine, pressures)
    if by == "cups":
        pushes = [Push(p, q, float(np.clip(round(CUP / q), SHORTEST, LONGEST))) for p, q in flows]
        lines, rows = samples.cups(pushes, _clay_per_e(machine)), _cup_rows(pushes)
        todo = "weigh every cup"
    else:
        beads = _beads(flows, machine)
        pushes = [Push(p, q, LINE_LENGTH / bead.speed) for (p, q), bead in zip(flows, beads, strict=True)]
        lines, rows = samples.lines(pushes, beads, _clay_per_e(machine)), _line_rows(pushes, beads)
        todo = "measure every line's width in its middle"
    head = f"; cdhr calibrate clay {options} --by {by} --pattern {path.name} : {todo}"
    for target, text in ((path, [head, *lines]), (table, rows)):
        with writing(target):
            target.write_text("\n".join([*text, ""]), encoding="ascii", newline="\n")
    say(f"{path}: print it with cdhr stream {path} {options}, {todo}")
    say(f"{table}: fill in, then cdhr calibrate clay {table} {options}")


def _cup_rows(pushes: Sequence[Push]) -> list[str]:
    rows = [f"{push.pressure / KPA:g},,{push.duration:g}" for push in pushes]
    return ["pressure_kpa,mass_g,time_s", *rows]


def _line_rows(pushes: Sequence[Push], beads: Sequence[Bead]) -> list[str]:
    rows = [
        f"{push.pressure / KPA:g},{bead.speed / MM:g},,{bead.height / MM:g}"
        for push, bead in zip(pushes, beads, strict=True)
    ]
    return ["pressure_kpa,speed_mm_s,width_mm,height_mm", *rows]


def _flows(machine: "Profile", pressures: str | None) -> list[tuple[float, float]]:
    """(Pa, m³/s) of every push: as asked, or from little flow to much, closer where there is little."""
    law = flow_law(machine.extruder, machine.clay)
    if pressures is not None:
        levels = np.array(_asked(pressures, law.threshold, machine.extruder.pressure_max))
    else:
        top = float(law.flow(np.array(MOST * machine.extruder.pressure_max)))
        if not top > 0.0:
            raise Refusal(
                f"cdhr: error: this clay moves above {law.threshold / KPA:.0f} kPa, the pattern goes to "
                f"{MOST * machine.extruder.pressure_max / KPA:.0f} kPa\nhint: name pressures with --pressures"
            )
        top = min(top, _section(machine) * machine.limits.speed_max)
        levels = np.round(law.pressure(top * (np.arange(1, COUNT + 1) / COUNT) ** 2) / KPA, 1) * KPA
    return list(zip(levels.tolist(), law.flow(levels).tolist(), strict=True))


def _asked(pressures: str, threshold: float, most: float) -> list[float]:
    """Pa from what was typed; refused where nothing would flow or the air ends."""
    try:
        levels = [float(each) * KPA for each in pressures.split(",")]
    except ValueError:
        raise Refusal(f"cdhr: error: --pressures {pressures}: numbers in kPa, parted by commas") from None
    for level in levels:
        if not threshold < level <= most:
            raise Refusal(
                f"cdhr: error: --pressures {level / KPA:g}: the clay of the profile moves above "
                f"{threshold / KPA:.4g} kPa, the air gives {most / KPA:.4g} kPa\n"
                "hint: name a softer clay with --material to weigh lower pressures"
            )
    return levels


def _section(machine: "Profile") -> float:
    """m² of a line as it should come out: 1.2 nozzles wide, half a nozzle high."""
    bore = machine.extruder.nozzle_diameter
    return float(bead_section(np.array(1.2 * bore), np.array(0.5 * bore)))


def _beads(flows: Sequence[tuple[float, float]], machine: "Profile") -> list[Bead]:
    """Lines whose speed fits the flow that is thought to come."""
    bore, top = machine.extruder.nozzle_diameter, machine.limits.speed_max
    speeds = [min(max(flow / _section(machine), SLOWEST), top) for _, flow in flows]
    return [Bead(0.5 * bore, round(speed / MM, 1) * MM, 3.0 * bore) for speed in speeds]


def _clay_per_e(machine: "Profile") -> float:
    """m³ of clay for one E of the profile."""
    extruder = machine.extruder
    return MM3 if extruder.e_unit == "mm3" else float(np.pi * extruder.filament_diameter**2 / 4.0 * MM)
