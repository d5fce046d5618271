"""``cdhr bead``: what was laid against what was wanted."""

import json
from pathlib import Path
from typing import Annotated

import typer

from cdhr_host.cli.options import Json, examples
from cdhr_host.cli.refusals import Refusal, emit

EXAMPLES = examples(
    "cdhr stream gcode/paper_ring_double.gcode --material stoneware --speed 20 --log ring.parquet",
    "cdhr bead ring.parquet",
    "cdhr plot ring.parquet --what air",
    more="late is positive; on each mm is the clay of each millimetre of path, of what was planned there.",
)


def bead(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Of a simulated print: .csv or .parquet.")],
    *,
    json_: Json = False,
) -> None:
    """Measure the beads of a simulated print: clay on each millimetre, starts, ends and seams."""
    from cdhr_host.report.bead import bead_lines, bead_records, laid_beads
    from cdhr_host.report.reading import LogFileError

    try:
        found = laid_beads(log)
    except (LogFileError, OSError) as error:
        raise Refusal(f"cdhr: error: {log}: {error}") from error
    if json_:
        emit(json.dumps({"log": str(log), "beads": bead_records(found)}))
    elif found:
        emit("\n".join(bead_lines(found)))
    else:
        emit(f"{log}: no clay was planned")
