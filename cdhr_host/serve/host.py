"""The one thing every door speaks to: a printer, its upload folder, and what was said lately.

All of it lives on one event loop. The printer tells its events from its own thread; they are
brought over to the loop, kept, and handed on.
"""

import asyncio
import time
from collections import deque
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.surface import Event, JobState, Reply, Status, Surface
from cdhr_host.profile.schema import Profile
from cdhr_host.serve.folder import Folder
from cdhr_host.serve.model import ACTIVE, View, objects
from cdhr_host.serve.names import shown
from cdhr_host.serve.words import Modes

KEPT: Final = 500
"""messages remembered"""
BUSY: Final = ACTIVE | {JobState.PROVING, JobState.STOPPING}
"""a program is under way or being proven"""
LOOK: Final = 0.25
"""s between two looks at the state while it is waited for"""


@dataclass(frozen=True, slots=True)
class Message:
    """Something told to whoever listens."""

    text: str
    when: float
    """s since 1970"""
    kind: str = "response"
    """``"response"`` or ``"command"``"""


Told = Callable[[Message], None]
Happened = Callable[[Event], None]


class Host:
    """A printer as its clients share it."""

    def __init__(
        self,
        surface: Surface,
        folder: Folder,
        *,
        monotonic: Callable[[], float] = time.monotonic,
        wall: Callable[[], float] = time.time,
    ) -> None:
        self.surface = surface
        self.folder = folder
        self.monotonic = monotonic
        self.wall = wall
        self.began = monotonic()
        self.modes = Modes()
        self.display = ""
        self.messages: deque[Message] = deque(maxlen=KEPT)
        self._told: list[Told] = []
        self._happened: list[Happened] = []
        self._changed = asyncio.Event()
        self._problems: list[Problem] = []
        self._turned = 0
        """changes of state that were told"""
        self._starting: asyncio.Task[None] | None = None
        self._silence: Callable[[], None] = lambda: None

    @property
    def profile(self) -> Profile:
        """The machine."""
        return self.surface.profile

    def open(self) -> None:
        """Listen to the printer; called on the event loop."""
        loop = asyncio.get_running_loop()
        self._silence = self.surface.listen(lambda event: _over(loop, self._event, event))

    async def close(self) -> None:
        """Stop listening; a print goes on as it is."""
        self._silence()
        if self._starting is not None:
            self._starting.cancel()
            with suppress(asyncio.CancelledError, JobError):
                await self._starting

    @property
    def state(self) -> JobState:
        """The job now."""
        return self.surface.state

    def status(self) -> Status:
        """The machine now."""
        return self.surface.status()

    def view(self) -> View:
        """What the status objects are made of, now."""
        return View(
            self.status(),
            self.profile,
            self.folder.root,
            self.modes.absolute,
            self.modes.absolute_e,
            self.modes.feed_speed,
            self.display,
            self.monotonic() - self.began,
        )

    def objects(self, names: Iterable[str] | None = None) -> dict[str, dict[str, object]]:
        """Status objects, all or by name."""
        return objects(self.view(), names)

    def on_message(self, told: Told) -> Callable[[], None]:
        """Be told every message from now on; the answer ends it."""
        self._told.append(told)
        return lambda: self._told.remove(told)

    def on_event(self, happened: Happened) -> Callable[[], None]:
        """Be told every event of the printer from now on; the answer ends it."""
        self._happened.append(happened)
        return lambda: self._happened.remove(happened)

    def say(self, text: str, *, kind: str = "response") -> None:
        """Tell all clients."""
        message = Message(text, self.wall(), kind)
        self.messages.append(message)
        for told in list(self._told):
            told(message)

    def run(self, text: str) -> Awaitable[Reply]:
        """G-code of a person or a client, proven, then run."""
        return asyncio.wrap_future(self.surface.run(text))

    def emergency_stop(self, source: str) -> None:
        """Any -> FAULT."""
        self.surface.emergency_stop(f"emergency stop from {source}")

    async def print_file(self, name: str) -> None:
        """Prove a program of the folder, then print it; JobError with what is wrong with it."""
        path = self.folder.path(name)
        if self._starting is not None and not self._starting.done():
            raise JobError(Problem("state", "another program is being proven", hint="wait, or cancel it"))
        self._problems.clear()
        told = self._turned + 2
        self.surface.load(path, name=self.folder.entry(name).name)
        self._starting = asyncio.create_task(self._start(name, told))
        await asyncio.shield(self._starting)

    async def _start(self, name: str, told: int) -> None:
        """Once the proof's end has been told: what is wrong is told before it."""
        status = await self.until(lambda state: state is not JobState.PROVING and self._turned >= told)
        if status.state is not JobState.READY:
            problems = tuple(self._problems) or (Problem("program", status.message or f"{name} is refused"),)
            raise JobError(problems)
        if not (status.homed and status.referenced):
            self.say("echo: going to the reference pose first")
            await self.run("G28")
        self.surface.start()

    def delete(self, name: str) -> None:
        """Remove a program; JobError while it is proven or printed."""
        name = self.folder.entry(name).name
        progress = self.status().progress
        if progress is not None and progress.file == name and self.state in BUSY:
            hint = "cancel the print first"
            raise JobError(Problem("state", f"'{shown(name)}' is being printed", hint=hint))
        self.folder.delete(name)

    async def until(self, reached: Callable[[JobState], bool]) -> Status:
        """Wait for a state."""
        while not reached(self.state):
            self._changed.clear()
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._changed.wait(), LOOK)
        return self.status()

    def _event(self, event: Event) -> None:
        self._changed.set()
        self._turned += event.kind == "state"
        if event.problem is not None:
            self._problems.append(event.problem)
            del self._problems[:-100]
            self.say(f"!! {problem_text(event.problem)}" if _halted(event) else problem_text(event.problem))
        elif event.text and event.kind != "override":
            self.say(event.text)
        for happened in list(self._happened):
            happened(event)


def problem_text(problem: Problem) -> str:
    """A refusal in one line: where, what, and what to do."""
    where = f"line {problem.line}: " if problem.line is not None else ""
    return f"{where}{problem.message}" + (f" ({problem.hint})" if problem.hint else "")


def _halted(event: Event) -> bool:
    return event.status.state is JobState.FAULT


def _over(loop: asyncio.AbstractEventLoop, act: Callable[[Event], None], event: Event) -> None:
    """From the printer's thread to the loop; an event after the end of the loop is nobody's."""
    with suppress(RuntimeError):
        loop.call_soon_threadsafe(act, event)
