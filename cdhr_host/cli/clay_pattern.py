"""The program a clay is measured with, and the table to fill in."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from cdhr_host import samples
from cdhr_host.cli.refusals import Refusal, check_file, say, writing
from cdhr_host.extrusion import flow_law
from cdhr_host.extrusion.identify import bead_section
from cdhr_host.extrusion.model import is_led
from cdhr_host.samples.clay import LINE_LENGTH, Bead, Push
from cdhr_host.units import KPA, MM, MM3
from cdhr_host.values import Array

if TYPE_CHECKING:
    from cdhr_host.profile import Profile

CUP: Final = 8e-6
"""m³ of clay wanted in a cup"""
SHORTEST: Final = 10.0
LONGEST: Final = 60.0
"""s of clay into a cup"""
MOST: Final = 0.8
"""greatest pressure over the air's: some is kept for the changes of flow"""
SLOWEST: Final = 2.0 * MM
"""m/s of a line"""
SPREAD: Final = (np.arange(1, 9) / 8) ** 2
STEPS_SPREAD: Final = np.array([0.04, 0.25, 1.0])
"""flows of the pressures, over the greatest"""
STEP: Final = 2.0
REST: Final = 1.0
"""s with the air open and shut"""
REPEATS: Final = 4

Pattern = tuple[Iterator[str], list[str], str]
"""lines of the program, rows of the table, what to do"""


def write_pattern(path: Path, machine: "Profile", by: str, pressures: str | None, options: str) -> None:
    """Write the program and, beside it, the table that wants its measurements."""
    check_file(path, [".gcode"], "--pattern")
    table = path.with_suffix(".csv")
    if table.exists():
        hint = "hint: give the pattern another name"
        raise Refusal(f"cdhr: error: {table} exists and may hold your measurements\n{hint}")
    lines, rows, todo = {"cups": _cups, "lines": _lines, "steps": _steps}[by](machine, pressures)
    head = f"; cdhr calibrate clay {options} --by {by} --pattern {path.name} : {todo}"
    for target, text in ((path, [head, *lines]), (table, rows)):
        with writing(target):
            target.write_text("\n".join([*text, ""]), encoding="ascii", newline="\n")
    log = f" --log {path.stem}.run.csv" if by == "steps" else ""
    say(f"{path}: print it with cdhr stream {path} {options}{log}, {todo}")
    say(f"{table}: fill in, then cdhr calibrate clay {table} {options}")


def _cups(machine: "Profile", pressures: str | None) -> Pattern:
    flows = _flows(machine, pressures, SPREAD)
    pushes = [Push(p, q, float(np.clip(round(CUP / q), SHORTEST, LONGEST))) for p, q in flows]
    rows = [f"{push.pressure / KPA:g},,{push.duration:g}" for push in pushes]
    lines = samples.cups(pushes, _clay_per_e(machine))
    return lines, ["pressure_kpa,mass_g,time_s", *rows], "weigh every cup"


def _lines(machine: "Profile", pressures: str | None) -> Pattern:
    flows = _flows(machine, pressures, SPREAD)
    beads = _beads(flows, machine)
    pushes = [Push(p, q, LINE_LENGTH / bead.speed) for (p, q), bead in zip(flows, beads, strict=True)]
    rows = [
        f"{push.pressure / KPA:g},{bead.speed / MM:g},,{bead.height / MM:g}"
        for push, bead in zip(pushes, beads, strict=True)
    ]
    lines = samples.lines(pushes, beads, _clay_per_e(machine))
    head = "pressure_kpa,speed_mm_s,width_mm,height_mm"
    return lines, [head, *rows], "measure every line's width in its middle"


def _steps(machine: "Profile", pressures: str | None) -> Pattern:
    if is_led(machine):
        raise Refusal(
            "cdhr: error: the air of this profile is led, its pressure does not step\n"
            'hint: write lead = "off" into [extruder] of a copy (cdhr profile show NAME > copy.toml)'
        )
    pushes = [Push(p, q, STEP) for p, q in _flows(machine, pressures, STEPS_SPREAD)]
    lines = samples.steps(pushes, REPEATS, REST, _clay_per_e(machine))
    return lines, ["t_s,pressure_kpa,mass_g"], "a scale writing what it reads"


def _flows(machine: "Profile", pressures: str | None, spread: Array) -> list[tuple[float, float]]:
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
        levels = np.round(law.pressure(top * spread) / KPA, 1) * KPA
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
