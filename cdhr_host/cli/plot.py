"""``cdhr plot``: pictures of a log."""

import json
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdhr_host.cli.machine import open_machine
from cdhr_host.cli.options import Json, examples
from cdhr_host.cli.progress import Progress, clock_text
from cdhr_host.cli.refusals import Refusal, check_picture, emit, say, writing

if TYPE_CHECKING:
    from cdhr_host.profile import Profile
    from cdhr_host.report.plot.passing import Choice, Drawn
    from cdhr_host.report.reading import LogFile

EXAMPLES = examples(
    "cdhr plot run.parquet",
    "cdhr plot vase.parquet --what forces --out forces.svg",
    "cdhr plot run.csv --profile paper --from 30 --to 45",
    "cdhr plot run.parquet --what path --colour tension --lines 100:400",
    "cdhr plot run.parquet --out run.pdf",
)
LOGS = "hint: logs are written by cdhr dry-run FILE --log LOG and cdhr stream FILE --log LOG"


class What(StrEnum):
    """A picture."""

    ALL = "all"
    PATH = "path"
    SLIDERS = "sliders"
    FORCES = "forces"
    AIR = "air"
    FOLLOWING = "following"


class Colour(StrEnum):
    """What the colours of the path tell."""

    SPEED = "speed"
    TENSION = "tension"
    PRESSURE = "pressure"
    LAYER = "layer"


def plot(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log: .csv, .parquet or a black box, .npz.")],
    *,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="Where to: .png, .svg or .pdf; LOG's name as .png."),
    ] = None,
    what: Annotated[What, typer.Option("--what", "-w", help="Which picture.")] = What.ALL,
    colour: Annotated[
        Colour, typer.Option("--colour", "-c", help="What the path's colours tell.")
    ] = Colour.SPEED,
    profile: Annotated[
        str | None,
        typer.Option(
            "--profile", "-p", metavar="P", help="The machine, where the log does not say; draws windows."
        ),
    ] = None,
    begin: Annotated[
        float | None, typer.Option("--from", metavar="S", help="Leave out what is earlier, s.")
    ] = None,
    end: Annotated[
        float | None, typer.Option("--to", metavar="S", help="Leave out what is later, s.")
    ] = None,
    lines: Annotated[
        str | None, typer.Option("--lines", metavar="A:B", help="Only these lines of G-code; A: and :B do.")
    ] = None,
    json_: Json = False,
) -> None:
    """Draw a log: path, slider motion, cable forces in their windows, clay and air, following error."""
    from cdhr_host.report.plot.write import shown_in, write_pictures
    from cdhr_host.report.reading import LogFileError

    out = Path(f"{log.stem}.png") if out is None else out
    check_picture(out, "--out")
    choice = _choice(begin, end, lines)
    try:
        found = _drawn(log, profile, choice)
        names = shown_in(found, what, colour)
    except LogFileError as error:
        raise Refusal(f"{log}: error: {error}") from error
    with writing(out):
        written = write_pictures(found, names, colour, out)
    if json_:
        emit(json.dumps(_record(found, written)))
    else:
        emit("\n".join(map(str, written)))


def _drawn(path: Path, profile: str | None, choice: "Choice") -> "Drawn":
    """Pass through the log; raises Refusal, LogFileError."""
    from cdhr_host.report.plot.passing import drawn

    try:
        log = _opened(path)
        machine = open_machine(profile) if profile is not None else log.profile
        _doubt(log, machine)
        with Progress("reading") as progress:

            def told(rows: int, t: float) -> None:
                fraction = rows / log.rows if log.rows else None
                progress.show(fraction, f"{rows} rows  {clock_text(t)} of motion")

            return drawn(log, machine, choice, told)
    except OSError as error:
        raise Refusal(f"{path}: error: cannot read: {error.strerror or error}") from error


def _opened(path: Path) -> "LogFile":
    """Raises Refusal for what is no log, OSError where it cannot be read."""
    from cdhr_host.report.reading import LogFile, LogFileError

    if not path.is_file():
        found = "not a file" if path.exists() else "there is no such file"
        raise Refusal(f"{path}: error: {found}\n{LOGS}")
    try:
        return LogFile.opened(path)
    except LogFileError as error:
        raise Refusal(f"{path}: error: {error}\n{LOGS}") from error


def _doubt(log: "LogFile", machine: "Profile | None") -> None:
    if machine is None:
        say(f"{log.path}: warning: it does not say which machine; no windows, no single cables")
        say("hint: --profile P names it")


def _choice(begin: float | None, end: float | None, lines: str | None) -> "Choice":
    """Raises Refusal for what cannot be chosen."""
    from cdhr_host.report.plot.passing import Choice

    inf = float("inf")
    first, last = _lines(lines) if lines is not None else (-inf, inf)
    times = -inf if begin is None else begin, inf if end is None else end
    if times[0] >= times[1]:
        raise Refusal(f"cdhr: error: --from {times[0]:g} is not before --to {times[1]:g}")
    return Choice(*times, (first, last))


def _lines(text: str) -> tuple[float, float]:
    first, colon, last = text.partition(":")
    try:
        bounds = float(int(first)) if first else float("-inf"), float(int(last)) if last else float("inf")
    except ValueError:
        colon = ""
    if not colon or bounds[0] > bounds[1]:
        raise Refusal(f"cdhr: error: --lines {text} is not A:B, the numbers of two lines in order")
    return bounds


def _record(drawn: "Drawn", written: list[Path]) -> dict[str, Any]:
    begin, end = drawn.times
    return {
        "log": str(drawn.path),
        "program": drawn.program or None,
        "machine": None if drawn.profile is None else drawn.profile.machine.name,
        "rows": drawn.rows,
        "begin_s": begin,
        "end_s": end,
        "pictures": [str(path) for path in written],
        "extremes": {
            name: dict(
                zip(("min", "min_t_s", "min_line", "max", "max_t_s", "max_line"), extreme, strict=True)
            )
            for name, extreme in drawn.extremes.items()
        },
    }
