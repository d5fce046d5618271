"""Arcs and helices in the XY plane (G2, G3), by centre (I J) or by radius (R).

The centre is exact for the start, the end is the programmed one, and the sweep is the angle
between them seen from the centre; where the two radii differ by the rounding of the file the
radius goes evenly from one to the other along the sweep, as LinuxCNC does. An end in the
start's direction, within 5e-7 rad, is a full turn, as grbl has it.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from cdhr_host.errors import Problem
from cdhr_host.program.block import Block
from cdhr_host.program.modal import GRID_DIGITS, Modal
from cdhr_host.program.run import Run, missing_feed
from cdhr_host.program.straight import row_of
from cdhr_host.units import MM
from cdhr_host.values import Arc

RADIUS_TOLERANCE: Final = 0.05 * MM
"""m by which the radii at start and end may differ"""
RADIUS_TOLERANCE_SHARE: Final = 1e-3
"""of the radius, where that is more"""
FULL_TURN_ANGLE: Final = 5e-7
"""rad; a smaller sweep is a full turn"""

Point2 = tuple[float, float]


class _NoArcError(Exception):
    """The words do not make an arc."""

    def __init__(
        self, message: str, hint: str, value: float | None = None, limit: float | None = None
    ) -> None:
        super().__init__(message)
        self.hint = hint
        self.value = value
        self.limit = limit


def arc(run: Run, block: Block) -> None:
    """G2 (clockwise) and G3."""
    if run.unfed and "F" not in block:
        run.refuse(missing_feed(block.line, block.column))
    run.unfed = False
    digits = {word.letter: word.digits for word in block.words}
    steps, speed = run.step(row_of("G1", digits), block.line)
    before, end = run.modal.position, steps.modal.position
    try:
        centre = _centre(block, run.modal, before, end)
    except _NoArcError as refused:
        if refused.value is None or not run.lost:
            run.refuse(_problem(block, refused))
        run.modal = steps.modal
        return
    sweep = _sweep(before, end, centre, clockwise=block.code == "G2")
    clay, air = float(steps.clay[0]), run.modal.air
    run.modal = steps.modal
    if clay > 0.0 or air > 0.0:
        near = min(run.modal.near, _axis_distance(before, end, centre, sweep))
        run.modal = replace(run.modal, top=max(run.modal.top, before[2], end[2]), near=near)
    run.emit(
        Arc(block.line, np.array(before), np.array(end), np.array(centre), sweep, speed, clay, air),
    )


def _problem(block: Block, refused: _NoArcError) -> Problem:
    return Problem(
        "arc",
        str(refused),
        block.line,
        block.column,
        value=refused.value,
        limit=refused.limit,
        unit=None if refused.value is None else "mm",
        hint=refused.hint,
    )


def _centre(block: Block, modal: Modal, start: tuple[float, ...], end: tuple[float, ...]) -> Point2:
    """m; raises _NoArcError when there is none."""
    by_offset = "I" in block or "J" in block
    if by_offset and "R" in block:
        raise _NoArcError(f"{block.code} has both a centre (I J) and a radius (R)", "give one of them")
    if "R" in block:
        return _centre_by_radius(block, modal, start, end)
    if not by_offset:
        raise _NoArcError(f"{block.code} has no centre", "give I and J, from the start to the centre, or R")
    centre = (
        round(start[0] + block.get("I") * modal.unit, GRID_DIGITS),
        round(start[1] + block.get("J") * modal.unit, GRID_DIGITS),
    )
    _check_radii(math.dist(start[:2], centre), math.dist(end[:2], centre))
    return centre


def _tolerance(radius: float) -> float:
    return max(RADIUS_TOLERANCE, RADIUS_TOLERANCE_SHARE * radius)


def _check_radii(at_start: float, at_end: float) -> None:
    if at_start == 0.0:
        raise _NoArcError("the arc's centre is its start: the radius is 0", "I and J count from the start")
    apart, limit = abs(at_end - at_start), _tolerance(at_start)
    if apart > limit:
        raise _NoArcError(
            f"the arc's radius is {at_start / MM:.4f} mm at its start and {at_end / MM:.4f} mm at its end",
            f"they may differ by {limit / MM:.4g} mm; I and J count from the start, also after G90",
            apart / MM,
            limit / MM,
        )


def _centre_by_radius(block: Block, modal: Modal, start: tuple[float, ...], end: tuple[float, ...]) -> Point2:
    """R > 0 is the arc of up to half a turn, R < 0 the longer one."""
    radius = block.get("R") * modal.unit
    dx, dy = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(dx, dy)
    if chord == 0.0:
        raise _NoArcError("a full circle cannot be given by its radius", "give its centre with I and J")
    if chord / 2 > abs(radius) + _tolerance(abs(radius)):
        raise _NoArcError(
            f"the arc's end is {chord / MM:.4f} mm from its start, more than twice its radius "
            f"of {abs(radius) / MM:.4f} mm",
            "give a greater R, or the centre with I and J",
            chord / MM,
            2 * abs(radius) / MM,
        )
    rise = math.sqrt(max(radius**2 - chord**2 / 4, 0.0))
    side = rise if (block.code == "G3") == (radius > 0) else -rise
    return (start[0] + dx / 2 - side * dy / chord, start[1] + dy / 2 + side * dx / chord)


def _sweep(start: tuple[float, ...], end: tuple[float, ...], centre: Point2, *, clockwise: bool) -> float:
    """rad, negative when clockwise."""
    angle = math.atan2(end[1] - centre[1], end[0] - centre[0])
    angle -= math.atan2(start[1] - centre[1], start[0] - centre[0])
    turn = (-angle if clockwise else angle) % math.tau
    if turn <= FULL_TURN_ANGLE or math.dist(start[:2], end[:2]) == 0.0:
        turn = math.tau
    return -turn if clockwise else turn


def _axis_distance(start: tuple[float, ...], end: tuple[float, ...], centre: Point2, sweep: float) -> float:
    """m from the reference axis (x = y = 0) to the arc, or a little less."""
    to_axis = math.atan2(-centre[1], -centre[0])
    first = math.atan2(start[1] - centre[1], start[0] - centre[0])
    ahead = (math.copysign(1.0, sweep) * (to_axis - first)) % math.tau
    nearest = min(math.hypot(*start[:2]), math.hypot(*end[:2]))
    if ahead > abs(sweep):
        return nearest
    middle = math.hypot(*centre)
    radii = (math.dist(start[:2], centre), math.dist(end[:2], centre))
    return min(nearest, *(abs(middle - radius) for radius in radii))
