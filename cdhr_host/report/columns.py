"""The columns of a run's log: the setpoint log's, then what came back from the drives."""

import numpy as np

from cdhr_host.pipeline.columns import AXES, SETPOINT_COLUMNS, Column, setpoint_columns, spread
from cdhr_host.units import KPA, MM, MM3
from cdhr_host.values import Feedback, Setpoints

__all__ = ["FEEDBACK_COLUMNS", "SETPOINT_COLUMNS", "Column", "run_columns", "setpoint_columns"]

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
