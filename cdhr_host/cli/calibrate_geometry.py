"""``cdhr calibrate geometry`` and ``plan``: measured nozzle points to a new profile, and where to measure."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cdhr_host.cli.machine import open_machine
from cdhr_host.cli.options import Json, ProfileName, examples
from cdhr_host.cli.refusals import Refusal, about, check_file, check_picture, emit, say, writing
from cdhr_host.units import MM

if TYPE_CHECKING:
    from cdhr_host.mechanism.calibration import Points
    from cdhr_host.mechanism.calibration_model import Doubts
    from cdhr_host.profile import Profile
    from cdhr_host.report.studies.fit import GeometryFit
    from cdhr_host.report.studies.poses import Poses
    from cdhr_host.values import Array

GEOMETRY = examples(
    "cdhr calibrate geometry points.csv",
    "cdhr calibrate geometry points.csv --plot residuals.png --write mine.toml",
    "cdhr calibrate geometry camera.csv --frame free --noise 0.05",
    more="Columns: slider1_mm, slider2_mm, slider3_mm and those of x_mm, y_mm, z_mm that were measured; an "
    "empty cell was not. cdhr calibrate plan writes such a table.",
)
PLAN = examples(
    "cdhr calibrate plan poses.csv",
    "cdhr calibrate plan poses.csv --count 40 --gcode poses.gcode --profile paper-wide",
    "cdhr calibrate plan pretended.csv --pretend 1",
)
FEWEST = 4
"""poses that make a calibration"""
SUSPICIOUS = 1.0 * MM
"""noise of a coordinate that no camera and no gauge has"""
PulleyDoubt = Annotated[
    float, typer.Option(metavar="MM", help="How far off pulley centres may be, one sigma.", min=0, max=50)
]
AttachmentDoubt = Annotated[
    float, typer.Option(metavar="MM", help="The same of attachments on their platform.", min=0, max=50)
]
OffsetDoubt = Annotated[
    float, typer.Option(metavar="MM", help="The same of the reference offsets.", min=0, max=50)
]
RadiusDoubt = Annotated[
    float, typer.Option(metavar="MM", help="The same of the pulleys' groove radius.", min=0, max=5)
]


def geometry(  # noqa: PLR0917 -- options
    table: Annotated[
        Path, typer.Argument(metavar="CSV", help="Slider positions and measured points.", show_default=False)
    ],
    profile: ProfileName = "paper",
    frame: Annotated[
        Literal["program", "free"],
        typer.Option(help="What x, y, z are in: the program's coordinates, or a camera's own."),
    ] = "program",
    noise: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Of a coordinate, one sigma; from the residuals when left out."),
    ] = None,
    pulley_doubt: PulleyDoubt = 3.0,
    attachment_doubt: AttachmentDoubt = 0.5,
    offset_doubt: OffsetDoubt = 3.0,
    radius_doubt: RadiusDoubt = 0.3,
    plot: Annotated[
        Path | None, typer.Option(metavar="PNG", help="Draw residuals and parameters: .png, .svg or .pdf.")
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(metavar="TOML", help="Keep the result as a new profile; the old one stays."),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Write although held-out points are not predicted better.")
    ] = False,
    json_: Json = False,
) -> None:
    """Find pulleys, attachments, offsets and radius from measured nozzle points, with their doubts."""
    doubts = _doubts(pulley_doubt, attachment_doubt, offset_doubt, radius_doubt)
    _check(plot, write, noise)
    machine = open_machine(profile)
    fit = _fitted(machine, table, doubts, noise, free=frame == "free")
    if plot is not None:
        _draw(fit, f"{table}: {machine.machine.name}", plot)
    if not json_:
        _tell(fit, table)
    target = write or (None if json_ else _asked(fit))
    if target is not None:
        _keep(fit, table, profile, target, force)
    if json_:
        from cdhr_host.report.studies.told import fit_record

        record = fit_record(fit) | {"file": str(table), "profile": profile}
        emit(json.dumps(record | {"written": None if target is None else str(target)}))


def plan(  # noqa: PLR0917 -- options
    table: Annotated[
        Path,
        typer.Argument(metavar="CSV", help="Table to write, with columns to fill in.", show_default=False),
    ],
    profile: ProfileName = "paper",
    count: Annotated[int, typer.Option("--count", "-n", help="Poses.", min=FEWEST, max=500)] = 24,
    gcode: Annotated[
        Path | None, typer.Option(metavar="GCODE", help="Write the program that goes there, too.")
    ] = None,
    noise: Annotated[
        float, typer.Option(metavar="MM", help="Expected of a measured coordinate, one sigma.", min=1e-4)
    ] = 0.1,
    pulley_doubt: PulleyDoubt = 3.0,
    attachment_doubt: AttachmentDoubt = 0.5,
    offset_doubt: OffsetDoubt = 3.0,
    radius_doubt: RadiusDoubt = 0.3,
    pretend: Annotated[
        int | None,
        typer.Option(
            metavar="SEED", help="Fill in what a simulated machine, drawn from the doubts, measures.", min=0
        ),
    ] = None,
    json_: Json = False,
) -> None:
    """Propose the poses that tell most about the geometry, inside the workspace, in a short way round."""
    doubts = _doubts(pulley_doubt, attachment_doubt, offset_doubt, radius_doubt)
    for path, suffix, option in ((table, ".csv", "CSV"), (gcode, ".gcode", "--gcode")):
        if path is not None:
            check_file(path, [suffix], option)
            _keep_old(path)
    machine = open_machine(profile)
    with about(profile):
        from cdhr_host.report.studies.poses import planned, program, sheet

        poses = planned(machine, doubts, count, noise * MM)
    if len(poses.position_G) < FEWEST:
        found = len(poses.position_G)
        raise Refusal(
            f"{profile}: error: only {found} poses keep the force windows while moving, {FEWEST} are needed\n"
            "hint: a profile with wider windows, or lower limits.acceleration_max_mm_s2",
            5,
        )
    told = f"cdhr calibrate plan {table} --profile {profile} --count {count}"
    texts = [(table, "\n".join(sheet(poses, _pretended(machine, doubts, poses, noise * MM, pretend))))]
    if gcode is not None:
        texts.append((gcode, "\n".join(program(poses, told))))
    _put(texts)
    if json_:
        places = (poses.position_G / MM).tolist()
        emit(json.dumps({"profile": profile, "poses_mm": places, "slider_mm": (poses.slider / MM).tolist()}))
        return
    todo = "fill in what is measured, then" if pretend is None else "measured at a simulated machine; next:"
    emit(f"{table}: {len(poses.position_G)} poses; {todo} cdhr calibrate geometry")
    if gcode is not None:
        emit(f"{gcode}: goes there and waits at each; cdhr stream {gcode} --profile {profile}")


def _pretended(
    machine: "Profile", doubts: "Doubts", poses: "Poses", noise: float, seed: int | None
) -> "Array | None":
    """(N, 3) m that a machine drawn from the doubts has at these poses; nothing without a seed."""
    if seed is None:
        return None
    from cdhr_host.mechanism import Cables
    from cdhr_host.report.studies.trials import Trial, measured

    run_out = poses.slider[:, :3]
    return measured(Trial(seed, Cables.from_profile(machine), doubts, run_out, run_out[:0], noise))[1]


def _doubts(pulley: float, attachment: float, offset: float, radius: float) -> "Doubts":
    from cdhr_host.mechanism.calibration_model import Doubts

    return Doubts(*(size * MM for size in (pulley, attachment, offset, radius)))


def _check(plot: Path | None, write: Path | None, noise: float | None) -> None:
    """Refuse what could not be done in the end, before any work."""
    if noise is not None and noise <= 0.0:
        raise Refusal(f"cdhr: error: --noise {noise:g} must be above 0\nhint: leave it out to measure it")
    check_picture(plot, "--plot")
    if write is not None:
        check_file(write, [".toml"], "--write")
        _keep_old(write)


def _keep_old(path: Path) -> None:
    if path.exists():
        raise Refusal(f"cdhr: error: {path} exists\nhint: another name keeps both")


def _fitted(
    machine: "Profile", table: Path, doubts: "Doubts", noise: float | None, *, free: bool
) -> "GeometryFit":
    from cdhr_host.errors import MotionError
    from cdhr_host.report.studies.fit import fit, without_pose
    from cdhr_host.report.studies.points import read_points

    with about(str(table)):
        points, lines = read_points(table)
        if problems := without_pose(machine, points, lines):
            raise MotionError(problems)
        _enough(points)
        given = doubts.free_frame() if free else doubts
        return fit(machine, points, given, None if noise is None else noise * MM, free_frame=free)


def _enough(points: "Points") -> None:
    if len(points) < FEWEST:
        from cdhr_host.errors import Problem, ProfileError

        raise ProfileError(
            Problem(
                "missing",
                f"{len(points)} measured points are no calibration; {FEWEST} are the least, 20 are good",
                hint="cdhr calibrate plan proposes poses",
            )
        )


def _draw(fit: "GeometryFit", title: str, plot: Path) -> None:
    from cdhr_host.report.files import put
    from cdhr_host.report.studies.picture import draw

    with writing(plot), put(plot) as part:
        draw(fit, title, part)


def _tell(fit: "GeometryFit", table: Path) -> None:
    from cdhr_host.report.studies.told import fit_lines

    emit("\n".join([f"{table}: the machine, around {fit.profile.machine.name}", *fit_lines(fit)]))
    if fit.found.noise > SUSPICIOUS:
        say(f"doubt: no geometry brings the points nearer than {fit.found.noise / MM:.3g} mm a coordinate")
        say("hint: a camera's own frame needs --frame free; sliders are mm paid out from the reference pose")


def _asked(fit: "GeometryFit") -> Path | None:
    """At a terminal: where to keep the result, nothing for no."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        say("hint: keep this with --write mine.toml, then print with --profile mine.toml")
        return None
    if fit.judged and not fit.judged.better:
        return None
    answer = typer.prompt("Keep it as (a .toml path; Enter for no)", default="", show_default=False, err=True)
    if not answer.strip():
        return None
    target = Path(answer.strip())
    _check(None, target, None)
    return target


def _keep(fit: "GeometryFit", table: Path, profile: str, target: Path, force: bool) -> None:
    """The new profile, checked like any other before it is there."""
    from cdhr_host.cli.profiles import toml_lines
    from cdhr_host.pipeline import open_profile
    from cdhr_host.report.files import put
    from cdhr_host.report.studies.fit import calibrated_profile

    if fit.judged and not fit.judged.better and not force:
        raise Refusal(
            f"{table}: error: held-out points are predicted no better than by the drawing: not written\n"
            "hint: look at --plot and at the outliers; --force writes all the same",
            3,
        )
    head = f"# {profile}, calibrated: cdhr calibrate geometry {table}"
    text = "\n".join([head, *toml_lines(calibrated_profile(fit)), ""])
    with writing(target), put(target) as part:
        part.write_text(text, encoding="utf-8", newline="\n")
        with about(f"{target}, which is not written"):
            open_profile(str(part))
    say(f"{target}: written; print with --profile {target}")


def _put(texts: Sequence[tuple[Path, str]]) -> None:
    from cdhr_host.report.files import put

    for path, text in texts:
        with writing(path), put(path) as part:
            part.write_text(text + "\n", encoding="utf-8", newline="\n")
