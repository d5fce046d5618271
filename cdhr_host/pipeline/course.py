"""A course: the plan of a text, made as far ahead as needed and kept as far back as needed.

It gives the rows of the dry run by their ticks, and the unshaped motion at any time between
them. It keeps the machine as it was before each command, so that what lies ahead can be
planned anew with another feed.
"""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from cdhr_host.errors import MotionError
from cdhr_host.motion.leg import FeedOverride
from cdhr_host.motion.sampling import BLOCK, Timed
from cdhr_host.pipeline.shift import Shift, nozzle_standing_at
from cdhr_host.pipeline.staircase import Checked, Staircase
from cdhr_host.pipeline.tape import Tape
from cdhr_host.values import Array, Command, Ints, Pause, Setpoints, ToolTrack

UNBOUNDED: Final = 1 << 40
"""ticks: more than any text has"""


@dataclass(frozen=True, slots=True)
class Stop:
    """Where playback must stand."""

    tick: int
    """of the plan, the first after the row that stands"""
    pause: Pause | None
    """None at the plan's end"""
    waits: bool = False
    """whether the plan goes on when further commands come"""


@dataclass(frozen=True, slots=True)
class Placed:
    """A step of the plan, and the number of the command that settled it."""

    step: Timed | Shift
    cause: int

    @property
    def begin(self) -> float:
        """Tick, perhaps not a whole one."""
        return self.step.begin if isinstance(self.step, Timed) else float(self.step.track.tick[0])

    @property
    def end(self) -> int:
        """The first tick after it."""
        return self.step.ticks.stop if isinstance(self.step, Timed) else int(self.step.track.tick[-1]) + 1

    def unshaped(self, tick: Ints, u: Array) -> ToolTrack:
        """(N,) ticks to be named by, (N,) ticks of the plan -> the nozzle."""
        if isinstance(self.step, Timed):
            return self.step.unshaped(tick, u)
        return nozzle_standing_at(self.step.track, tick)


SKIP = 20_000
"""ticks planned at a time where nothing of them is wanted"""


class Course:
    """One text on its way; ``at`` is the number of the command it goes on with."""

    def __init__(
        self, staircase: Staircase, tape: Tape, *, at: int = 0, opens: bool = True, ends: bool = True
    ) -> None:
        self.staircase = staircase
        self._tape = tape
        self._at = at
        self._ends = ends
        self._steps = self._planned(opens=opens)
        self._over = False
        self._placed: deque[Placed] = deque()
        self._marks: deque[tuple[int, Staircase]] = deque()
        self.stops: deque[Stop] = deque()
        self._blocks: deque[Setpoints] = deque()
        self._waiting: deque[tuple[int, Iterator[Checked]]] = deque()
        self.first = staircase.tick
        """the first tick of it"""
        self.kept_from = self.first
        """tick of the plan before which nothing is known any more"""

    @property
    def over(self) -> bool:
        """Whether all of the text is planned."""
        return self._over

    @property
    def oldest(self) -> int:
        """Number of the first command that may have to be planned anew."""
        return self._placed[0].cause if self._placed else self._at

    def plan(self, until: int) -> None:
        """Plan on up to a tick, or the end. Raises ProgramError, MotionError."""
        while not self._over and self.staircase.tick <= until:
            if next(self._steps, None) is None:
                self._over = True

    def skip(self, until: int) -> None:
        """Plan up to a tick, forgetting on the way what lies before it; rows begin there."""
        while not self._over and self.staircase.tick <= until:
            self.plan(min(self.staircase.tick + SKIP, until))
            self.drop(min(self.staircase.tick, until))
            self.forget(self.oldest)
        while self.stops and self.stops[0].tick <= until:
            self.passed()

    def close(self) -> None:
        """Read no further; what was read stays in force for the machine's next lines."""
        modal = self.staircase.modal
        self._tape.close()
        self.staircase.restore(modal)

    def moves(self) -> bool:
        """Whether a short text has any motion in it."""
        while not self._over and self.staircase.tick == self.first:
            self.plan(self.first)
        return self.staircase.tick > self.first

    def rows(self, first: int, last: int) -> Setpoints:
        """The dry run's rows of ticks first to last - 1. Raises MotionError for what cannot be done."""
        while not self._blocks or int(self._blocks[-1].tick[-1]) + 1 < last:
            self._blocks.append(self._computed())
        touched = (each for each in self._blocks if each.tick[0] < last and each.tick[-1] >= first)
        return joined([_cut(block, first, last) for block in touched])

    def stop(self) -> Stop | None:
        """Where playback must stand next, if that is planned already."""
        return self.stops[0] if self.stops else None

    def unshaped(self, tick: Ints, u: Array) -> ToolTrack:
        """(N,) ticks to be named by, ascending ticks (N,) of the plan -> the nozzle without shaping."""
        cuts = [0, *np.searchsorted(u, [each.begin for each in self._placed][1:]).tolist(), len(u)]
        parts = [
            each.unshaped(tick[cuts[k] : cuts[k + 1]], u[cuts[k] : cuts[k + 1]])
            for k, each in enumerate(self._placed)
            if cuts[k + 1] > cuts[k]
        ]
        return ToolTrack.joined(parts)

    def nozzle(self, u: Array) -> ToolTrack:
        """(N,) ascending ticks of the plan -> the nozzle at them, named by nothing."""
        return self.unshaped(np.zeros(len(u), dtype=np.int64), u)

    def shift_at(self, u: float) -> Shift | None:
        """The shift a time of the plan falls on, if it does."""
        found = self.placed_at(u).step
        return found if isinstance(found, Shift) and u <= float(found.track.tick[-1]) else None

    def shift_edges(self) -> list[float]:
        """Ticks of the plan at which shifts begin, and at which they have come to rest."""
        shifts = [each.step.track.tick for each in self._placed if isinstance(each.step, Shift)]
        return [float(edge) for tick in shifts for edge in (tick[0], np.nextafter(tick[-1], np.inf))]

    def placed_at(self, u: float) -> Placed:
        """The step a time of the plan falls on."""
        before = [each for each in self._placed if each.begin <= u]
        return before[-1] if before else self._placed[0]

    def placed(self) -> Iterator[Placed]:
        """All steps that are kept, in order."""
        return iter(self._placed)

    def drop(self, before: int) -> None:
        """Forget what lies before a tick of the plan."""
        while len(self._placed) > 1 and max(self._placed[0].end, self._placed[1].begin) < before:
            self._placed.popleft()
        while len(self._marks) > 1 and self._marks[1][0] <= self.oldest:
            self._marks.popleft()
        while self._blocks and int(self._blocks[0].tick[-1]) < before:
            self._blocks.popleft()
        self.kept_from = max(self.kept_from, before)
        while self._waiting and self._waiting[0][0] <= before:
            self._waiting.popleft()

    def forget(self, before: int) -> None:
        """Commands below this number are not planned anew any more, by nobody."""
        self._tape.forget(before)

    def room(self, u: float) -> int:  # noqa: ARG002 - a whole text is planned whenever asked for
        """Ticks that may be played on from a time of the plan without bringing it to rest for that."""
        return UNBOUNDED

    def passed(self) -> None:
        """Go on beyond the stop that comes next."""
        self.stops.popleft()

    def leave(self) -> None:
        """Go on beyond the stop at which it stands."""
        self.passed()

    def hastened(self, u: float, override: FeedOverride) -> "Course":
        """The same text from the last border before a time of the plan on, planned with another feed."""
        cause = self.placed_at(u).cause
        machine = next(machine for at, machine in reversed(self._marks) if at == cause)
        return Course(machine.fork(override), self._tape, at=cause, opens=False, ends=self._ends)

    def _planned(self, *, opens: bool) -> Iterator[object]:
        if opens:
            yield from self._place(self.staircase.opened())
        while True:
            self._marks.append((self._at, self.staircase.fork(self.staircase.feed_override)))
            command = self._tape.at(self._at)
            if command is None:
                break
            yield from self._place(self.staircase.settled(command))
            yield from self._told(command)
            self._at += 1
        yield from self._place(self.staircase.closed(ends=self._ends))
        self.stops.append(Stop(self.staircase.tick, None))

    def _place(self, steps: Iterator[Timed] | Iterator[Shift] | Iterator[Timed | Shift]) -> Iterator[Placed]:
        for step in steps:
            placed = Placed(step, self._at)
            self._placed.append(placed)
            self._waiting.append((placed.end, self._blocks_of(step)))
            yield placed

    def _told(self, command: Command) -> Iterator[Command]:
        if isinstance(command, Pause):
            self.stops.append(Stop(self.staircase.tick, command))
            yield command

    def _blocks_of(self, step: Timed | Shift) -> Iterator[Checked]:
        """As ``Timed.tracks`` has them, but for those wholly before what is wanted."""
        if isinstance(step, Shift):
            yield self.staircase.afresh().shifted(step)
            return
        for first in range(step.ticks.start, step.ticks.stop, BLOCK):
            last = min(first + BLOCK, step.ticks.stop)
            if last > self.kept_from:
                yield self.staircase.afresh().checked(step.track(np.arange(first, last)))

    def _computed(self) -> Setpoints:
        """The next block of rows."""
        while True:
            while not self._waiting and not self._over:
                self.plan(self.staircase.tick)
            if (checked := next(self._waiting[0][1], None)) is None:
                self._waiting.popleft()
            elif checked.problems:
                raise MotionError(checked.problems)
            else:
                return checked.setpoints


def joined(parts: Sequence[Setpoints]) -> Setpoints:
    """One or more batches of rows -> one batch."""
    if len(parts) == 1:
        return parts[0]
    columns = ([getattr(part, name.name) for part in parts] for name in fields(Setpoints))
    return Setpoints(*(np.concatenate(column) for column in columns))


def _cut(block: Setpoints, first: int, last: int) -> Setpoints:
    start = int(block.tick[0])
    return block[max(first - start, 0) : max(last - start, 0)]
