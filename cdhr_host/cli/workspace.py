"""``cdhr workspace``: where the machine can print."""

import json
from pathlib import Path
from typing import Annotated

import typer

from cdhr_host.cli.machine import open_machine
from cdhr_host.cli.options import Json, ProfileName, examples
from cdhr_host.cli.refusals import Refusal, about, emit, writing
from cdhr_host.units import MM

EXAMPLES = examples(
    "cdhr workspace",
    "cdhr workspace --profile paper-wide --acceleration 500",
    "cdhr workspace --profile paper-wide --figure radius.png",
)
SUFFIXES = {".png", ".svg", ".pdf"}


def workspace(
    profile: ProfileName = "paper",
    acceleration: Annotated[
        float, typer.Option(metavar="MM_S2", help="Acceleration to keep in hand, in mm/s².", min=0)
    ] = 0.0,
    figure: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw radius by height: .png, .svg or .pdf.")
    ] = None,
    json_: Json = False,
) -> None:
    """Printable radius and volume for each spring policy, and the paper's trajectories under each."""
    if figure is not None and figure.suffix not in SUFFIXES:
        raise Refusal(f"cdhr: error: --figure {figure} does not end in {', '.join(sorted(SUFFIXES))}")
    from cdhr_host.report.paper.pictures import available
    from cdhr_host.report.workspace import draw, reach, workspace_lines

    if figure is not None and not available():
        raise Refusal("cdhr: error: pictures need matplotlib\nhint: python3 -m pip install 'cdhr-host[plot]'")
    with about(profile):
        machine = open_machine(profile)
        found = reach(machine, acceleration * MM)
    if figure is not None:
        with writing(figure):
            draw(found, machine.machine.name, figure)
    if not json_:
        emit("\n".join(workspace_lines(found, profile)))
        return
    radii = found.printable.radius
    record = {
        "profile": profile,
        "acceleration_mm_s2": acceleration,
        "height_mm": (found.printable.height / MM).tolist(),
        "radius_mm": {name: (radius / MM).tolist() for name, radius in radii.items()},
        "volume_l": {name: found.printable.volume(name) * 1e3 for name in radii},
        "margin": {f"{name} {policy}": value for (name, policy), value in found.margin.items()},
    }
    emit(json.dumps(record))
