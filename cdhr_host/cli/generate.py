"""``cdhr generate``: the paper's programs, made by formula."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from cdhr_host.cli.options import examples
from cdhr_host.cli.refusals import Refusal, emit, writing
from cdhr_host.units import MM

app = typer.Typer(
    help="Write the paper's ring and trajectories as G-code.",
    epilog=examples(
        "cdhr generate ring -o ring.gcode",
        "cdhr generate ring --diameter 200 --layers 4 -o tall.gcode",
        "cdhr generate eq15 -o eq15.gcode",
    ),
    no_args_is_help=True,
)
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE", help="Where to write; standard output when left out."),
]
Step = Annotated[float, typer.Option("--step", metavar="S", help="Time between two moves.", min=0.01, max=10)]


@app.command(
    epilog=examples("cdhr generate ring -o ring.gcode", "cdhr generate ring --diameter 200 --speed 30")
)
def ring(
    *,
    diameter: Annotated[float, typer.Option(metavar="MM", help="Of the bead's centre line.", min=1)] = 150.0,
    layers: Annotated[int, typer.Option(metavar="N", help="Layers of clay.", min=1, max=1000)] = 2,
    bead: Annotated[float, typer.Option(metavar="MM", help="Width of the bead.", min=0.1)] = 5.0,
    layer_height: Annotated[float, typer.Option(metavar="MM", help="Height of a layer.", min=0.1)] = 2.5,
    speed: Annotated[float, typer.Option(metavar="MM_S", help="Speed while clay flows.", min=0.1)] = 20.0,
    output: Output = None,
) -> None:
    """The paper's double-layer ring: a closed circle of one 5 mm bead, laid twice, as G3 arcs."""
    from cdhr_host import samples

    if layer_height > bead:
        raise Refusal(f"cdhr: error: a bead {bead:g} mm wide cannot be {layer_height:g} mm high")
    shape = samples.Ring(diameter * MM, layers, bead * MM, layer_height * MM, speed * MM)
    clay = f"--bead {bead:g} --layer-height {layer_height:g} --speed {speed:g}"
    command = f"ring --diameter {diameter:g} --layers {layers} {clay}"
    _write(output, f"; cdhr generate {command} : the paper's double-layer ring", samples.ring(shape))


@app.command(epilog=examples("cdhr generate eq15 -o eq15.gcode"))
def eq15(step: Step = 0.1, output: Output = None) -> None:
    """The paper's rising spiral, Eq. (15)."""
    _trajectory("15", step, output)


@app.command(epilog=examples("cdhr generate eq35 -o eq35.gcode"))
def eq35(step: Step = 0.05, output: Output = None) -> None:
    """The paper's circle, Eq. (35)."""
    _trajectory("35", step, output)


@app.command(epilog=examples("cdhr generate eq36 -o eq36.gcode"))
def eq36(step: Step = 0.1, output: Output = None) -> None:
    """The paper's flat spiral, Eq. (36)."""
    _trajectory("36", step, output)


def _trajectory(equation: str, step: float, output: Path | None) -> None:
    from cdhr_host import samples

    law = samples.LAWS[equation]
    t = law.times(step)
    what = f"the paper's {law.drawing}, Eq. ({equation}), {law.duration:g} s"
    head = f"; cdhr generate eq{equation} --step {step:g} : {what}"
    _write(output, head, samples.traced(t, law.position(t)))


def _write(output: Path | None, head: str, lines: Iterator[str]) -> None:
    text = "\n".join([head, *lines]) + "\n"
    if output is None:
        emit(text.rstrip("\n"))
        return
    with writing(output):
        output.write_text(text, encoding="ascii", newline="\n")
    print(f"{output}: {text.count(chr(10))} lines", file=sys.stderr)
