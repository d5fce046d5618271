"""``cdhr study``: the same question many times over, on all cores or on a Dask cluster."""

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from cdhr_host.cli.machine import open_machine
from cdhr_host.cli.options import Json, ProfileName, examples
from cdhr_host.cli.progress import Progress
from cdhr_host.cli.refusals import Refusal, about, check_file, check_picture, emit, writing
from cdhr_host.units import MM

if TYPE_CHECKING:
    from cdhr_host.report.studies.summary import Study

CALIBRATION = examples(
    "cdhr calibrate study --machines 200",
    "cdhr calibrate study --noise 0.05 --count 40 --scheduler tcp://10.0.0.5:8786",
)
TOLERANCE = examples("cdhr study tolerance", "cdhr study tolerance --machines 500 --trajectory 36")
WORKSPACE = examples(
    "cdhr study workspace --profile paper-wide",
    "cdhr study workspace --step 5 --plot margins.png --write margins.csv",
)
app = typer.Typer(help="Studies at scale: all cores, or a Dask cluster.", no_args_is_help=True)
J = TypeVar("J")
R = TypeVar("R")
Workers = Annotated[
    int | None, typer.Option(metavar="N", help="Processes; all cores when left out.", min=1, max=1024)
]
Scheduler = Annotated[
    str | None,
    typer.Option(metavar="URL", help="Dask scheduler, tcp://host:port, not own processes."),
]
Machines = Annotated[int, typer.Option("--machines", "-m", help="How many are drawn.", min=2, max=100_000)]
Plot = Annotated[Path | None, typer.Option(metavar="PNG", help="Draw it: .png, .svg or .pdf.")]


@app.command("calibration", epilog=CALIBRATION)
def calibration(  # noqa: PLR0917 -- options
    profile: ProfileName = "paper",
    machines: Machines = 100,
    count: Annotated[int, typer.Option("--count", "-n", help="Poses measured.", min=4, max=500)] = 24,
    noise: Annotated[
        float, typer.Option(metavar="MM", help="Of a measured coordinate, one sigma.", min=1e-4)
    ] = 0.1,
    workers: Workers = None,
    scheduler: Scheduler = None,
    plot: Plot = None,
    json_: Json = False,
) -> None:
    """Calibrate many simulated machines: is the truth within its doubts, and what is gained."""
    check_picture(plot, "--plot")
    machine = open_machine(profile)
    with about(profile):
        from cdhr_host.report.studies.summary import calibration_jobs, calibration_study
        from cdhr_host.report.studies.trials import tried

        jobs = calibration_jobs(machine, machines, count, noise * MM)
    found = calibration_study(jobs, _done(tried, jobs, workers, scheduler, "calibrating"))
    _finish(found, f"{profile}: {machines} machines, {count} poses, noise {noise:g} mm", plot, json_)


@app.command("tolerance", epilog=TOLERANCE)
def tolerance(  # noqa: PLR0917 -- options
    profile: ProfileName = "paper",
    machines: Machines = 100,
    trajectory: Annotated[str, typer.Option(help="Of the paper: 15, 35 or 36.")] = "15",
    workers: Workers = None,
    scheduler: Scheduler = None,
    plot: Plot = None,
    json_: Json = False,
) -> None:
    """How far the nozzle strays for pulleys, attachments, offsets and radii that are off by so much."""
    from cdhr_host.samples import LAWS

    check_picture(plot, "--plot")
    if trajectory not in LAWS:
        raise Refusal(f"cdhr: error: no trajectory {trajectory}\nhint: there are {', '.join(LAWS)}")
    machine = open_machine(profile)
    from cdhr_host.report.studies.summary import tolerance_jobs, tolerance_study
    from cdhr_host.report.studies.trials import strayed

    jobs = tolerance_jobs(machine, machines, trajectory)
    found = tolerance_study(jobs, _done(strayed, jobs, workers, scheduler, "straying"))
    _finish(found, f"{profile}: Eq. ({trajectory}), {machines} machines each", plot, json_)


@app.command("workspace", epilog=WORKSPACE)
def workspace(  # noqa: PLR0917 -- options
    profile: ProfileName = "paper",
    step: Annotated[float, typer.Option(metavar="MM", help="Of the grid, all three ways.", min=1.0)] = 20.0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    plot: Plot = None,
    write: Annotated[
        Path | None, typer.Option(metavar="CSV", help="Every node: x_mm, y_mm, z_mm, margin.")
    ] = None,
    json_: Json = False,
) -> None:
    """Force margins over the whole bed, node by node, without taking the machine for symmetric."""
    check_picture(plot, "--plot")
    if write is not None:
        check_file(write, [".csv"], "--write")
    machine = open_machine(profile)
    from cdhr_host.report.studies.summary import slices, workspace_study
    from cdhr_host.report.studies.trials import margins

    jobs = slices(machine, step * MM)
    found = workspace_study(jobs, _done(margins, jobs, workers, scheduler, "mapping"))
    if write is not None:
        from cdhr_host.report.files import put

        with writing(write), put(write) as part:
            part.write_text("\n".join([*found.rows(), ""]), encoding="ascii", newline="\n")
    _finish(found, f"{profile}: grid of {step:g} mm", plot, json_)


def _done(
    work: Callable[[J], R], jobs: Sequence[J], workers: int | None, scheduler: str | None, doing: str
) -> list[R]:
    """Every answer, with progress; a cluster that cannot be used is a refusal."""
    from cdhr_host.report.studies.spread import ClusterError, spread

    with Progress(doing) as progress:
        try:
            return list(_shown(spread(work, jobs, workers=workers, scheduler=scheduler), len(jobs), progress))
        except ClusterError as error:
            raise Refusal(f"cdhr: error: {error}") from error


def _shown(found: Iterable[R], count: int, progress: Progress) -> Iterable[R]:
    for number, each in enumerate(found, 1):
        progress.show(number / count, f"{number} of {count}")
        yield each


def _finish(found: "Study", title: str, plot: Path | None, json_: bool) -> None:
    if plot is not None:
        from cdhr_host.report.files import put

        with writing(plot), put(plot) as part:
            found.draw(title, part)
    if json_:
        record: dict[str, Any] = {"title": title, **found.record()}
        emit(json.dumps(record))
    else:
        emit("\n".join([title, *found.lines()]))
