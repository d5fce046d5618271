"""``cdhr stream``: proves the whole file, then prints it."""

import json
import sys
from bisect import bisect_right
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdhr_host.cli.interrupt import StopRequest
from cdhr_host.cli.options import DrivesUrl, Json, LogPath, ProfileName, Program, examples
from cdhr_host.cli.progress import Progress
from cdhr_host.cli.proving import check_log, open_machine, proven, tell_problems
from cdhr_host.cli.refusals import INTERRUPTED, Refusal, about, emit, writing
from cdhr_host.cli.source import Source

if TYPE_CHECKING:
    from cdhr_host.drives import Clock, MachineLink
    from cdhr_host.job import RunSummary
    from cdhr_host.pipeline import Proof
    from cdhr_host.profile import Profile
    from cdhr_host.report.log import RunLog
    from cdhr_host.values import Feedback, Setpoints

EXAMPLES = examples(
    "cdhr stream gcode/paper_ring_double.gcode --speed 20",
    "cdhr stream vase.gcode.gz --profile paper-wide --log run.parquet",
    "cdhr stream part.gcode --json",
)
SIMULATED = "loopback:"


@dataclass(frozen=True, slots=True)
class Run:
    """What to run where."""

    source: Source
    machine: "Profile"
    proof: "Proof"
    link: "MachineLink"
    clock: "Clock"
    stop: StopRequest


def stream(
    file: Program,
    *,
    profile: ProfileName = "paper",
    drives: DrivesUrl = SIMULATED,
    speed: Annotated[
        float,
        typer.Option(metavar="X", help="Run the simulated drives X times faster than real time.", min=0.01),
    ] = 1.0,
    log: LogPath = None,
    json_: Json = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Start real drives without asking.")] = False,
) -> None:
    """Prove the whole file, then print it; exit 0 only when all of it was done, at rest, the air off."""
    from cdhr_host.errors import MotionError
    from cdhr_host.report.run import run_lines, run_record

    if file == "-":
        raise Refusal(
            "cdhr: error: a print needs a file\nhint: it is read twice, to prove it and to print it"
        )
    source = Source(file)
    machine = open_machine(profile)
    check_log(log)
    link, clock = _opened(drives, machine, speed)
    try:
        with about(source.name):
            proof = proven(source, machine)
            tell_problems(proof, source)
            if not proof.ok:
                raise typer.Exit(MotionError.exit_code)
            _agreed(drives, yes)
            with StopRequest() as stop:
                summary = _printed(Run(source, machine, proof, link, clock, stop), log)
    finally:
        link.close()
    emit(
        json.dumps(run_record(summary, proof, source.name, profile))
        if json_
        else "\n".join(run_lines(summary, proof, source.name))
    )
    if summary.interrupted:
        raise typer.Exit(INTERRUPTED)


def _opened(drives: str, machine: "Profile", speed: float) -> "tuple[MachineLink, Clock]":
    """The link and the clock it runs by; raises DriveError, Refusal for a speed real drives lack."""
    from cdhr_host.drives import MonotonicClock, PacedClock, open_link

    simulated = drives == SIMULATED
    if speed != 1.0 and not simulated:
        raise Refusal("cdhr: error: --speed is for simulated drives only\nhint: use M220 to print faster")
    clock = PacedClock(speed) if simulated else MonotonicClock()
    return open_link(drives, machine, clock), clock


def _agreed(drives: str, yes: bool) -> None:
    """Ask before real drives move, where there is someone to ask."""
    if drives == SIMULATED or yes or not sys.stdin.isatty():
        return
    if input("The machine will move. Print now? [y/N] ").strip().lower() not in {"y", "yes"}:
        raise Refusal("cdhr: nothing moved", INTERRUPTED)


def _printed(run: Run, log: Path | None) -> "RunSummary":
    """Run the file a second time, now into the drives; what was done stays in the log, however it ends."""
    import numpy as np

    from cdhr_host.job import stream as send
    from cdhr_host.pipeline import Staircase

    run.source.still_the_same()
    with ExitStack() as stack:
        out = stack.enter_context(_kept(log)) if log else None
        show = _shown(run, stack.enter_context(Progress("printing")))

        def done(rows: "Setpoints", feedback: "Feedback") -> None:
            show(rows)
            if out is not None:
                out.add_run(rows, feedback)

        setpoints = Staircase(run.machine).setpoints(run.source.chunks())
        return send(setpoints, run.link, run.clock, start=np.zeros(6), on_rows=done, should_stop=run.stop)


@contextmanager
def _kept(log: Path) -> "Iterator[RunLog]":
    """A run log that is kept however the run ends: it is the machine's black box."""
    from cdhr_host.report.log import RunLog

    with writing(log), RunLog(log) as out:
        try:
            yield out
        finally:
            out.keep()


def _shown(run: Run, progress: Progress) -> "Callable[[Setpoints], None]":
    """A function that shows where a run is, from the rows just executed."""
    layer_lines = [line for line, _ in run.proof.layers]
    duration = run.proof.duration

    def show(rows: "Setpoints") -> None:
        t, line = float(rows.t[-1]), int(rows.line[-1])
        layer = bisect_right(layer_lines, line)
        where = f"layer {layer}/{len(layer_lines)}  line {line}" if layer_lines else f"line {line}"
        fraction = min(1.0, t / duration) if duration else 1.0
        progress.show(fraction, where, left=(duration - t) / run.clock.speed)

    return show
