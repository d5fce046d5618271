"""A printer that does what a test tells it: no thread, no clock, time passes by ``advance``."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import numpy as np

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.surface import Event, JobState, LineFeed, Progress, Reply, Status
from cdhr_host.pipeline import open_profile
from cdhr_host.program import Interpreter

PROFILE = open_profile("paper")
ROOM = 32


def standing() -> Status:
    return Status(
        state=JobState.IDLE,
        message="",
        line=0,
        nozzle_G=np.zeros(3),
        upper=np.zeros(3),
        velocity=0.0,
        slider=np.zeros(6),
        slider_setpoint=np.zeros(6),
        tension=np.full(9, 4.0),
        window=np.tile([0.5, 12.0], (9, 1)),
        force=np.full(3, np.nan),
        torque=np.zeros(6),
        flow=0.0,
        pressure=2500.0,
        pressure_setpoint=0.0,
        feed_override=1.0,
        flow_override=1.0,
        referenced=True,
        homed=True,
        tick=0,
        buffered=0,
        progress=None,
    )


class ScriptedFeed:
    def __init__(self, surface: "ScriptedSurface") -> None:
        self.lines: list[str] = []
        self.done = 0
        self.finished = False
        self._surface = surface

    @property
    def pending(self) -> int:
        return len(self.lines) - self.done

    def offer(self, line: str, *, typed: bool = False) -> bool:
        if self.pending >= self._surface.room:
            return False
        self.lines.append(line)
        return True

    def finish(self) -> None:
        self.finished = True
        if not self.pending:
            self._surface.go(JobState.DONE)


class ScriptedSurface:
    """Checks words like the real one; moves at once or, in a stream, by ``advance``."""

    def __init__(self, room: int = ROOM) -> None:
        self.profile = PROFILE
        self.room = room
        self.said: list[tuple[object, ...]] = []
        self.feeds: list[ScriptedFeed] = []
        self.lines_in_program = 0
        self.executed = 0
        self._status = standing()
        self._listeners: list[Callable[[Event], None]] = []
        self._path: Path | None = None
        self._name = ""

    @property
    def state(self) -> JobState:
        return self._status.state

    def status(self) -> Status:
        return self._status

    def listen(self, listener: Callable[[Event], None]) -> Callable[[], None]:
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def go(self, state: JobState, message: str = "", problem: Problem | None = None) -> None:
        self._status = replace(self._status, state=state, message=message)
        self.tell("state", message, problem)

    def tell(self, kind: str, text: str, problem: Problem | None = None) -> None:
        for listener in list(self._listeners):
            listener(Event(kind, text, self._status, problem))

    def _need(self, *states: JobState) -> None:
        if self._status.state not in states:
            raise JobError(Problem("state", f"not while the job is {self._status.state.value}"))

    def load(self, path: Path, *, name: str | None = None) -> None:
        self._need(JobState.IDLE, JobState.READY, JobState.DONE, JobState.STOPPED)
        self._path, self._name = path, name or path.name
        self.said.append(("load", self._name))
        self.go(JobState.PROVING)

    def proven(self) -> None:
        """The proof ends."""
        assert self._path is not None
        text = self._path.read_bytes()
        try:
            list(Interpreter(self.profile).commands([text]))
        except Exception as error:
            for problem in error.problems:
                self.tell("problem", "", problem)
            self.go(JobState.IDLE, "refused")
            return
        self.lines_in_program = text.count(b"\n")
        self._progress(0)
        self.go(JobState.READY)

    def _progress(self, line: int) -> None:
        size = self._path.stat().st_size if self._path else 0
        total = float(self.lines_in_program)
        progress = Progress(
            self._name, self.lines_in_program, line, int(size * line / max(total, 1)), size, 1, 2,
            float(line), float(line), total - line, total, line * 1e-9, total * 1e-9, float(line),
        )  # fmt: skip
        self._status = replace(self._status, progress=progress, line=line)

    def unload(self) -> None:
        self._need(JobState.READY, JobState.DONE, JobState.STOPPED)
        self.go(JobState.IDLE)

    def start(self, *, at_line: int | None = None) -> None:
        self._need(JobState.READY)
        self.executed = 0
        self.go(JobState.PRINTING)

    def open_stream(self, name: str) -> LineFeed:
        self._need(JobState.IDLE, JobState.READY, JobState.DONE, JobState.STOPPED)
        self.feeds.append(ScriptedFeed(self))
        self._path = None
        self.go(JobState.PRINTING)
        return self.feeds[-1]

    def advance(self, lines: int) -> None:
        """Execute some lines of what is printed."""
        if self._status.state is JobState.PROVING:
            self.proven()
        elif self._status.state is JobState.PRINTING and self._path is not None:
            self.executed = min(self.executed + lines, self.lines_in_program)
            self._progress(self.executed)
            if self.executed == self.lines_in_program:
                self.go(JobState.DONE)
        elif self._status.state is JobState.PRINTING and self.feeds:
            feed = self.feeds[-1]
            feed.done = min(feed.done + lines, len(feed.lines))
            if feed.finished and not feed.pending:
                self.go(JobState.DONE)

    def hold(self, reason: str = "") -> None:
        self._need(JobState.PRINTING, JobState.RESUMING, JobState.HOLDING, JobState.HELD)
        self.said.append(("hold", reason))
        self.go(JobState.HELD, reason)

    def resume(self) -> None:
        self._need(JobState.HELD)
        self.said.append(("resume",))
        self.go(JobState.PRINTING)

    def abort(self, reason: str = "") -> None:
        self._need(JobState.PRINTING, JobState.RESUMING, JobState.HOLDING, JobState.HELD, JobState.PROVING)
        self.said.append(("abort", reason))
        self.go(JobState.STOPPED, reason)

    def emergency_stop(self, reason: str = "") -> None:
        self.said.append(("stop", reason))
        self.go(JobState.FAULT, reason)

    def acknowledge(self) -> None:
        self._need(JobState.FAULT)
        self.go(JobState.IDLE)

    def override(self, *, feed: float | None = None, flow: float | None = None) -> None:
        status = self._status
        self._status = replace(
            status,
            feed_override=status.feed_override if feed is None else feed,
            flow_override=status.flow_override if flow is None else flow,
        )

    def run(self, text: str) -> "Future[Reply]":
        self.said.append(("run", text))
        future: Future[Reply] = Future()
        try:
            self._need(JobState.IDLE, JobState.READY, JobState.DONE, JobState.STOPPED, JobState.HELD)
            list(Interpreter(self.profile).commands([text.encode() + b"\n"]))
            future.set_result(Reply(True, ("X0 Y0 Z0",)))
        except Exception as error:
            future.set_result(Reply(False, (str(error),), error.problems))
        return future

    def jog(self, velocity: object) -> None:
        self.said.append(("jog", velocity))
