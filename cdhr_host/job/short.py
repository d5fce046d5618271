"""Short texts and straight ways, proven tick by tick before they move."""

import math
from typing import Final

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.pipeline import Staircase
from cdhr_host.pipeline.course import UNBOUNDED, Course
from cdhr_host.pipeline.tape import Tape
from cdhr_host.units import MINUTE, MM
from cdhr_host.values import Array, ToolTrack

SPACING: Final = 2 * MM
"""m between two places that are looked at for a limit"""
SHORTER: Final = 0.95
"""of a way that cannot be run to its limit, tried next"""
TRIES: Final = 40
"""how often"""


def proven(machine: Staircase, text: str) -> Course:
    """A course of a text; the machine's modal state goes on, and stays as it was if it is refused.

    Raises ProgramError, MotionError.
    """
    before = machine.modal
    commands = list(machine.commands([text.encode()]))
    try:
        trial = Course(machine.fork(), Tape(iter(commands)))
        trial.plan(UNBOUNDED)
        if trial.staircase.tick > machine.tick:
            trial.rows(machine.tick, trial.staircase.tick)
    except BaseException:
        machine.restore(before)
        raise
    return Course(machine.fork(), Tape(iter(commands)))


def straight(machine: Staircase, way: Array, speed: float) -> Course:
    """A straight move by (3,) m at m/s, modes staying as they are. Raises MotionError."""
    return through(machine, (machine.standing_G + way)[None], speed)


def through(machine: Staircase, places_G: Array, speed: float) -> Course:
    """Straight moves through (N, 3) m, modes staying as they are. Raises MotionError."""
    lines = [f"G1 X{x:.9f} Y{y:.9f} Z{z:.9f} F{speed / MM * MINUTE:.6f}" for x, y, z in places_G / MM]
    return proven(machine.apart(), "\n".join(["G21", "G90", *lines, ""]))


def furthest(machine: Staircase, direction: Array, speed: float) -> tuple[Course | None, Problem]:
    """The longest straight way along (3,), and the limit that ends it; no course where it stands there."""
    length, limit = _reach(machine, direction)
    for _ in range(TRIES):
        if length < SPACING:
            return None, limit
        try:
            return straight(machine, length * direction, speed), limit
        except MotionError as error:
            limit = error.problems[0]
            length *= SHORTER
    return None, limit


def _reach(machine: Staircase, direction: Array) -> tuple[float, Problem]:
    """m that the nozzle could stand along a direction, short of the first place it could not."""
    bed = machine.profile.bed
    count = math.ceil((2.0 * bed.radius + bed.height) / SPACING) + 2
    number = np.arange(count)
    places = machine.standing_G + SPACING * number[:, None] * direction
    still, nothing = np.zeros_like(places), np.zeros(count)
    track = ToolTrack(number, number, places, still, still, nothing, nothing)
    found = machine.apart().checked(track).problems
    first = min(found, key=lambda problem: problem.line or 0)
    return SPACING * max((first.line or 0) - 1, 0), first
