"""Listeners, and what they are told."""

import threading
from collections import deque
from collections.abc import Callable

from cdhr_host.errors import Problem
from cdhr_host.job.surface import Event, Listener, Status


class Telling:
    """Events in order, from any thread; told in ``tell`` only."""

    def __init__(self) -> None:
        self._listeners: list[Listener] = []
        self._waiting: deque[tuple[str, str, Problem | None]] = deque()
        self._lock = threading.Lock()

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Tell this one too; the answer ends it."""
        with self._lock:
            self._listeners = [*self._listeners, listener]

        def end() -> None:
            with self._lock:
                self._listeners = [each for each in self._listeners if each is not listener]

        return end

    def add(self, kind: str, text: str, problem: Problem | None = None) -> None:
        """Something happened."""
        self._waiting.append((kind, text, problem))

    def tell(self, status: Callable[[], Status]) -> None:
        """Tell what has happened since the last call.

        A listener that raises is not asked again: it must not stop the machine.
        """
        while self._waiting:
            kind, text, problem = self._waiting.popleft()
            event = Event(kind, text, status(), problem)
            for listener in self._listeners:
                try:
                    listener(event)
                except Exception as error:
                    with self._lock:
                        self._listeners = [each for each in self._listeners if each is not listener]
                    self.add("message", f"a listener failed and is not told any more: {error!r}")
