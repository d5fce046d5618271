"""Whether the far side executed what it was sent."""

from typing import Final

import numpy as np

from cdhr_host.drives.link import MachineLink
from cdhr_host.drives.rows import RowQueue
from cdhr_host.errors import DriveError, Problem
from cdhr_host.units import MM
from cdhr_host.values import Feedback, Setpoints

ROUNDED: Final = 0.5 + 1e-4
"""of the resolution: what rounding to the nearest may change"""


def check_echo(rows: Setpoints, feedback: Feedback, resolution: float) -> None:
    """DriveError unless the far side received exactly the rows sent, rounded to ``resolution`` m."""
    away = np.abs(feedback.setpoint - rows.slider)
    other = (away > resolution * ROUNDED).any(axis=1) | (feedback.tick != rows.tick)
    if not other.any():
        return
    row = int(other.argmax())
    axis = int(away[row].argmax())
    sent, executed = rows.slider[row, axis] / MM, feedback.setpoint[row, axis] / MM
    raise DriveError(
        Problem(
            "echo",
            f"the drives executed slider {axis + 1} = {executed:.6f} mm at tick {feedback.tick[row]}, "
            f"sent was {sent:.6f} mm for tick {rows.tick[row]}",
            line=int(rows.line[row]),
            hint="the link between host and drives corrupts data: check cables and firmware",
        )
    )


def expect_stop(sent: RowQueue, link: MachineLink) -> bool:
    """Once a link stops by itself, expect the stop's rows instead of those sent; whether that is so."""
    if link.stop_tick is None or not len(sent):
        return False
    rows = sent.take(len(sent))
    as_sent = int(np.searchsorted(rows.tick, link.stop_tick))
    sent.append(rows[:as_sent])
    sent.append(link.stop_rows(rows[as_sent:]))
    return True
