"""``cdhr calibrate``: what the machine and its clay are like, from measurements."""

import typer

from cdhr_host.cli import calibrate_clay, calibrate_geometry, study
from cdhr_host.cli.options import examples

app = typer.Typer(
    help="Find out from measurements what the clay and the machine are like.",
    epilog=examples(
        "cdhr calibrate clay --pattern cups.gcode",
        "cdhr calibrate clay cups.csv --plot fit.png --write my-stoneware",
        "cdhr calibrate plan poses.csv --gcode poses.gcode",
        "cdhr calibrate geometry poses.csv --plot residuals.png --write mine.toml",
    ),
    no_args_is_help=True,
)
app.command("clay", epilog=calibrate_clay.EXAMPLES)(calibrate_clay.clay)
app.command("plan", epilog=calibrate_geometry.PLAN)(calibrate_geometry.plan)
app.command("geometry", epilog=calibrate_geometry.GEOMETRY)(calibrate_geometry.geometry)
app.command("study", epilog=study.CALIBRATION)(study.calibration)
