"""Ctrl-C while the machine moves: a request to stop, not an exception."""

import signal
from types import FrameType, TracebackType
from typing import Self

from cdhr_host.cli.refusals import say

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopRequest:
    """While entered, SIGINT, SIGTERM and SIGHUP only ask: the machine stops on its path.

    Asking again changes nothing, so impatience cannot turn a controlled stop into a hard one.
    """

    def __init__(self) -> None:
        self.asked = False
        self._before: dict[int, object] = {}

    def __call__(self) -> bool:
        """Whether a stop was asked for."""
        return self.asked

    def _ask(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 - a signal handler's shape
        say("cdhr: already stopping" if self.asked else "cdhr: stopping on the path, air off")
        self.asked = True

    def __enter__(self) -> Self:
        for number in SIGNALS:
            self._before[number] = signal.signal(number, self._ask)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
