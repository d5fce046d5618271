"""What a far side watches while it executes: following error and torque."""

import numpy as np

from cdhr_host.errors import DriveError, Problem
from cdhr_host.profile.schema import Drives
from cdhr_host.units import MM
from cdhr_host.values import Array, Feedback, Setpoints


def first_fault(rows: Setpoints, feedback: Feedback, drives: Drives) -> tuple[int, DriveError] | None:
    """N executed rows -> index of the first one out of its windows, and the fault; None if all are in."""
    away = np.abs(feedback.slider - feedback.setpoint)
    load = np.abs(feedback.torque)
    bad = (away > drives.following_error_max) | (load > drives.torque_max)
    if not bad.any():
        return None
    row = int(np.flatnonzero(bad.any(axis=1))[0])
    if (away[row] > drives.following_error_max).any():
        return row, _following(rows, row, away[row], drives.following_error_max)
    return row, _overload(rows, row, load[row], drives.torque_max)


def _following(rows: Setpoints, row: int, away: Array, limit: float) -> DriveError:
    axis = int(away.argmax())
    return DriveError(
        Problem(
            "following-error",
            f"slider {axis + 1} is {away[axis] / MM:.3f} mm away from its setpoint at tick "
            f"{rows.tick[row]} (limit {limit / MM:g} mm)",
            line=int(rows.line[row]),
            value=float(away[axis] / MM),
            limit=limit / MM,
            unit="mm",
            hint=f"free slider {axis + 1}, check its cable and coupling, reference the machine again",
        )
    )


def _overload(rows: Setpoints, row: int, load: Array, limit: float) -> DriveError:
    axis = int(load.argmax())
    return DriveError(
        Problem(
            "torque",
            f"motor {axis + 1} needs {load[axis]:.3f} N m at tick {rows.tick[row]} (limit {limit:g} N m)",
            line=int(rows.line[row]),
            value=float(load[axis]),
            limit=limit,
            unit="N m",
            hint=f"check cable {axis + 1} for an obstacle and the profile's [drives] torque_max_nm",
        )
    )


def underrun(tick: int, line: int) -> DriveError:
    """The buffer came down to the stop's reserve while moving, or ran dry with the air on."""
    return DriveError(
        Problem(
            "underrun",
            f"no setpoints in time for tick {tick}: the buffer ran dry while the machine was at work",
            line=line,
            hint="the computer was too slow or too busy; close other programs",
        )
    )
