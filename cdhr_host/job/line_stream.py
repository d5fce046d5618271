"""Lines of a client on their way into a running print.

Clients offer lines from any thread; the printer's thread reads them when the plan needs more.
Reading a line proves what can be proven of it alone: words, places, forces at rest, cables'
way. What is planned is looked at tick by tick before it is fed, well ahead of the machine.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from cdhr_host.errors import CdhrError, MotionError, Problem
from cdhr_host.job.surface import Progress
from cdhr_host.motion.hold import rows_needed
from cdhr_host.pipeline import Staircase
from cdhr_host.pipeline.arriving import Arriving
from cdhr_host.pipeline.foreseen import Foresight
from cdhr_host.values import Command, Moves

AHEAD: Final = 3.0
"""s of real time drawn ahead; a client that pauses by sending nothing is obeyed that late"""
FURTHER: Final = 0.5
"""s more at a time, while too little of what is drawn is settled, up to"""
FAR: Final = 18.0
"""s"""
WAITING_MAX: Final = 256
"""lines not read yet while the plan needs more"""
WAITING_FULL: Final = 8
"""the same at first and while it does not, as far as they last no longer than FURTHER"""
TOGETHER: Final = 256
"""short lines read at once"""
EVERY: Final = 0.05
"""s of real time between two readings of short lines, and"""
SETTLED: Final = 1.0
"""s of real time settled beyond the far side's reserve; the plan is settled further only below that"""
SHORT: Final = 0.1
"""s a line lasts that counts as short"""
PATIENCE: Final = 0.1
"""s of real time without a line after which what was sent is brought to rest"""
SENDING: Final = 0.3
"""the same once a client has sent more than WAITING_FULL lines: it has more, but was kept from sending"""


BLOCKED: Final = "this print cannot go on: cancel it, then send that line slower or elsewhere"
"""said of a line that proves impossible only together with its neighbours"""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A line not read yet."""

    text: str
    typed: bool


class LineStream:
    """A ``LineFeed``; ``now`` is real time, s, ``speed`` the machine's clock against it."""

    def __init__(
        self,
        name: str,
        machine: Staircase,
        tell: Callable[[Problem], None],
        now: Callable[[], float],
        speed: float,
    ) -> None:
        self.name = name
        self.began = now()
        machine.restore(replace(machine.modal, lines=0, ended=False, warned=frozenset()))
        self.course = Arriving(machine.fork())
        self.refusal: Problem | None = None
        """of the line that the print stands before"""
        self.blocked = False
        """whether what is planned cannot be moved: nothing but an end is possible"""
        self.full = False
        """whether no more is read although what is settled is not enough to play on"""
        self._machine = machine
        self._foresight = Foresight(machine)
        self._tell, self._now = tell, now
        self._speed = speed
        self._second = speed / machine.period
        """ticks of the plan in a second of real time"""
        self._lock = threading.Lock()
        self._waiting: deque[Waiting] = deque()
        self._settled = rows_needed(machine.profile) + SETTLED * self._second
        self._settled_to = 0.0
        self._next = self.began
        self._room = WAITING_FULL
        self._offered = 0
        self._done = 0
        self._together = 1
        self._lasting = 0.0
        """s of real time that each of the lines read last asks for"""
        self._heard = self.began
        self._finished = False
        self._seen = self.course.first

    def offer(self, line: str, *, typed: bool = False) -> bool:
        """Take one line of G-code; False while there is no room. From any thread."""
        with self._lock:
            self._heard = self._now()
            if self._finished or len(self._waiting) >= self._room:
                return False
            self._waiting.append(Waiting(" ".join(line.split("\n")), typed))
            self._offered += 1
        return True

    @property
    def pending(self) -> int:
        """Lines taken whose motion has not ended."""
        return max(self._offered - self._done, 0)

    def finish(self) -> None:
        """No more lines."""
        self._finished = True

    @property
    def over(self) -> bool:
        """Whether no more lines come and all there were are planned."""
        return self._finished and self.drained

    @property
    def drained(self) -> bool:
        """Whether all lines that can be read are planned, up to rest."""
        return (not self._waiting or self.refusal is not None) and self.course.rests

    @property
    def patient(self) -> bool:
        """Whether further lines are there, or may still come in time."""
        if self._waiting and self.refusal is None:
            return True
        patience = PATIENCE if self._offered <= WAITING_FULL else SENDING
        return not self._finished and self._now() - self._heard < patience

    def read(self, played: float) -> None:
        """Read lines while too little is drawn beyond ``played``, a tick of the plan."""
        short = self._together > 1
        thin = self.course.staircase.tick - played < self._settled
        wanted = self._wanted(played, thin=thin)
        if self.refusal is None and self._waiting and self._now() >= self._next:
            self._next = self._now() + (EVERY if short else 0.0)
            self._read_until(played + wanted * self._second)
        missing = wanted - (self.course.ahead - played) / self._second
        self._room = self._room_for(missing)
        if thin and not self.course.rests:
            self._settle()
        self.full = missing <= 0.0 and self.course.staircase.tick - played < self._settled

    def _wanted(self, played: float, *, thin: bool) -> float:
        """S of real time to be drawn beyond a tick of the plan."""
        drawn = (self.course.ahead - played) / self._second
        return max(AHEAD, min(drawn + FURTHER, FAR)) if thin else AHEAD

    def _room_for(self, missing: float) -> int:
        """Lines that may wait where s of real time are missing: no more than ``missing`` or a little."""
        if not self._lasting:
            return WAITING_FULL
        count = int(max(missing, FURTHER) / self._lasting)
        most = WAITING_MAX if missing > 0.0 else WAITING_FULL
        return max(1, min(count, most))

    def _read_until(self, tick: float) -> None:
        while self.refusal is None and self._waiting and self.course.ahead < tick:
            with self._lock:
                batch = [self._waiting.popleft() for _ in range(min(self._together, len(self._waiting)))]
            self._take(batch)

    def _settle(self) -> None:
        """Settle what was drawn, if there is more than at the last time."""
        if self.course.ahead > self._settled_to:
            self._settled_to = self.course.ahead
            self.course.advance()

    def look(self) -> bool:
        """Prove what is planned tick by tick; False when it cannot be moved. Raises nothing for that."""
        end = self.course.staircase.tick
        if end <= self._seen or self.blocked:
            return not self.blocked
        try:
            self.course.rows(self._seen, end)
        except MotionError as error:
            self.blocked = True
            self.refusal = error.problems[0]
            self._tell(replace(self.refusal, hint=BLOCKED))
            return False
        self._seen = end
        return True

    def executed(self, line: int, *, at_rest: bool) -> None:
        """A line is being executed; ``at_rest`` when all that is planned was."""
        resting = at_rest and self.drained and not self._waiting
        self._done = self._offered if resting else max(self._done, min(line - 1, self._offered))

    def go_on(self) -> None:
        """The operator lets a refused line be left out."""
        self.refusal = None

    def close(self) -> None:
        """It is over; what was not read is forgotten."""
        self._finished = True
        self._waiting.clear()
        self._done = self._offered

    def hasten(self, factor: float) -> None:
        """Lines read from now on have this factor on their feed."""
        self._machine.restore(replace(self._machine.modal, speed_factor=factor))

    def progress(self, line: int) -> Progress:
        """As of a program whose end is not known."""
        elapsed = self._now() - self.began
        return Progress(
            file=self.name,
            lines=self._offered,
            line=line,
            position=0,
            size=0,
            layer=0,
            layers=0,
            elapsed=elapsed,
            printing=elapsed,
            left=0.0,
            duration=0.0,
            extruded=0.0,
            total=0.0,
        )

    def _take(self, batch: list[Waiting]) -> None:
        """Read lines; one by one where together they are refused."""
        before = self._machine.modal
        problem, commands = self._read("".join(f"{each.text}\n" for each in batch))
        if problem is None:
            self.course.add(commands)
            asked = sum(map(_duration, commands)) / len(batch)
            self._together = TOGETHER if asked < SHORT else 1
            self._lasting = asked / self._speed
            return
        self._machine.restore(before)
        if len(batch) == 1:
            self._refuse(batch[0], problem)
            return
        for k, each in enumerate(batch):
            self._take([each])
            if self.refusal is not None:
                with self._lock:
                    self._waiting.extendleft(reversed(batch[k + 1 :]))
                return

    def _read(self, text: str) -> tuple[Problem | None, list[Command]]:
        commands: list[Command] = []
        try:
            commands += self._machine.commands([text.encode("latin-1", "replace")])
        except CdhrError as error:
            return error.problems[0], []
        problems = self._foresight.problems(commands)
        return (problems[0] if problems else None), commands

    def _refuse(self, line: Waiting, problem: Problem) -> None:
        """A line is told to be refused; the print stands before the next, unless it was typed alone."""
        modal = self._machine.modal
        self._machine.restore(replace(modal, lines=modal.lines + 1))
        if not line.typed:
            self.refusal = problem
        self._tell(problem)


def _duration(command: Command) -> float:
    """s a command asks for, roughly."""
    if not isinstance(command, Moves):
        return 0.0
    steps = command.end_G[1:] - command.end_G[:-1]
    way = float(abs(command.end_G[0] - command.start_G).sum() + abs(steps).sum())
    return way / max(float(command.speed.max()), 1e-6)
