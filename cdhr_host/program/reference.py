"""G28: the machine as a whole goes to its reference pose, never blindly through clay."""

import math
from dataclasses import replace

import numpy as np

from cdhr_host.program.block import Block
from cdhr_host.program.modal import Point
from cdhr_host.program.run import Run
from cdhr_host.units import MM
from cdhr_host.values import Moves, Stop


def reference(run: Run, block: Block) -> None:
    """Rest, then up, across and down to program (0, 0, 0), then rest.

    Once clay has been laid the way across is ``bed.clear_height`` above it, and the nozzle
    stays up there when clay is nearer to the reference axis than ``bed.clear_radius``.
    Afterwards the modal position is where the nozzle is, and G92 offsets are gone.
    """
    run.emit(Stop(block.line))
    modal, bed = run.modal, run.profile.bed
    height = max(modal.position[2], 0.0)
    if modal.top > -math.inf:
        height = max(height, modal.top + bed.clear_height)
    blocked = height > 0.0 and modal.near <= bed.clear_radius
    if blocked:
        run.warn(
            "reference",
            block.line,
            f"{block.code} stays {(height - modal.top) / MM:g} mm above the print: clay is "
            f"{modal.near / MM:.4g} mm from the reference axis, less than {bed.clear_radius / MM:g} mm",
        )
    x, y, _ = modal.position
    way = [(x, y, height), (0.0, 0.0, height)] + ([] if blocked else [(0.0, 0.0, 0.0)])
    _travel(run, block.line, way)
    run.modal = replace(run.modal, position=way[-1], offset=(0.0, 0.0, 0.0), onward=None)
    run.lost = False


def _travel(run: Run, line: int, way: list[Point]) -> None:
    """Straight moves at the machine's greatest speed, those of no length left out."""
    points = [run.modal.position]
    for point in way:
        if point != points[-1]:
            points.append(point)
    count = len(points) - 1
    if count:
        run.emit(
            Moves(
                np.full(count, line, dtype=np.int64),
                np.array(points[0]),
                np.array(points[1:]),
                np.full(count, run.profile.limits.speed_max),
                np.zeros(count),
                np.zeros(count),
            ),
            Stop(line),
        )
