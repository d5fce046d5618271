"""``cdhr resume``: goes on with a print that was interrupted."""

import json
import sys
from dataclasses import replace
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
from cdhr_host.cli.way_on import Wish, record, told, way_on

if TYPE_CHECKING:
    from cdhr_host.job import RunSummary
    from cdhr_host.job.journal import Journal
    from cdhr_host.job.program import Program
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
    from cdhr_host.job.recorder import Names, Recorder

    check_log(log)
    with about("cdhr resume"):
        past, machine, source = _interrupted(journal)
    names = Names(past.opened.profile, past.opened.material, drives or past.opened.drives)
    with about(source.name):
        program = program_of(source, machine)
    link, clock = opened(names.drives, machine, speed)
    again = names.drives == SIMULATED
    try:
        with about("cdhr resume"):
            wish = Wish(overlap_mm, from_line, from_layer, moved or again)
            found = way_on(past, program, link, wish)
            _agreed(told(past, found, program, link, again=again), yes=yes)
            with StopRequest() as stop:
                run = Run(source, machine, program, link, clock, stop, not yes, Recorder(link, names))
                summary = printed(replace(run, recovery=found.recovery, goes_on=str(past.path)), log)
    finally:
        link.close()
    resumed = record(past, found) if json_ else None
    _summed_up(summary, program, source, names.profile, resumed)


def _interrupted(journal: Path | None) -> "tuple[Journal, Profile, Source]":
    """The print to go on with: journal, machine, file. Raises JobError where one is another by now."""
    from cdhr_host.job.journal import journal_folder, latest_unfinished, read_journal

    past = read_journal(journal or latest_unfinished(journal_folder()))
    return past, _machine(past), _source(past)


def _summed_up(
    summary: "RunSummary", program: "Program", source: Source, profile: str, resumed: dict[str, object] | None
) -> None:
    """Print what was done, as JSON where it is to say how it was resumed; exit 130 if it was interrupted."""
    from cdhr_host.report.run import run_lines, run_record

    if resumed is not None:
        done = run_record(summary, program.proof, source.name, profile)
        emit(json.dumps({**done, "resumed": resumed}))
    else:
        emit("\n".join(run_lines(summary, program.proof, source.name)))
    if summary.interrupted:
        raise typer.Exit(INTERRUPTED)


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


def _agreed(plan: list[str], *, yes: bool) -> None:
    """Show what will be done, and ask."""
    for line in plan:
        say(line)
    if yes:
        return
    if not sys.stdin.isatty():
        raise Refusal("cdhr: error: there is no terminal to ask on\nhint: --yes goes on without asking")
    if input("Go on? [y/N] ").strip().lower() not in {"y", "yes"}:
        raise Refusal("cdhr: nothing moved", INTERRUPTED)
