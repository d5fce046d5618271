"""``cdhr calibrate``: what the machine and its clay are like, from measurements."""

import typer

from cdhr_host.cli import calibrate_clay
from cdhr_host.cli.options import examples

app = typer.Typer(
    help="Find out from measurements what the clay and the machine are like.",
    epilog=examples(
        "cdhr calibrate clay --pattern cups.gcode",
        "cdhr calibrate clay cups.csv --plot fit.png --write my-stoneware",
    ),
    no_args_is_help=True,
)
app.command("clay", epilog=calibrate_clay.EXAMPLES)(calibrate_clay.clay)
