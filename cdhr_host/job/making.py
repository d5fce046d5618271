"""Rows of a score made in order, the air led, up to where it stands."""

import copy
from typing import Final

from cdhr_host.drives.rows import RowQueue
from cdhr_host.extrusion import AirStage
from cdhr_host.pipeline.course import Stop
from cdhr_host.pipeline.score import Score
from cdhr_host.values import Setpoints

CHUNK: Final = 1024
"""rows worked out at a time"""


class Making:
    """What is made of a score and not fed yet."""

    def __init__(self, score: Score, tick: int) -> None:
        self.score = score
        self.tick = tick
        """the next to make"""
        self.ended = False
        """whether the last row made stands"""
        self.stop: Stop | None = None
        """the stop of the plan at which it stands, if it is one"""
        self.ready = RowQueue()
        self._stage: AirStage[Setpoints] = AirStage(score.staircase.rig.air, score.staircase.period)

    @property
    def done(self) -> bool:
        """Whether it stands, and all of it was taken."""
        return self.ended and not len(self.ready)

    def make(self, count: int) -> None:
        """Have ``count`` rows ready, or all up to where it stands. Raises MotionError, ProgramError."""
        while len(self.ready) < count and not self.ended:
            if (room := self._room()) <= 0:
                return
            rows, self.stop, self.ended = self.score.rows(self.tick, self.tick + min(count, CHUNK, room))
            self.tick += len(rows)
            self.ready.append(self._stage.push(rows))
            if self.ended and (rest := self._stage.flush()) is not None:
                self.ready.append(rest)

    def _room(self) -> int:
        """Rows the plan has, or can be made to have."""
        part = self.score.part_at(self.tick)
        return part.course.room(part.pace.start(float(self.tick)).u)

    def look(self, until: int) -> None:
        """Raises MotionError for what cannot be done up to a tick."""
        tick, ended = self.tick, self.ended
        while tick < until and not ended:
            rows, _, ended = self.score.rows(tick, min(tick + CHUNK, until))
            tick += len(rows)

    def go_on(self, score: Score) -> None:
        """From rest on, with a score that begins there."""
        self.score, self.ended, self.stop = score, False, None

    def revised(self, score: Score, first: int) -> "Making":
        """Another score from a tick on; this one stays as it is."""
        other = Making(score, min(first, self.tick))
        other._stage = copy.deepcopy(self._stage)
        if first < self.tick:
            other._stage.restart(first)
        else:
            other.ended, other.stop = self.ended, self.stop
        if len(self.ready):
            waiting = self.ready.take(len(self.ready))
            self.ready.put_back(waiting)
            other.ready.append(waiting[waiting.tick < first])
        return other
