"""``cdhr resume``: goes on with a print that was interrupted."""

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdhr_host.cli.interrupt import StopRequest
from cdhr_host.cli.machine import SIMULATED, check_log, open_machine, opened
from cdhr_host.cli.options import Json, LogPath, examples
from cdhr_host.cli.printing import Run, printed
from cdhr_host.cli.refusals import INTERRUPTED, Refusal, about, emit, say
from cdhr_host.cli.source import Source
from cdhr_host.cli.stream import program_of

if TYPE_CHECKING:
    from cdhr_host.drives import MachineLink
    from cdhr_host.job.journal import Journal
    from cdhr_host.job.program import Program
    from cdhr_host.job.recovery import Recovery
    from cdhr_host.profile import Profile

EXAMPLES = examples(
    "cdhr resume",
    "cdhr resume ~/.local/state/cdhr/journals/20261122-101500-000000-vase.journal",
    "cdhr resume --from-layer 12 --moved",
    more="Without JOURNAL the last interrupted print is gone on with.",
)


def resume(
    journal: Annotated[
        Path | None, typer.Argument(metavar="[JOURNAL]", help="The journal of the print.", show_default=False)
    ] = None,
    *,
    drives: Annotated[
        str | None, typer.Option("--drives", metavar="URL", help="Other drives than the print began on.")
    ] = None,
    overlap_mm: Annotated[
        float, typer.Option("--overlap", metavar="MM", help="Path laid once more before the seam.", min=0)
    ] = 2.0,
    from_line: Annotated[
        int | None, typer.Option("--from-line", metavar="N", help="Go on at this line instead.", min=1)
    ] = None,
    from_layer: Annotated[
        int | None, typer.Option("--from-layer", metavar="N", help="Go on at this layer instead.", min=1)
    ] = None,
    moved: Annotated[
        bool, typer.Option("--moved", help="The machine was moved since; do not ask where it stands.")
    ] = False,
    speed: Annotated[
        float, typer.Option(metavar="X", help="Run simulated drives X times faster.", min=0.01)
    ] = 1.0,
    log: LogPath = None,
    json_: Json = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Ask nothing.")] = False,
) -> None:
    """Go on with an interrupted print: file, profile and the machine's place must be those of its journal."""
    from cdhr_host.job.journal import journal_folder, latest_unfinished, read_journal
    from cdhr_host.job.recorder import Names, Recorder
    from cdhr_host.report.run import run_lines, run_record

    check_log(log)
    with about("cdhr resume"):
        past = read_journal(journal or latest_unfinished(journal_folder()))
        machine = _machine(past)
        source = _source(past)
    names = Names(past.opened.profile, past.opened.material, drives or past.opened.drives)
    with about(source.name):
        program = program_of(source, machine)
    link, clock = opened(names.drives, machine, speed)
    try:
        with about("cdhr resume"):
            wish = Wish(overlap_mm, from_line, from_layer, moved or names.drives == SIMULATED)
            found = _found(past, program, link, wish)
            _agreed(past, found, program, again=names.drives == SIMULATED, yes=yes)
            with StopRequest() as stop:
                run = Run(source, machine, program, link, clock, stop, not yes, Recorder(link, names))
                summary = printed(replace(run, recovery=found, goes_on=str(past.path)), log)
    finally:
        link.close()
    if json_:
        record = run_record(summary, program.proof, source.name, names.profile)
        emit(json.dumps({**record, "resumed": _record(past, found)}))
    else:
        emit("\n".join(run_lines(summary, program.proof, source.name)))
    if summary.interrupted:
        raise typer.Exit(INTERRUPTED)


@dataclass(frozen=True, slots=True)
class Wish:
    """Where the operator wants to go on."""

    overlap_mm: float
    line: int | None
    layer: int | None
    moved: bool
    """the machine does not stand where the print left it"""


def _machine(past: "Journal") -> "Profile":
    """The profile the print began with. Raises JobError when it is another by now."""
    from cdhr_host.errors import JobError, Problem
    from cdhr_host.job.recorder import digest_of_profile

    machine = open_machine(past.opened.profile, past.opened.material)
    if past.finished:
        hint = "cdhr stream prints it again"
        raise JobError(Problem("resume", f"{past.path} is of a print that was done", hint=hint))
    if digest_of_profile(machine) != past.opened.profile_sha256:
        raise JobError(
            Problem(
                "resume",
                f"profile {past.opened.profile} is not what it was when the print began",
                hint="a plan for another machine leads elsewhere: put the profile back, or print anew",
            )
        )
    return machine


def _source(past: "Journal") -> Source:
    """The file that was printed. Raises JobError when it is another by now."""
    from cdhr_host.errors import JobError, Problem
    from cdhr_host.job.recorder import digest_of

    path = Path(past.opened.file)
    if not path.is_file():
        hint = "put the file back where it was"
        raise JobError(Problem("resume", f"{path}, which was printed, is not there", hint=hint))
    if digest_of(path) != past.opened.sha256:
        hint = "put back the file as it was, or print the new one from the beginning"
        raise JobError(Problem("resume", f"{path} was changed since the print began", hint=hint))
    return Source(str(path))


def _found(past: "Journal", program: "Program", link: "MachineLink", wish: Wish) -> "Recovery":
    """Where it goes on. Raises JobError where that is not known, or not there."""
    from cdhr_host.job.recovery import Resuming
    from cdhr_host.pipeline.rig import Rig
    from cdhr_host.units import MM

    rig = Rig.from_profile(link.profile)
    way = Resuming(program, rig)
    line = wish.line if wish.layer is None else _line_of(wish.layer, program)
    if line is not None:
        return way.at_line(line)
    if wish.moved:
        return way.moved(past, wish.overlap_mm * MM)
    return way.found(past, rig.standing(link.slider)[0], link.stop_rows, wish.overlap_mm * MM)


def _line_of(layer: int, program: "Program") -> int:
    from cdhr_host.errors import JobError, Problem

    layers = program.proof.layers
    if layer > len(layers):
        message = f"there is no layer {layer}: the file names {len(layers)}"
        raise JobError(Problem("resume", message, hint="--from-line goes on at a line"))
    return layers[layer - 1][0]


def _agreed(past: "Journal", found: "Recovery", program: "Program", *, again: bool, yes: bool) -> None:
    """Show what will be done, and ask."""
    for line in _plan(past, found, program, again=again):
        say(line)
    if yes:
        return
    if not sys.stdin.isatty():
        raise Refusal("cdhr: error: there is no terminal to ask on\nhint: --yes goes on without asking")
    if input("Go on? [y/N] ").strip().lower() not in {"y", "yes"}:
        raise Refusal("cdhr: nothing moved", INTERRUPTED)


def _plan(past: "Journal", found: "Recovery", program: "Program", *, again: bool) -> list[str]:
    from cdhr_host.units import MM

    x, y, z = found.nozzle_G / MM
    lines = [f"journal   {past.path}: {past.state}{f', {past.reason}' if past.reason else ''}"]
    if past.damage is not None:
        lost = past.damage
        lines.append(f"          {lost.dropped} bytes from record {lost.record} on are dropped: {lost.why}")
    if again:
        lines.append("machine   simulated anew: it stands at its reference pose")
    elif found.away:
        lines.append(f"machine   stands {found.away / MM:.3f} mm from its path")
    share = found.tick * past.opened.period_s / max(program.proof.duration, past.opened.period_s)
    lines += [
        f"goes on   at line {found.line} of {program.proof.lines}, {share:.0%} done",
        f"          X{x:.3f} Y{y:.3f} Z{z:.3f}",
        f"overlap   {found.overlap / MM:.2f} mm of bead at most"
        + ("" if found.sure else "; where the bead ended is not known better"),
        "approach  up, over the print, down; then the air is primed",
    ]
    return lines


def _record(past: "Journal", found: "Recovery") -> dict[str, object]:
    from cdhr_host.units import MM

    return {
        "journal": str(past.path),
        "line": found.line,
        "nozzle_mm": (found.nozzle_G / MM).tolist(),
        "overlap_mm": found.overlap / MM,
        "sure": found.sure,
    }
