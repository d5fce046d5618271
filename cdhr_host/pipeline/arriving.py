"""A course whose commands come while it is played.

It is planned as a file's is, as far as what has come settles it. What is not settled waits for
more; only when playback needs it, the leg is closed: then the plan stands after the last
command, and goes on from there when more have come.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Final

from cdhr_host.pipeline.course import UNBOUNDED, Course, Stop
from cdhr_host.pipeline.staircase import Staircase
from cdhr_host.pipeline.tape import Tape
from cdhr_host.values import Blend, Command, Notice, Pause
from cdhr_host.values import Stop as ExactStop

MARGIN: Final = 4
"""ticks of the plan kept back while more may come"""


class ArrivingTape(Tape):
    """Commands so far; what is not there yet is None and may come later."""

    def __init__(self) -> None:
        super().__init__(iter(()))

    def add(self, commands: Sequence[Command]) -> None:
        """Further commands."""
        self._kept.extend(commands)


class Arriving(Course):
    """Commands in by ``add``; it stands at a ``Stop`` that waits whenever they run out."""

    def __init__(self, staircase: Staircase) -> None:
        self._arrived = ArrivingTape()
        super().__init__(staircase, self._arrived)
        self._rests = True
        self._opened = False
        self.hurried = False
        """whether playback cannot wait for more commands"""

    @property
    def rests(self) -> bool:
        """Whether all that has come is planned and ends at rest."""
        return self._rests and self._arrived.at(self._at) is None

    def room(self, u: float) -> int:
        """Ticks that are planned beyond a time of the plan; unbounded up to rest, and when ``hurried``."""
        if self.stop() is not None or (self.hurried and not self.rests):
            return UNBOUNDED
        return max(math.floor(self.staircase.tick - u) - MARGIN, 0)

    def add(self, commands: Sequence[Command]) -> None:
        """Further commands."""
        self._arrived.add(commands)
        self._draw()

    def advance(self) -> None:
        """Plan as far as the commands so far settle it; costly when called for every one of them."""
        self._placing(self._place(self.staircase.advanced()))

    @property
    def ahead(self) -> float:
        """Tick up to which there is something to play, roughly, settled or not."""
        return self.staircase.tick + self.staircase.drawn / self.staircase.period

    def plan(self, until: int) -> None:
        """Plan on up to a tick, no further than the next stop; where commands run out, up to rest."""
        if self.stops:
            until = min(until, self.stops[0].tick - 1)
        self._draw()
        if not self._rests and self.staircase.tick <= until:
            self.advance()
        if not self._rests and self.staircase.tick <= until:
            self.rest()
        self._arrived.forget(min(self._at, self.oldest))

    def rest(self) -> None:
        """Plan all commands so far, up to rest."""
        self._draw()
        if not self._rests:
            self._placing(self._place(self.staircase.closed(ends=False)))
            self.stops.append(Stop(self.staircase.tick, None, waits=True))
            self._rests = True

    def leave(self) -> None:
        """Go on beyond the stop at which it stands; where nothing is planned there yet, wait there."""
        self.passed()
        if self.rests and not self.stops:
            self.stops.append(Stop(self.staircase.tick, None, waits=True))

    def _draw(self) -> None:
        while (command := self._arrived.at(self._at)) is not None:
            if not self._opened:
                self._placing(self._place(self.staircase.opened()))
                self._opened = True
            self._marks.append((self._at, self.staircase.fork(self.staircase.feed_override)))
            self._placing(self._place(self.staircase.settled(command)))
            self._placing(self._told(command))
            self._at += 1
            if not isinstance(command, Notice | Blend | ExactStop):
                self._rests = isinstance(command, Pause)

    @staticmethod
    def _placing(steps: Iterator[object]) -> None:
        for _ in steps:
            pass
