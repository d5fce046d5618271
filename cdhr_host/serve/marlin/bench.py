"""What a Marlin client has before it: the machine, the files, and its own place among clients."""

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any, Final

from cdhr_host.errors import JobError
from cdhr_host.job.surface import JobState, Status
from cdhr_host.serve.folder import Folder
from cdhr_host.serve.host import Host, Message, problem_text
from cdhr_host.serve.script import Executor
from cdhr_host.serve.streaming import Streams
from cdhr_host.serve.words import Modes

SAID_MAX: Final = 100
"""messages kept for a client that does not read"""


class Bench:
    """One client's hold on the host."""

    def __init__(self, host: Host, executor: Executor, streams: Streams, name: str) -> None:
        self.host = host
        self.name = name
        self.modes = Modes()
        self._executor = executor
        self._streams = streams
        self._said: deque[str] = deque(maxlen=SAID_MAX)
        self._heard = 0.0
        self._tasks: set[asyncio.Task[None]] = set()
        self._silence = host.on_message(self._note)

    @property
    def folder(self) -> Folder:
        """Where "SD" files are."""
        return self.host.folder

    def status(self) -> Status:
        """The machine now."""
        return self.host.status()

    def state(self) -> JobState:
        """The job now."""
        return self.host.state

    def said(self) -> list[str]:
        """Messages since the last look."""
        said = [f"echo:{line}" for text in self._said for line in text.splitlines()]
        self._said.clear()
        return said

    def heard(self, now: float) -> None:
        """The client sent a line."""
        self._heard = now

    def offer(self, line: str, *, typed: bool) -> bool:
        """Hand a line to the planner; False when it must wait for room. JobError when refused."""
        preamble = () if self._streams.running(self) else self.modes.preamble()
        taken = self._streams.offer(self, self.name, (*preamble, line), typed=typed)
        if taken < len(preamble) + 1:
            return False
        self.modes = self.modes.after(line)
        return True

    @property
    def pending(self) -> int:
        """Lines of this client whose motion has not ended."""
        return self._streams.pending(self)

    @property
    def streaming(self) -> bool:
        """Whether this client's lines are being printed."""
        return self._streams.running(self)

    def end_if_silent(self, now: float, *, owing: bool) -> None:
        """A client that sends nothing, with nothing of its own left to print, has ended its stream."""
        silent = now - self._heard > self.host.profile.serve.client_silence
        if silent and not owing and self.streaming and not self.pending:
            self._streams.finish(self)

    def script(self, text: str) -> Callable[[], list[str] | None]:
        """Start a script; the answer is asked until it is there."""
        return self._task(self._executor.run(text))

    def print_file(self, name: str) -> None:
        """Prove and print a program; what is wrong with it is told as messages."""
        self._task(self._executor.run(f'SDCARD_PRINT_FILE FILENAME="{name}"'))

    def leave(self) -> None:
        """The client has gone."""
        self._silence()
        self._streams.abandon(self, self.name)

    def _task(self, work: Coroutine[Any, Any, None]) -> Callable[[], list[str] | None]:
        task = asyncio.create_task(_quietly(self.host, work))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return lambda: ["ok"] if task.done() else None

    def _note(self, message: Message) -> None:
        if message.kind == "response":
            self._said.append(message.text.removeprefix("echo: "))


async def _quietly(host: Host, work: Coroutine[Any, Any, None]) -> None:
    """A script whose refusal is a message."""
    try:
        await work
    except JobError as error:
        for problem in error.problems[:5]:
            host.say(problem_text(problem))
