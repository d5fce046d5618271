"""One slider moved alone, for commissioning: proven before it moves, its forces watched while it does."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from cdhr_host.errors import JobError, MotionError, Problem
from cdhr_host.job.player import Kind, Player
from cdhr_host.job.tension_guard import TensionGuard
from cdhr_host.mechanism import UpperMotion
from cdhr_host.motion.playback import Beat
from cdhr_host.pipeline import Staircase
from cdhr_host.pipeline.course import UNBOUNDED, Course, Placed, Stop
from cdhr_host.pipeline.shift import played_shift
from cdhr_host.pipeline.slide import slide
from cdhr_host.pipeline.tape import Tape
from cdhr_host.units import MM
from cdhr_host.values import Array, Feedback, Ints, Setpoints, ToolTrack

FURTHEST: Final = 1 * MM
"""m that a slider is moved at a time"""
ROUNDING: Final = 1e-9
GUARD: Final = "the tension guard refuses: nothing moved; jog the nozzle elsewhere, or move another slider"


class Slide(Course):
    """A course without a text: both platforms on their way while one slider moves."""

    def __init__(self, machine: Staircase, motions: tuple[UpperMotion, UpperMotion]) -> None:
        """``motions`` as ``slide`` gives them, from where the machine stands."""
        super().__init__(machine, Tape(iter(())))
        self._shift = machine.moved(*motions)

    def unshaped(self, tick: Ints, u: Array) -> ToolTrack:
        """(N,) ticks to be named by, (N,) ticks of the plan -> the nozzle."""
        as_planned = Beat(u, np.ones(len(u)), np.zeros(len(u)))
        return played_shift(self._shift, tick, as_planned, self.staircase.period).track

    def _planned(self, *, opens: bool) -> Iterator[Placed]:  # noqa: ARG002 - nothing to open
        yield from self._place(iter([self._shift]))
        self.stops.append(Stop(self.staircase.tick, None))


class Sliding:
    """Single sliders' steps; in the printer's thread."""

    def __init__(self, player: Player, tell: Callable[[str], None]) -> None:
        """``tell`` hears where the nozzle goes."""
        self._player = player
        self._tell = tell
        self._guard: TensionGuard | None = None
        self._found: Problem | None = None
        player.observers.append(self._executed)

    def begin(self, axis: int, distance: float) -> bool:
        """Begin to move slider ``axis`` (0 ... 5) by m; True. Raises MotionError for what is not safe."""
        player = self._player
        way = np.zeros(6)
        way[axis] = distance
        course = proven(player.staircase, player.feeder.slider, way)
        before = player.staircase.standing_G
        player.play(course)
        self._guard, self._found = TensionGuard(player.profile), None
        self._tell(_told(axis, distance, course.staircase.standing_G - before))
        return True

    def alarm(self) -> Problem | None:
        """What the guard has found since the last call, while a slider moves."""
        if self._player.kind is not Kind.TYPED:
            self._guard = None
        found, self._found = self._found, None
        return found if self._guard is not None else None

    def _executed(self, rows: Setpoints, feedback: Feedback) -> None:
        if self._guard is not None:
            self._found = self._found or self._guard.found(rows, feedback)


def proven(machine: Staircase, slider: Array, way: Array) -> Slide:
    """(6,) m where the sliders stand, (6,) m how far each goes -> the course, every tick of it checked.

    Raises MotionError for a place without a pose, off the bed, out of a window or of travel.
    """
    try:
        motions = slide(machine.rig, slider, way, machine.period)
        trial = Slide(machine.apart(), motions)
        trial.plan(UNBOUNDED)
        trial.rows(trial.first, trial.staircase.tick)
    except MotionError as error:
        raise MotionError([replace(each, line=None, hint=GUARD) for each in error.problems]) from error
    course = Slide(machine.apart(), motions)
    course.plan(UNBOUNDED)
    return course


def check_step(axis: int, distance: float) -> None:
    """Raises JobError for what is no step of a slider."""
    if axis not in range(6):
        raise JobError(Problem("slider", f"there is no slider {axis + 1}", hint="sliders are 1 to 6"))
    if not 0.0 < abs(distance) <= FURTHEST + ROUNDING:
        raise JobError(
            Problem(
                "slider",
                f"a slider is moved by up to {FURTHEST / MM:g} mm at a time, not by {distance / MM:g} mm",
                value=distance / MM,
                limit=FURTHEST / MM,
                unit="mm",
                hint="choose a step of 0.1 or 1 mm",
            )
        )


def _told(axis: int, distance: float, way: Array) -> str:
    x, y, z = (np.round(way / MM, 3) + 0.0).tolist()
    verb = "pays out" if distance > 0.0 else "takes in"
    return (
        f"slider {axis + 1} {verb} {abs(distance) / MM:g} mm: the nozzle goes X{x:+.3f} Y{y:+.3f} Z{z:+.3f}"
    )
