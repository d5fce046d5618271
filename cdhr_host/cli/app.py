"""``cdhr``: the table of commands."""

from typing import Annotated

import typer

from cdhr_host import __version__
from cdhr_host.cli import (
    bead,
    calibrate,
    compensation,
    drives,
    dry_run,
    generate,
    jog,
    plot,
    profiles,
    reproduce,
    resume,
    serve,
    sim,
    stream,
    study,
    workspace,
)
from cdhr_host.cli.options import examples
from cdhr_host.cli.refusals import RefusingGroup

app = typer.Typer(
    name="cdhr",
    cls=RefusingGroup,
    help="Host software of a cable-driven clay printer: G-code in, six slider setpoints and the air out.",
    epilog=examples(
        "cdhr dry-run gcode/paper_ring_double.gcode",
        "cdhr stream gcode/paper_ring_double.gcode --speed 20",
        "cdhr stream vase.gcode.gz --profile paper-wide --log run.parquet",
        "cdhr profile show paper",
        more="cdhr COMMAND --help shows the examples of a command.",
    ),
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("stream", epilog=stream.EXAMPLES)(stream.stream)
app.command("dry-run", epilog=dry_run.EXAMPLES)(dry_run.dry_run)
app.command("resume", epilog=resume.EXAMPLES)(resume.resume)
app.command("jog", epilog=jog.EXAMPLES)(jog.jog)
app.command("sim", epilog=sim.EXAMPLES)(sim.sim)
app.command("serve", epilog=serve.EXAMPLES)(serve.serve)
app.add_typer(profiles.app, name="profile")
app.add_typer(drives.app, name="drives")
app.command("compensation", epilog=compensation.EXAMPLES)(compensation.compensation)
app.command("reproduce", epilog=reproduce.EXAMPLES)(reproduce.reproduce)
app.command("plot", epilog=plot.EXAMPLES)(plot.plot)
app.command("bead", epilog=bead.EXAMPLES)(bead.bead)
app.command("workspace", epilog=workspace.EXAMPLES)(workspace.workspace)
app.add_typer(generate.app, name="generate")
app.add_typer(calibrate.app, name="calibrate")
app.add_typer(study.app, name="study")


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"cdhr {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_version)
    ] = False,
) -> None:
    """Options before the command."""


def main() -> None:
    """The console script: runs a command and exits with its code."""
    app(prog_name="cdhr")
