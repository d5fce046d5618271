"""``cdhr dry-run``: the whole pipeline without drives."""

import json
from typing import Annotated

import typer

from cdhr_host.cli.machine import check_log, open_machine
from cdhr_host.cli.options import Json, LogPath, ProfileName, examples
from cdhr_host.cli.proving import LogWish, proven, tell_problems
from cdhr_host.cli.refusals import Refusal, about, emit
from cdhr_host.cli.source import Source

EXAMPLES = examples(
    "cdhr dry-run gcode/paper_ring_double.gcode",
    "cdhr dry-run vase.gcode.gz --profile paper-wide --log vase.parquet",
    "cdhr dry-run part.gcode --rate 1000 --log part.csv",
    "cdhr dry-run vase.gcode --rate 1000 --log vase.parquet --compact",
    "cdhr generate ring | cdhr dry-run - --json",
)


def dry_run(
    file: Annotated[
        str,
        typer.Argument(metavar="FILE", help="The G-code; may be gzip-compressed; - reads standard input."),
    ],
    *,
    profile: ProfileName = "paper",
    log: LogPath = None,
    rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Rows a second; the drives' rate when left out.", min=10, max=10000),
    ] = None,
    compact: Annotated[
        bool,
        typer.Option("--compact", help="A small Parquet log: whole tenths of a micrometre, no forces."),
    ] = False,
    json_: Json = False,
) -> None:
    """Prove a program without drives: every limit at every tick, time, extremes, and the setpoint log."""
    from cdhr_host.errors import MotionError, ProgramError
    from cdhr_host.report.summary import proof_record, refused_record, summary_lines

    source = Source(file)
    machine = open_machine(profile)
    check_log(log, compact=compact)
    try:
        with about(source.name):
            proof = proven(source, machine, rate=rate, log=LogWish(log, compact) if log else None)
    except Refusal as refusal:
        if json_ and isinstance(refusal.__cause__, ProgramError):
            emit(json.dumps(refused_record(refusal.__cause__, source.name, profile)))
        raise
    tell_problems(proof, source)
    if json_:
        emit(json.dumps(proof_record(proof, source.name, profile)))
    else:
        verdict = "can be printed" if proof.ok else "cannot be printed"
        emit("\n".join([f"{source.name}: {verdict} on {profile}", *summary_lines(proof)]))
    if not proof.ok:
        raise typer.Exit(MotionError.exit_code)
