"""The columns of logs: what each is called, its unit, and where its numbers come from."""

import numpy as np

from cdhr_host.units import KPA, MM, MM3
from cdhr_host.values import Array, Feedback, Ints, Setpoints

Column = Array | Ints
AXES = range(1, 7)

SETPOINT_COLUMNS: tuple[str, ...] = (
    "t_s",
    "line",
    *(f"{axis}_mm" for axis in "xyzuvw"),
    *(f"slider{i}_mm" for i in AXES),
    *(f"tension{i}_n" for i in AXES),
    "flow_mm3_s",
    "pressure_kpa",
)
"""Every log begins with these, in this order."""

FEEDBACK_COLUMNS: tuple[str, ...] = (
    *(f"slider{i}_actual_mm" for i in AXES),
    *(f"slider{i}_error_mm" for i in AXES),
    *(f"slider{i}_counts" for i in AXES),
    *(f"torque{i}_nm" for i in AXES),
    "pressure_actual_kpa",
    "deposited_mm3_s",
)
"""A run's log goes on with these: what came back, setpoint minus measured slider, and the clay that
left the nozzle, NaN where the far side does not simulate it."""


def spread(names: str, rows: Column, unit: float = 1.0) -> dict[str, Column]:
    """(N, k) -> k columns; ``{}`` in ``names`` counts from 1."""
    values = rows / unit if unit != 1.0 else rows
    return {names.format(i + 1): values[:, i] for i in range(rows.shape[1])}


def setpoint_columns(setpoints: Setpoints) -> dict[str, Column]:
    """Setpoints -> {column: (N,)} in the log's units and order."""
    nozzle, upper = setpoints.nozzle_G / MM, setpoints.upper / MM
    return {
        "t_s": setpoints.t,
        "line": setpoints.line,
        **{f"{axis}_mm": nozzle[:, k] for k, axis in enumerate("xyz")},
        **{f"{axis}_mm": upper[:, k] for k, axis in enumerate("uvw")},
        **spread("slider{}_mm", setpoints.slider, MM),
        **spread("tension{}_n", setpoints.tension),
        "flow_mm3_s": setpoints.flow / MM3,
        "pressure_kpa": setpoints.pressure / KPA,
    }


def run_columns(setpoints: Setpoints, feedback: Feedback) -> dict[str, Column]:
    """Setpoints and the feedback of the same ticks -> {column: (N,)}."""
    if not np.array_equal(setpoints.tick, feedback.tick):
        raise ValueError("setpoints and feedback are of different ticks")
    return {
        **setpoint_columns(setpoints),
        **spread("slider{}_actual_mm", feedback.slider, MM),
        **spread("slider{}_error_mm", setpoints.slider - feedback.slider, MM),
        **spread("slider{}_counts", feedback.counts),
        **spread("torque{}_nm", feedback.torque),
        "pressure_actual_kpa": feedback.pressure / KPA,
        "deposited_mm3_s": feedback.deposited / MM3
        if len(feedback.deposited)
        else np.full(len(feedback), np.nan),
    }
