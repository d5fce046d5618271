"""Curves in the XY plane: cubic (G5) and quadratic (G5.1), as LinuxCNC has them.

I J is the offset from the start to the first control point, P Q that from the end to the
second. A G5 without I J goes on from the G5 before it, as if its I J were that one's -P -Q;
words that draw nothing may stand between. A quadratic is the cubic whose control points lie
two thirds of the way to its own.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from cdhr_host.errors import Problem
from cdhr_host.program.block import Block
from cdhr_host.program.modal import Modal, Point, Point2
from cdhr_host.program.run import Run, missing_feed
from cdhr_host.program.straight import LONGEST, laid, reach, row_of
from cdhr_host.values import Array, Plane, Prime, Spline

PARTS: Final = 256
"""Chords that say what a curve of clay comes near to"""


class _NoCurveError(Exception):
    """The words do not make a curve."""

    def __init__(self, message: str, hint: str, *, letter: str = "", follows: bool = False) -> None:
        super().__init__(message)
        self.hint = hint
        self.letter = letter
        self.follows = follows
        """the lines before are to blame when one of them was refused"""


def cubic(run: Run, block: Block) -> None:
    """G5."""
    _curve(run, block, _cubic)
    leaving = _offset(block, run.modal, "PQ")
    run.modal = replace(run.modal, onward=(-leaving[0], -leaving[1]))


def quadratic(run: Run, block: Block) -> None:
    """G5.1."""
    _curve(run, block, _quadratic)


def _curve(run: Run, block: Block, control_of: Callable[[Block, Modal, Point], Array]) -> None:
    """Draw the curve with the control points of a block, the modal state before it and its end."""
    if run.unfed and "F" not in block:
        run.refuse(missing_feed(block.line, block.column))
    run.unfed = False
    digits = {word.letter: word.digits for word in block.words}
    steps, speed = run.step(row_of("G1", digits), block.line)
    before, run.modal = run.modal, steps.modal
    try:
        _check_plane(block, before.plane)
        control = control_of(block, before, steps.modal.position)
        _check_length(control)
    except _NoCurveError as refused:
        if not (refused.follows and run.lost):
            run.refuse(_problem(block, refused))
        return
    z = before.position[2]
    clay = laid(before, float(steps.clay[0]), "E" in block, _length(control), (z, z))
    made = Spline(block.line, control, speed, clay, before.air)
    if (control != control[0]).any():
        _draw(run, made)
    elif made.clay > 0.0:
        run.emit(Prime(block.line, made.clay, before.flow(float(steps.feed[0]))))


def _draw(run: Run, made: Spline) -> None:
    if made.clay > 0.0 or made.air > 0.0:
        top, near = _reach(made.control_G)
        run.modal = replace(run.modal, top=max(run.modal.top, top), near=min(run.modal.near, near))
    run.emit(made)


def _check_plane(block: Block, plane: Plane) -> None:
    if "Z" in block:
        hint = "move Z in a line of its own, or draw a helix with G2 or G3"
        raise _NoCurveError(f"{block.code} has no word Z: curves lie in the XY plane", hint, letter="Z")
    if plane is not Plane.XY:
        raise _NoCurveError(f"{block.code} lies in the XY plane only", f"write G17 before {block.code}")


def _check_length(control: Array) -> None:
    length = sum(math.dist(a, b) for a, b in pairwise(control.tolist()))
    if length > LONGEST:
        hint = f"curves may be {LONGEST:g} m long; I J and P Q count from the start and the end"
        raise _NoCurveError(f"the curve's control points are {length:.4g} m apart", hint)


def _cubic(block: Block, before: Modal, end: Point) -> Array:
    given = [letter for letter in "IJ" if letter in block]
    if len(given) == 1:
        hint = "give I and J both, or neither to go on from the G5 before"
        raise _NoCurveError(f"{block.code} has {given[0]} alone", hint, letter=given[0])
    entering = _offset(block, before, "IJ") if given else before.onward
    if entering is None:
        hint = "give I and J, from the start to the first control point"
        raise _NoCurveError(f"{block.code} without I and J follows no G5", hint, follows=True)
    return _between(before.position, entering, _offset(block, before, "PQ"), end)


def _quadratic(block: Block, before: Modal, end: Point) -> Array:
    i, j = _offset(block, before, "IJ")
    if i == j == 0.0:
        hint = "give I and J, from the start to the control point"
        raise _NoCurveError(f"{block.code} has no control point", hint)
    start, share = before.position, 2 / 3
    back = share * (start[0] + i - end[0]), share * (start[1] + j - end[1])
    return _between(start, (share * i, share * j), back, end)


def _offset(block: Block, modal: Modal, letters: str) -> Point2:
    """m, 0 for a letter that is not there."""
    return block.get(letters[0]) * modal.unit, block.get(letters[1]) * modal.unit


def _between(start: Point, entering: Point2, leaving: Point2, end: Point) -> Array:
    """(4, 3) m: control points by their offsets from the start and from the end."""
    first = (start[0] + entering[0], start[1] + entering[1], start[2])
    second = (end[0] + leaving[0], end[1] + leaving[1], end[2])
    return np.array([start, first, second, end])


def _length(control: Array) -> float:
    """m, of PARTS chords."""
    return float(np.linalg.norm(np.diff(_points(control), axis=0), axis=1).sum())


def _points(control: Array) -> Array:
    """(PARTS + 1, 3) m, evenly by the parameter."""
    t = np.arange(PARTS + 1)[:, None] / PARTS
    u = 1.0 - t
    points: Array = (
        u**3 * control[0] + 3 * u**2 * t * control[1] + 3 * u * t**2 * control[2] + t**3 * control[3]
    )
    return points


def _reach(control: Array) -> tuple[float, float]:
    """m: the top of a curve, and a distance to the reference axis that it keeps.

    A chord over 1/n of the parameter is off by |B''| / (8 n²) at most, and |B''| is greatest
    at an end.
    """
    bend = 6 * np.hypot(*np.diff(control, 2, axis=0)[:, :2].T).max()
    return reach(_points(control), 0.0, float(bend) / (8 * PARTS**2))


def _problem(block: Block, refused: _NoCurveError) -> Problem:
    at = block.word(refused.letter) if refused.letter else None
    column = block.column if at is None else at.column
    return Problem("curve", str(refused), block.line, column, hint=refused.hint)
