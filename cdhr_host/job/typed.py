"""Typed G-code and jogs: what moves the machine while no program does."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace

import numpy as np

from cdhr_host.errors import CdhrError, MotionError, Problem
from cdhr_host.job.player import Kind, Player
from cdhr_host.job.states import QUIET
from cdhr_host.job.surface import JobState, Reply
from cdhr_host.units import MM


class Typed:
    """Texts in order, each proven as a whole before it moves."""

    def __init__(self, player: Player) -> None:
        self._player = player
        self._waiting: deque[tuple[Callable[[], bool], Future[Reply]]] = deque()
        self._running: Future[Reply] | None = None
        self._ended = False
        self._why: Problem | None = None

    @property
    def busy(self) -> bool:
        """Whether a text waits or moves."""
        return bool(self._waiting) or self._running is not None

    def add(self, begin: Callable[[], bool], answer: "Future[Reply]") -> None:
        """Something for later: ``begin`` proves it and says whether anything moves, or raises."""
        self._waiting.append((begin, answer))

    def end(self, why: Problem | None = None) -> None:
        """Come to rest on the path, and forget what waits; ``why`` goes into the answer."""
        while self._waiting:
            self._waiting.popleft()[1].set_result(Reply(False, ("stopped before it began",)))
        if self._running is not None and not self._ended:
            self._ended, self._why = True, why
            self._player.hold()

    def turn(self, state: JobState) -> None:
        """Begin the next text when nothing moves, and answer the one that came to rest."""
        player = self._player
        if self._running is not None and player.kind is not Kind.TYPED:
            self._answer(Reply(False, ("the machine stopped on a fault",)))
        if self._running is not None and player.feeder.at_rest:
            stop = player.feeder.stop
            if stop is not None and stop.pause is not None and not self._ended:
                player.go_on()
                return
            player.over()
            self._answer(self._reply())
        while self._waiting and self._running is None and (player.free or state not in QUIET):
            self._begin(*self._waiting.popleft(), state)

    def _begin(self, begin: Callable[[], bool], answer: "Future[Reply]", state: JobState) -> None:
        if state not in QUIET:
            problem = Problem("state", f"no typed moves while the printer is {state.value}")
            answer.set_result(Reply(False, (f"error: {problem.message}",), (problem,)))
            return
        try:
            if begin():
                self._running, self._ended, self._why = answer, False, None
            else:
                answer.set_result(self._reply())
        except CdhrError as error:
            answer.set_result(refused(error))

    def _answer(self, reply: Reply) -> None:
        assert self._running is not None
        answer, self._running = self._running, None
        answer.set_result(reply)

    def _reply(self) -> Reply:
        x, y, z = (np.round(self._player.staircase.standing_G / MM, 3) + 0.0).tolist()
        text = f"X:{x:.3f} Y:{y:.3f} Z:{z:.3f}"
        if not self._ended:
            return Reply(True, (text,))
        stopped = f"stopped on the path: {text}"
        if self._why is None:
            return Reply(False, (stopped,))
        why = refused(MotionError(self._why))
        return replace(why, lines=(stopped, *why.lines))


def refused(error: CdhrError) -> Reply:
    """Each refusal followed by its hint."""
    lines = []
    for problem in error.problems:
        lines.append(f"error: {problem.message}")
        if problem.hint:
            lines.append(f"hint: {problem.hint}")
    return Reply(False, tuple(lines), error.problems, error.exit_code)
