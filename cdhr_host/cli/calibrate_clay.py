"""``cdhr calibrate clay``: cups on a scale, or lines under a calliper, to a material profile."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cdhr_host.cli.machine import open_machine
from cdhr_host.cli.options import Json, MaterialName, ProfileName, examples
from cdhr_host.cli.refusals import Refusal, about, check_file, check_picture, emit, say, writing

if TYPE_CHECKING:
    from cdhr_host.cli.measurements import Table
    from cdhr_host.extrusion.identify import Weighings
    from cdhr_host.extrusion.identify_delays import StepRecord
    from cdhr_host.profile import Clay, Profile
    from cdhr_host.report.clay_fit import ClayFit

EXAMPLES = examples(
    "cdhr calibrate clay --pattern cups.gcode",
    "cdhr calibrate clay cups.csv",
    "cdhr calibrate clay cups.csv --plot fit.png --write my-stoneware",
    "cdhr calibrate clay --pattern lines.gcode --by lines --pressures 70,90,110,130",
    "cdhr calibrate clay cups.csv steps.csv --write ./my-stoneware.toml --force",
    more="Tables: pressure_kpa,mass_g,time_s (weighings); pressure_kpa,speed_mm_s,width_mm,height_mm "
    "(lines); t_s,pressure_kpa,mass_g (a scale while the air steps).",
)


def clay(
    tables: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[CSV]...", help="Measurements; the column names say of what kind."),
    ] = None,
    *,
    profile: ProfileName = "paper",
    material: MaterialName = None,
    density: Annotated[
        float | None,
        typer.Option(
            metavar="KG_M3", help="Of the wet clay; the profile's when left out.", min=500, max=5000
        ),
    ] = None,
    plot: Annotated[Path | None, typer.Option(metavar="PNG", help="Draw fit and residuals.")] = None,
    write: Annotated[
        str | None,
        typer.Option(metavar="M", help="Keep the clay: a name for an installed material, or a .toml path."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a material of that name.")] = False,
    pattern: Annotated[
        Path | None, typer.Option(metavar="GCODE", help="Write a program to measure from, and its table.")
    ] = None,
    by: Annotated[
        Literal["cups", "lines", "steps"],
        typer.Option(help="What the pattern is for: cups on a scale, lines, or steps over a scale."),
    ] = "cups",
    pressures: Annotated[
        str | None, typer.Option(metavar="KPA,KPA,...", help="Pressures of the pattern; eight when left out.")
    ] = None,
    json_: Json = False,
) -> None:
    """Fit yield stress, consistency, index, dead times and lag of a clay to what was measured."""
    machine = open_machine(profile, material)
    if (pattern is None) == (not tables):
        raise Refusal(
            "cdhr: error: give measurements, or --pattern for a program to make them with\n"
            "hint: cdhr calibrate clay --pattern cups.gcode"
        )
    if pattern is not None:
        from cdhr_host.cli.clay_pattern import write_pattern

        options = f"--profile {profile}" + (f" --material {material}" if material else "")
        write_pattern(pattern, machine, by, pressures, options)
        return
    target = _target(write, force)
    check_picture(plot, "--plot")
    names = ", ".join(str(path) for path in tables or ())
    found = _fitted(machine, tables or [], density)
    if plot is not None:
        _draw(found, names, plot)
    if target is not None:
        _keep(found, names, target)
    _tell(found, names, target, json_)


def _fitted(machine: "Profile", paths: Sequence[Path], density: float | None) -> "ClayFit":
    """Flow curve from weighings and lines, then delays from steps."""
    from cdhr_host.cli.measurements import read_measurements
    from cdhr_host.extrusion import bores, flow_law
    from cdhr_host.extrusion.identify import identify_flow
    from cdhr_host.extrusion.identify_delays import identify_delays
    from cdhr_host.report.clay_fit import ClayFit, fitted_clay

    tables = []
    for path in paths:
        with about(str(path)):
            tables.append(read_measurements(path))
    flows = [table for table in tables if table.kind != "steps"]
    steps = [table for table in tables if table.kind == "steps"]
    if len(steps) > 1:
        raise Refusal("cdhr: error: one table of steps at a time\nhint: record all of them in one go")
    clay = machine.clay if density is None else machine.clay.model_copy(update={"density": density})
    curve = delays = None
    if flows:
        with about(", ".join(str(table.path) for table in flows)):
            curve = identify_flow(_weighings(flows, clay.density), bores(machine.extruder))
    law = curve.law if curve else flow_law(machine.extruder, clay)
    for table in steps:
        with about(str(table.path)):
            record = _step_record(table)
            delays = identify_delays(record, law, clay.density, machine.drives.regulator_lag)
    found = machine.model_copy(update={"clay": fitted_clay(clay, curve, delays)})
    return ClayFit(found, law, curve, delays)


def _weighings(tables: "Sequence[Table]", density: float) -> "Weighings":
    """Flows of all tables together."""
    import numpy as np

    from cdhr_host.extrusion.identify import Weighings, bead_section

    pressure, flow = [], []
    for table in tables:
        column = table.columns
        pressure.append(column["pressure_kpa"])
        if table.kind == "weighings":
            flow.append(column["mass_g"] / column.get("density_kg_m3", density) / column["time_s"])
        else:
            flow.append(bead_section(column["width_mm"], column["height_mm"]) * column["speed_mm_s"])
    return Weighings(np.concatenate(pressure), np.concatenate(flow))


def _step_record(table: "Table") -> "StepRecord":
    """The table as a record; raises ProfileError where time runs back."""
    import numpy as np

    from cdhr_host.errors import Problem, ProfileError
    from cdhr_host.extrusion.identify_delays import StepRecord

    t = table.columns["t_s"]
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if len(back):
        row = int(back[0])
        raise ProfileError(
            Problem("range", f"t_s = {t[row + 1]:g} comes after {t[row]:g}", hint="sort the rows by time")
        )
    return StepRecord(t, table.columns["pressure_kpa"], table.columns["mass_g"])


def _target(write: str | None, force: bool) -> Path | None:
    """Where the material goes; refused before any work if it could not."""
    if write is None:
        return None
    from cdhr_host.profile import material_folder

    named = "/" not in write and not write.endswith(".toml")
    path = material_folder() / f"{write}.toml" if named else Path(write)
    if path.exists() and not force:
        raise Refusal(f"cdhr: error: {path} exists\nhint: --force replaces it, another name keeps both")
    check_file(path, [".toml"], "--write")
    return path


def _keep(found: "ClayFit", names: str, target: Path) -> None:
    """Write the material profile."""
    from cdhr_host.cli.profiles import toml_lines
    from cdhr_host.profile import MaterialFile
    from cdhr_host.report.files import put

    told = {"name": target.stem, "source": f"cdhr calibrate clay {names}"[:400], "example": False}
    clay: Clay = found.machine.clay.model_copy(update=told)
    doubts = [f"# 95 %: {key} ± {half:.2g}" for key, _, _, half in found.estimates()]
    text = "\n".join([f"# Measured: {names}", *doubts, *toml_lines(MaterialFile.model_construct(clay=clay))])
    with writing(target), put(target) as part:
        part.write_text(text, encoding="utf-8")


def _draw(found: "ClayFit", names: str, plot: Path) -> None:
    from cdhr_host.report.clay_fit import draw
    from cdhr_host.report.files import put

    with writing(plot), put(plot) as part:
        draw(found, names, part)


def _tell(found: "ClayFit", names: str, target: Path | None, json_: bool) -> None:
    """The result, what is doubtful, and what to do next."""
    from cdhr_host.report.clay_fit import fit_lines, fit_record

    if json_:
        emit(json.dumps({"files": names, **fit_record(found), "written": str(target) if target else None}))
        return
    emit("\n".join([f"{names}: the clay, with 95 % intervals", *fit_lines(found)]))
    for line in _advice(found, target):
        say(line)


def _advice(found: "ClayFit", target: Path | None) -> Iterator[str]:
    for doubt in found.doubts:
        yield f"doubt: {doubt.message}"
        yield f"hint: {doubt.hint}"
    if target is None:
        yield "hint: keep this clay with --write NAME, then print with --material NAME"
    else:
        yield f"{target}: written; print with --material {target.stem if _installed(target) else target}"


def _installed(target: Path) -> bool:
    from cdhr_host.profile import material_folder

    return target.parent == material_folder()
