"""What a link refuses before it accepts anything."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdhr_host.errors import DriveError, Problem
from cdhr_host.profile.schema import Profile
from cdhr_host.units import KPA, MM
from cdhr_host.values import Array, Setpoints

STANDS_WITHIN: Final = 50e-6
"""m between where sliders stand and where a run begins"""
ROUNDING: Final = 1e-9
"""relative excess over a limit that is only rounding"""
REPLAN = "this is a mistake in planning: keep the program and report it"


def check_standing(start: Array, slider: Array) -> None:
    """(6,) m asked, (6,) m measured: DriveError unless the sliders stand there."""
    if start.shape != (6,) or not np.isfinite(start).all():
        raise DriveError(Problem("arm", f"the start must be six finite slider positions, not {start}"))
    away = np.abs(start - slider)
    axis = int(away.argmax())
    if away[axis] > STANDS_WITHIN:
        raise DriveError(
            Problem(
                "arm",
                f"slider {axis + 1} stands at {slider[axis] / MM:.4f} mm, the run begins at "
                f"{start[axis] / MM:.4f} mm (limit {STANDS_WITHIN / MM:.3f} mm apart)",
                value=float(away[axis] / MM),
                limit=STANDS_WITHIN / MM,
                unit="mm",
                hint="reference the machine (G28 in the jog console) before the run",
            )
        )


def check_rows(
    rows: Setpoints, profile: Profile, *, tick: int | None, before: Array, reach: float | None
) -> None:
    """Refuse rows that the drives must not get.

    ``tick`` is the one expected next (None: any), ``before`` (6,) m the last setpoint, and
    ``reach`` m what the first row may be away from it (None: what the speed limit allows).
    Raises DriveError with one problem per kind, each at its first row.
    """
    check_shapes(rows)
    problems = list(_numbers(rows)) or [
        *_order(rows, tick),
        *_travel(rows, profile),
        *_steps(rows, profile, before, reach),
        *_air(rows, profile),
    ]
    if problems:
        raise DriveError(problems)


def check_shapes(rows: Setpoints) -> None:
    """DriveError unless every column has one entry a row."""
    count = len(rows)
    shapes = {"slider": (count, 6), "tension": (count, 6), "pressure": (count,), "line": (count,)}
    for name, shape in shapes.items():
        if getattr(rows, name).shape != shape:
            found = getattr(rows, name).shape
            raise DriveError(Problem("shape", f"{name} has shape {found}, not {shape}", hint=REPLAN))


def _first(mask: NDArray[np.bool_]) -> int | None:
    """Index of the first row in which something is true."""
    bad = np.flatnonzero(mask.reshape(len(mask), -1).any(axis=1))
    return int(bad[0]) if len(bad) else None


def _place(rows: Setpoints, row: int) -> str:
    return f"at tick {rows.tick[row]}"


def _numbers(rows: Setpoints) -> Iterator[Problem]:
    for name in ("slider", "tension", "pressure"):
        values = getattr(rows, name)
        if (row := _first(~np.isfinite(values))) is not None:
            message = f"{name} {_place(rows, row)} is not a finite number: {values[row]}"
            yield Problem("not-finite", message, line=int(rows.line[row]), hint=REPLAN)


def _order(rows: Setpoints, tick: int | None) -> Iterator[Problem]:
    first = int(rows.tick[0]) if tick is None else tick
    expected = first + np.arange(len(rows))
    row = 0 if first < 0 else _first(rows.tick != expected)
    if row is not None:
        message = f"tick {rows.tick[row]} came where tick {max(expected[row], 0)} is due"
        yield Problem("order", message, line=int(rows.line[row]), hint=REPLAN)


def _travel(rows: Setpoints, profile: Profile) -> Iterator[Problem]:
    low, high = profile.sliders.travel_min, profile.sliders.travel_max
    beyond = (rows.slider < low) | (rows.slider > high)
    if (row := _first(beyond)) is not None:
        axis = int(beyond[row].argmax())
        value = rows.slider[row, axis]
        limit = low if value < low else high
        yield Problem(
            "travel",
            f"slider {axis + 1} {_place(rows, row)}: {value / MM:.3f} mm is beyond its travel "
            f"of {low / MM:.1f} to {high / MM:.1f} mm",
            line=int(rows.line[row]),
            value=float(value / MM),
            limit=limit / MM,
            unit="mm",
            hint="keep the part nearer to the reference pose, or correct [sliders] in the profile",
        )


def _steps(rows: Setpoints, profile: Profile, before: Array, reach: float | None) -> Iterator[Problem]:
    period = profile.drives.period
    step = np.abs(np.diff(rows.slider, axis=0, prepend=before[None]))
    allowed = np.full(len(rows), profile.sliders.speed_max * period * (1.0 + ROUNDING))
    if reach is not None:
        allowed[0] = reach
    if (row := _first(step > allowed[:, None])) is not None:
        axis = int(step[row].argmax())
        yield Problem(
            "slider-speed",
            f"slider {axis + 1} {_place(rows, row)}: a step of {step[row, axis] / MM:.4f} mm in a tick "
            f"of {period * 1e3:g} ms (limit {allowed[row] / MM:.4f} mm)",
            line=int(rows.line[row]),
            value=float(step[row, axis] / MM),
            limit=float(allowed[row] / MM),
            unit="mm",
            hint=REPLAN,
        )


def _air(rows: Setpoints, profile: Profile) -> Iterator[Problem]:
    high = profile.extruder.pressure_max * (1.0 + ROUNDING)
    if (row := _first((rows.pressure < 0.0) | (rows.pressure > high))) is not None:
        yield Problem(
            "pressure",
            f"pressure {_place(rows, row)}: {rows.pressure[row] / KPA:.2f} kPa is not within "
            f"0 to {profile.extruder.pressure_max / KPA:g} kPa",
            line=int(rows.line[row]),
            value=float(rows.pressure[row] / KPA),
            limit=profile.extruder.pressure_max / KPA,
            unit="kPa",
            hint=REPLAN,
        )
