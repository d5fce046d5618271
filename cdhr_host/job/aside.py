"""A program set aside while it is held, so that the machine can be moved; and the way back to it."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.job.feeder import Feeder
from cdhr_host.job.making import Making
from cdhr_host.motion.playback import Pace
from cdhr_host.pipeline import Staircase
from cdhr_host.pipeline.course import Course
from cdhr_host.pipeline.score import Part
from cdhr_host.values import Array

THERE: Final = 1e-9
"""m from the held place that are rounding"""


@dataclass(frozen=True, slots=True)
class Aside:
    """What is needed to go on with it."""

    making: Making
    course: Course
    """as it was begun"""
    base: Course | None
    """as it is written, where it may be planned anew with another feed"""
    staircase: Staircase
    tick: int
    """at which it stands"""
    nozzle_G: Array
    """(3,) m, where it stands"""

    @classmethod
    def of(cls, feeder: Feeder, course: Course, base: Course | None, staircase: Staircase) -> "Aside":
        """What a feeder plays, which is at rest."""
        assert feeder.making is not None
        assert feeder.last is not None
        return cls(feeder.making, course, base, staircase, feeder.next_tick - 1, feeder.last.nozzle_G[-1])

    def way_back(self, at_G: Array, clear: float) -> Array:
        """(N, 3) m: places on the way from elsewhere, ``clear`` m above both and all clay; or none."""
        if np.abs(at_G - self.nozzle_G).max() <= THERE:
            return np.zeros((0, 3))
        across = float(np.linalg.norm(at_G[:2] - self.nozzle_G[:2]))
        top = max(float(at_G[2]), float(self.nozzle_G[2]))
        if across > THERE:
            top = max(top, self.course.staircase.top) + clear
        x, y, _ = self.nozzle_G.tolist()
        places = np.array([[at_G[0], at_G[1], top], [x, y, top], self.nozzle_G])
        moved = np.abs(np.diff(np.vstack((at_G, places)), axis=0)).max(axis=1) > THERE
        kept: Array = places[moved]
        return kept

    def going_on(self, tick: int) -> Making:
        """Its making again, standing since before a later tick of the drives."""
        score = self.making.score
        u = score.last.pace.start(float(self.tick)).u
        part = Part(tick - 1, score.last.course, Pace.of(tick=tick - 1, u=u, rate=0.0))
        again = Making(score.alone(part), tick)
        again.ended, again.stop = True, self.making.stop
        return again
