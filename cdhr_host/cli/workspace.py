"""``cdhr workspace``: where the machine can print, and where a program sits inside."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdhr_host.cli.machine import open_machine
from cdhr_host.cli.options import Json, ProfileName, examples
from cdhr_host.cli.progress import Progress
from cdhr_host.cli.refusals import Refusal, about, check_picture, emit, writing
from cdhr_host.cli.source import Source
from cdhr_host.units import MM

if TYPE_CHECKING:
    from cdhr_host.mechanism import Workspace
    from cdhr_host.mechanism.margin_map import MarginMap
    from cdhr_host.report.space.sited import Sited
    from cdhr_host.report.workspace import Reach

EXAMPLES = examples(
    "cdhr workspace",
    "cdhr workspace --profile paper-wide --acceleration 500",
    "cdhr workspace --profile paper-wide --figure radius.png --map margins.png",
    "cdhr workspace --profile paper --file gcode/cura_ring.gcode --map ring.png",
)


def workspace(
    *,
    profile: ProfileName = "paper",
    acceleration: Annotated[
        float, typer.Option(metavar="MM_S2", help="Acceleration to keep in hand, in mm/s².", min=0)
    ] = 0.0,
    file: Annotated[
        str | None,
        typer.Option("--file", "-f", metavar="GCODE", help="Say where this program sits, and where best."),
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw radius by height: .png, .svg or .pdf.")
    ] = None,
    map_: Annotated[
        Path | None, typer.Option("--map", metavar="FILE", help="Draw the volume, its slices and margins.")
    ] = None,
    json_: Json = False,
) -> None:
    """Feasible volume and margins; printable radius for each spring policy; the best place for a program."""
    _check(figure, map_)
    source = None if file is None else Source(file)
    machine = open_machine(profile)
    with about(profile), Progress("mapping") as progress:
        from cdhr_host.mechanism import Workspace
        from cdhr_host.mechanism.margin_map import margin_map
        from cdhr_host.report.workspace import reach

        space = Workspace.from_profile(machine)
        chart = margin_map(space, acceleration * MM, lambda share: progress.show(share, "margins"))
        found = reach(machine, acceleration * MM)
    part = None if source is None else _part(source, space, chart, acceleration * MM)
    _draw((figure, map_), found, (chart, space, part), _title(machine.machine.name, source, acceleration))
    name = None if source is None else source.name
    if json_:
        emit(json.dumps(_record(found, (chart, space, part), (profile, name), acceleration)))
    else:
        emit("\n".join(_lines(found, (chart, space, part), (profile, name))))


Mapped = tuple["MarginMap", "Workspace", "Sited | None"]


def _check(figure: Path | None, map_: Path | None) -> None:
    """Refuse pictures that could not be drawn, before any work."""
    check_picture(figure, "--figure")
    check_picture(map_, "--map")


def _part(source: Source, space: "Workspace", chart: "MarginMap", acceleration: float) -> "Sited":
    """Walk the program for its places, and look for better ones."""
    from cdhr_host.pipeline import prove
    from cdhr_host.report.space.footprint import Footprint
    from cdhr_host.report.space.sited import sited

    footprint = Footprint()
    with Progress("reading") as progress, about(source.name):

        def watch(checked: Any) -> None:
            footprint.watch(checked)
            progress.show(source.fraction, f"{len(checked.track.tick)} ticks")

        prove(source.chunks(), space.profile, watch=watch)
    places, lines = footprint.places()
    if not len(places):
        raise Refusal(f"{source.name}: error: it lays no clay; there is nothing to place")
    with Progress("placing") as progress:
        told = (places, lines, footprint.edge)
        return sited(space, chart, told, acceleration, lambda share: progress.show(share, "shifts"))


def _title(machine: str, source: Source | None, acceleration: float) -> str:
    parts = [
        machine,
        Path(source.name).name if source is not None else "",
        f"{acceleration:g} mm/s² in hand" if acceleration else "",
    ]
    return "  ·  ".join(part for part in parts if part)


def _draw(paths: tuple[Path | None, Path | None], found: "Reach", mapped: Mapped, title: str) -> None:
    figure, map_ = paths
    if figure is not None:
        from cdhr_host.report.workspace import draw

        with writing(figure):
            draw(found, title, figure)
    if map_ is not None:
        from cdhr_host.report.space.pictures import draw_map

        with writing(map_):
            draw_map(*mapped, title, map_)


def _lines(found: "Reach", mapped: Mapped, names: tuple[str, str | None]) -> list[str]:
    from cdhr_host.report.space.sited import sited_lines
    from cdhr_host.report.space.volume import volume_lines
    from cdhr_host.report.workspace import workspace_lines

    (chart, space, part), (profile, name) = mapped, names
    lines = [*workspace_lines(found, profile), *volume_lines(chart, space)]
    return lines if part is None or name is None else [*lines, *sited_lines(part, space, name)]


def _record(
    found: "Reach", mapped: Mapped, names: tuple[str, str | None], acceleration: float
) -> dict[str, Any]:
    from cdhr_host.report.space.sited import sited_record
    from cdhr_host.report.space.volume import volume_record

    (chart, space, part), (profile, name) = mapped, names
    radii = found.printable.radius
    record = {
        "profile": profile,
        "acceleration_mm_s2": acceleration,
        "height_mm": (found.printable.height / MM).tolist(),
        "radius_mm": {policy: (radius / MM).tolist() for policy, radius in radii.items()},
        "volume_l": {policy: found.printable.volume(policy) * 1e3 for policy in radii},
        "margin": {f"{law} {policy}": value for (law, policy), value in found.margin.items()},
        "feasible": volume_record(chart, space),
    }
    if part is not None and name is not None:
        record["file"] = sited_record(part, space, name)
    return record
