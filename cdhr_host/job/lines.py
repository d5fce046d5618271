"""What follows from a client's lines: when to play on, when to stand, when it is over."""

import math
from collections.abc import Callable
from typing import Final

from cdhr_host.drives.clock import Clock
from cdhr_host.drives.link import LinkState
from cdhr_host.errors import JobError, Problem
from cdhr_host.job.line_stream import BLOCKED, LineStream
from cdhr_host.job.player import Player
from cdhr_host.job.states import Word
from cdhr_host.job.surface import JobState, Progress
from cdhr_host.job.telling import Telling
from cdhr_host.motion.hold import rows_needed
from cdhr_host.pipeline.course import Stop

LEAD: Final = 0.5
"""s of real time planned before playing begins, beyond the far side's reserve, while more lines may come"""
MOVES: Final = frozenset({JobState.PRINTING, JobState.RESUMING})


class Lines:
    """At most one stream of lines; everything but ``open`` runs in the printer's thread."""

    def __init__(
        self, player: Player, clock: Clock, telling: Telling, happened: Callable[[Word, str], None]
    ) -> None:
        self._player = player
        self._clock = clock
        self._speed = clock.speed if math.isfinite(clock.speed) else 1.0
        self._telling = telling
        self._happened = happened
        self._stream: LineStream | None = None
        self._from = 0
        """the first tick of it"""
        self._reserve = rows_needed(player.profile)
        self._lead = self._reserve + round(LEAD * self._speed / player.profile.drives.period)

    def open(self, name: str) -> LineStream:
        """A new stream; the machine stands, and no other word moves it meanwhile."""
        self._stream = LineStream(name, self._player.staircase, self._refused, self._now, self._speed)
        return self._stream

    @property
    def idle(self) -> bool:
        """Whether there is a stream of which nothing is being played."""
        return self._stream is not None and not self._player.busy

    def progress(self) -> Progress | None:
        """Of the stream."""
        return None if self._stream is None else self._stream.progress(self._line())

    def hasten(self, feed: float) -> None:
        """Lines read from now on have this feed where it is above 100 %."""
        if self._stream is not None:
            self._stream.hasten(max(feed, 1.0))

    def check_resume(self) -> None:
        """Raises JobError where what is planned cannot be moved."""
        if self._stream is not None and self._stream.blocked:
            raise JobError(Problem("state", "a line of this print cannot be moved", hint=BLOCKED))

    def resumed(self) -> bool:
        """Go on from a refused line; whether that is all, because nothing waits to be played."""
        stream, stop = self._stream, self._player.feeder.stop
        if stream is None:
            return False
        stream.go_on()
        if self._player.aside is not None:
            return False
        standing = not self._player.busy or (stop is not None and stop.waits)
        if standing:
            self._happened(Word.UP, "")
        return standing

    def end(self) -> None:
        """No stream any more."""
        if self._stream is not None:
            self._stream.close()
        self._stream = None

    def turn(self, state: JobState) -> None:
        """Read lines, and begin to play once there is something."""
        stream, player = self._stream, self._player
        if stream is None or player.aside is not None:
            return
        course, place = stream.course, player.feeder.place() if player.busy else None
        if state in MOVES:
            stream.read(course.first if place is None else place[1])
            if not stream.look():
                self._blocked(stream)
                return
        course.hurried = not stream.patient or stream.full or self._runs_low()
        if not player.busy and state in MOVES:
            self._begin(stream)
        stream.executed(self._line(), at_rest=self._all_executed(stream))

    def rested(self, stop: Stop, state: JobState) -> None:
        """All that is planned was executed, up to a stop that waits."""
        stream, player = self._stream, self._player
        if stream is None:
            return
        beyond = stream.course.staircase.tick - stop.tick
        waits = stream.patient and not stream.full
        if beyond > 0 and (beyond >= self._lead or not waits):
            player.go_on()
        elif not stream.course.rests and not waits:
            stream.course.rest()
        elif stream.drained:
            if stream.over or stream.refusal is not None:
                self._ended(stream)
            elif state is JobState.RESUMING:
                self._happened(Word.UP, "")

    def _begin(self, stream: LineStream) -> None:
        course = stream.course
        planned = course.staircase.tick - course.first
        if planned > 0 and (planned >= self._lead or course.hurried):
            self._player.lines(course)
            self._from = self._player.feeder.next_tick
        elif not course.rests and course.hurried:
            course.rest()
        elif course.rests and (stream.over or stream.refusal is not None):
            self._ended(stream)

    def _ended(self, stream: LineStream) -> None:
        """At rest: before a refused line, or after the last."""
        if stream.refusal is not None:
            self._happened(Word.PAUSED, f"line {stream.refusal.line} is refused: {stream.refusal.message}")
            return
        if self._player.busy:
            self._player.over()
        self.end()
        self._happened(Word.FINISHED, "")

    def _blocked(self, stream: LineStream) -> None:
        if stream.refusal is not None:
            refusal, stream.refusal = stream.refusal, None
            why = f"line {refusal.line} cannot be moved: {refusal.message}; cancel the print"
            self._happened(Word.HOLD, why)
            self._player.hold()
            if not self._player.busy:
                self._happened(Word.RESTED, why)

    def _all_executed(self, stream: LineStream) -> bool:
        """Whether the machine stands after all that is planned."""
        feeder, end = self._player.feeder, stream.course.staircase.tick
        if not self._player.busy:
            return end == stream.course.first
        return feeder.at_rest and feeder.stop is not None and feeder.stop.tick == end

    def _refused(self, problem: Problem) -> None:
        self._telling.add("problem", problem.message, problem)

    def _now(self) -> float:
        """s of real time, as far as the clock knows it."""
        return self._clock.now() / self._speed

    def _runs_low(self) -> bool:
        """Whether the far side would soon have to stop by itself."""
        link = self._player.link
        spare = (link.free + link.buffered - self._reserve) / 2
        return link.state is LinkState.RUNNING and link.buffered < self._reserve + spare

    def _line(self) -> int:
        """The line being executed; rows from before this stream have lines of their own."""
        last = self._player.feeder.last
        here = last is not None and self._player.busy and int(last.tick[-1]) >= self._from
        return int(last.line[-1]) if last is not None and here else 0
