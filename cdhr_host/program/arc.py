"""Arcs and helices in the plane of G17, G18 or G19 (G2, G3), by centre (I J K) or by radius (R).

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
from cdhr_host.program.modal import GRID_DIGITS, Modal, Point, Point2
from cdhr_host.program.run import Run, missing_feed
from cdhr_host.program.settings import PLANES
from cdhr_host.program.straight import LONGEST, laid, reach, row_of
from cdhr_host.units import MM
from cdhr_host.values import Arc, Plane

RADIUS_TOLERANCE: Final = 0.05 * MM
"""m by which the radii at start and end may differ"""
RADIUS_TOLERANCE_SHARE: Final = 1e-3
"""of the radius, where that is more"""
FULL_TURN_ANGLE: Final = 5e-7
"""rad; a smaller sweep is a full turn"""
PARTS: Final = 360
"""Chords that say what an arc of clay comes near to"""


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
    """G2 (clockwise) and G3, in the plane of G17, G18 or G19."""
    if run.unfed and "F" not in block:
        run.refuse(missing_feed(block.line, block.column))
    run.unfed = False
    digits = {word.letter: word.digits for word in block.words}
    steps, speed = run.step(row_of("G1", digits), block.line)
    before, end = run.modal.position, steps.modal.position
    plane = run.modal.plane
    start2, end2 = _seen(plane, before), _seen(plane, end)
    try:
        centre = _centre(block, run.modal, start2, end2)
        sweep = _sweep(start2, end2, centre, clockwise=block.code == "G2")
        _check_length(math.dist(start2, centre) * abs(sweep))
    except _NoArcError as refused:
        if refused.value is None or not run.lost:
            run.refuse(_problem(block, refused))
        run.modal = steps.modal
        return
    radius = sum(math.dist(at, centre) for at in (start2, end2)) / 2
    axis = plane.value[2]
    way = math.hypot(radius * sweep, end[axis] - before[axis])
    clay = laid(run.modal, float(steps.clay[0]), "E" in block, way, (before[2], end[2]))
    air = run.modal.air
    run.modal = steps.modal
    made = Arc(block.line, np.array(before), np.array(end), np.array(centre), sweep, speed, clay, air, plane)
    if clay > 0.0 or air > 0.0:
        top, near = _reach(made)
        run.modal = replace(run.modal, top=max(run.modal.top, top), near=min(run.modal.near, near))
    run.emit(made)


def _seen(plane: Plane, point: Point) -> Point2:
    """A point on the two axes of a plane."""
    first, second, _ = plane.value
    return point[first], point[second]


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


def _centre(block: Block, modal: Modal, start: Point2, end: Point2) -> Point2:
    """m; raises _NoArcError when there is none."""
    first, second, along = modal.plane.value
    letters = "IJK"[first], "IJK"[second]
    names = " ".join(sorted(letters))
    if "IJK"[along] in block:
        code = next(code for code, plane in PLANES.items() if plane is modal.plane)
        raise _NoArcError(
            f"{block.code} has no word {'IJK'[along]} in the plane of {code}", f"the centre is {names} there"
        )
    by_offset = letters[0] in block or letters[1] in block
    if by_offset and "R" in block:
        raise _NoArcError(f"{block.code} has both a centre ({names}) and a radius (R)", "give one of them")
    if "R" in block:
        return _centre_by_radius(block, modal, start, end)
    if not by_offset:
        hint = f"give {' and '.join(sorted(letters))}, from the start to the centre, or R"
        raise _NoArcError(f"{block.code} has no centre", hint)
    centre = (
        round(start[0] + block.get(letters[0]) * modal.unit, GRID_DIGITS),
        round(start[1] + block.get(letters[1]) * modal.unit, GRID_DIGITS),
    )
    _check_radii(math.dist(start, centre), math.dist(end, centre))
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


def _check_length(length: float) -> None:
    if length > LONGEST:
        raise _NoArcError(
            f"the arc is {length:.4g} m long", f"arcs may be {LONGEST:g} m long; is the centre right?"
        )


def _centre_by_radius(block: Block, modal: Modal, start: Point2, end: Point2) -> Point2:
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


def _sweep(start: Point2, end: Point2, centre: Point2, *, clockwise: bool) -> float:
    """rad, negative when clockwise."""
    angle = math.atan2(end[1] - centre[1], end[0] - centre[0])
    angle -= math.atan2(start[1] - centre[1], start[0] - centre[0])
    turn = (-angle if clockwise else angle) % math.tau
    if turn <= FULL_TURN_ANGLE or start == end:
        turn = math.tau
    return -turn if clockwise else turn


def _reach(made: Arc) -> tuple[float, float]:
    """m: a height that the arc does not pass, and a distance to the reference axis that it keeps.

    Worked out from PARTS chords, whose sagitta is added and taken off.
    """
    first, second, along = made.plane.value
    start, end = (np.array(_seen(made.plane, tuple(at.tolist()))) for at in (made.start_G, made.end_G))
    radii = [math.dist(at, made.centre_G) for at in (start, end)]
    u = np.arange(PARTS + 1) / PARTS
    angle = math.atan2(*(start - made.centre_G)[::-1]) + made.sweep * u
    radius = radii[0] + (radii[1] - radii[0]) * u
    points = np.empty((PARTS + 1, 3))
    points[:, first] = made.centre_G[0] + radius * np.cos(angle)
    points[:, second] = made.centre_G[1] + radius * np.sin(angle)
    points[:, along] = made.start_G[along] + (made.end_G[along] - made.start_G[along]) * u
    sagitta = max(radii) * (1.0 - math.cos(made.sweep / PARTS / 2))
    return reach(points, 0.0 if made.plane is Plane.XY else sagitta, sagitta)
