"""``cdhr stream``: proves the whole file, then prints it."""

import json
import sys
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from cdhr_host.cli.interrupt import StopRequest
from cdhr_host.cli.machine import SIMULATED, check_log, open_machine, opened
from cdhr_host.cli.options import DrivesUrl, Json, LogPath, MaterialName, ProfileName, Program, examples
from cdhr_host.cli.printing import Run, printed
from cdhr_host.cli.proving import checking, tell_problems
from cdhr_host.cli.refusals import INTERRUPTED, Refusal, about, emit, say
from cdhr_host.cli.source import Source

if TYPE_CHECKING:
    from cdhr_host.job.closed_loop import Loop
    from cdhr_host.job.program import Program as Proven
    from cdhr_host.pipeline import Proof
    from cdhr_host.profile import Profile

EXAMPLES = examples(
    "cdhr stream gcode/paper_ring_double.gcode --speed 20",
    "cdhr stream vase.gcode.gz --profile paper-wide --log run.parquet",
    "cdhr stream part.gcode --control outer --speed 20",
    "cdhr stream part.gcode --json",
    more="In a terminal space holds and goes on, + and - change the feed by 10 %. "
    "Ctrl-C stops on the path and closes the air (exit code 130).",
)


class Control(StrEnum):
    """Loops that can be closed on the simulated machine."""

    NONE = "none"
    OUTER = "outer"
    PPC = "ppc"


def stream(
    file: Program,
    *,
    profile: ProfileName = "paper",
    material: MaterialName = None,
    drives: DrivesUrl = SIMULATED,
    speed: Annotated[
        float,
        typer.Option(metavar="X", help="Run the simulated drives X times faster than real time.", min=0.01),
    ] = 1.0,
    control: Annotated[
        Control,
        typer.Option(help="Close a loop on the simulated machine: outer on the nozzle, ppc on the forces."),
    ] = Control.NONE,
    log: LogPath = None,
    json_: Json = False,
    yes: Annotated[
        bool, typer.Option("--yes", "-y", help="Ask nothing: start real drives, pass the program's pauses.")
    ] = False,
) -> None:
    """Prove the whole file, then print it; exit 0 only when all of it was done, at rest, the air off."""
    from cdhr_host.errors import MotionError
    from cdhr_host.job.recorder import Names, Recorder
    from cdhr_host.report.run import run_lines, run_record

    if file == "-":
        raise Refusal(
            "cdhr: error: a print needs a file\nhint: it is read twice, to prove it and to print it"
        )
    source = Source(file)
    machine = open_machine(profile, material)
    check_log(log)
    loop = _loop(control, machine, drives)
    link, clock = opened(drives, machine, speed)
    try:
        with about(source.name):
            program = program_of(source, machine)
            proof = program.proof
            tell_problems(proof, source)
            if not proof.ok:
                raise typer.Exit(MotionError.exit_code)
            _agreed(proof, drives, yes)
            with StopRequest() as stop:
                recorder = Recorder(link, Names(profile, material, drives))
                run = Run(source, machine, program, link, clock, stop, not yes, recorder, loop)
                summary = printed(run, log)
    finally:
        link.close()
    if json_:
        emit(json.dumps(run_record(summary, proof, source.name, profile)))
    else:
        emit("\n".join(run_lines(summary, proof, source.name)))
    if summary.interrupted:
        say("cdhr: cdhr resume goes on with this print")
        raise typer.Exit(INTERRUPTED)


def program_of(source: Source, machine: "Profile") -> "Proven":
    """The file, proven."""
    from pathlib import Path

    from cdhr_host.job.program import ProgramFile, proven

    with checking(source) as watch:
        return proven(ProgramFile(Path(source.name)), machine, watch=watch, chunks=source.chunks())


def _loop(control: Control, machine: "Profile", drives: str) -> "Loop | None":
    """The control loop of the simulated machine; refused for drives that are not simulated."""
    if control is Control.NONE:
        return None
    if drives != SIMULATED:
        raise Refusal("cdhr: error: --control is for the simulated machine\nhint: leave out --drives")
    from cdhr_host.job.closed_loop import simulated

    return simulated(control.value, machine)


def _agreed(proof: "Proof", drives: str, yes: bool) -> None:
    """Have what an operator must say, or refuse while nothing moves."""
    if yes:
        return
    asks = sys.stdin.isatty()
    if proof.pauses and not asks:
        raise Refusal(
            f"cdhr: error: the program pauses {proof.pauses} times for an operator; there is no terminal"
            "\nhint: --yes passes the pauses"
        )
    if drives != SIMULATED and asks:
        answer = input("The machine will move. Print now? [y/N] ")
        if answer.strip().lower() not in {"y", "yes"}:
            raise Refusal("cdhr: nothing moved", INTERRUPTED)
