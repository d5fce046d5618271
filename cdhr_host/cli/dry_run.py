"""``cdhr dry-run``: the whole pipeline without drives."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdhr_host.cli.machine import check_log, open_machine
from cdhr_host.cli.options import Json, LogPath, MaterialName, ProfileName, examples
from cdhr_host.cli.proving import LogWish, proven, tell_problems
from cdhr_host.cli.refusals import Refusal, about, check_file, emit, writing
from cdhr_host.cli.source import Source

if TYPE_CHECKING:
    from cdhr_host.errors import CdhrError
    from cdhr_host.pipeline import Proof
    from cdhr_host.profile import Profile

EXAMPLES = examples(
    "cdhr dry-run gcode/paper_ring_double.gcode",
    "cdhr dry-run vase.gcode.gz --profile paper-wide --log vase.parquet",
    "cdhr dry-run part.gcode --rate 1000 --log part.csv",
    "cdhr dry-run vase.gcode --rate 1000 --log vase.parquet --compact",
    "cdhr dry-run vase.gcode.gz --profile paper-wide --report vase.html",
    "cdhr generate ring | cdhr dry-run - --json",
)


def dry_run(
    file: Annotated[
        str,
        typer.Argument(metavar="FILE", help="The G-code; may be gzip-compressed; - reads standard input."),
    ],
    *,
    profile: ProfileName = "paper",
    material: MaterialName = None,
    log: LogPath = None,
    rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Rows a second; the drives' rate when left out.", min=10, max=10000),
    ] = None,
    compact: Annotated[
        bool,
        typer.Option("--compact", help="A small Parquet log: whole tenths of a micrometre, no forces."),
    ] = False,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="HTML", help="Write a page to look at: path, times, problems."),
    ] = None,
    json_: Json = False,
) -> None:
    """Prove a program without drives: every limit at every tick, time, extremes, and the setpoint log."""
    from cdhr_host.errors import CdhrError, MotionError, ProgramError
    from cdhr_host.report.summary import proof_record, refused_record, summary_lines

    source = Source(file)
    machine = open_machine(profile, material)
    check_log(log, compact=compact)
    page = _Page(report, machine, (source.name, profile))
    written = {} if report is None else {"report": str(report)}
    try:
        with about(source.name):
            wish = LogWish(log, compact) if log else None
            proof = proven(source, machine, rate=rate, log=wish, see=page.see)
    except Refusal as refusal:
        if isinstance(refusal.__cause__, CdhrError):
            page.write(refusal.__cause__)
        if json_ and isinstance(refusal.__cause__, ProgramError):
            emit(json.dumps({**refused_record(refusal.__cause__, source.name, profile), **written}))
        raise
    page.write(proof)
    tell_problems(proof, source)
    if json_:
        emit(json.dumps({**proof_record(proof, source.name, profile), **written}))
    else:
        verdict = "can be printed" if proof.ok else "cannot be printed"
        emit("\n".join([f"{source.name}: {verdict} on {profile}", *summary_lines(proof), *page.told]))
    if not proof.ok:
        raise typer.Exit(MotionError.exit_code)


class _Page:
    """The page of ``--report``, or none; written for refused programs too: they need it most."""

    def __init__(self, path: Path | None, machine: "Profile", names: tuple[str, str]) -> None:
        self._path, self._machine, self._names = path, machine, names
        self._trail: Any = None
        if path is not None:
            from cdhr_host.report.page import Trail

            check_file(path, [".html", ".htm"], "--report")
            self._trail = Trail(machine)

    @property
    def see(self) -> Any:
        """What a proof is to show its blocks."""
        return self._trail.watch if self._trail is not None else None

    @property
    def told(self) -> list[str]:
        """The line that says where the page is."""
        return [] if self._path is None else [f"  report     {self._path}"]

    def write(self, found: "Proof | CdhrError") -> None:
        """Put the page in its place; raises Refusal when the disk refuses."""
        if self._path is None:
            return
        from cdhr_host.report.page import write_page

        with writing(self._path):
            write_page(self._path, self._trail, self._machine, found, self._names)
