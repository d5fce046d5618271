"""Who prints line by line: one client at a time, through the printer's open stream."""

from typing import Final

from cdhr_host.job.surface import JobState, LineFeed
from cdhr_host.serve.host import Host
from cdhr_host.serve.names import refused

OVER: Final = frozenset({JobState.DONE, JobState.STOPPED, JobState.FAULT, JobState.IDLE})


class Streams:
    """The printer's stream of lines, lent to one client after the other."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._feed: LineFeed | None = None
        self._owner: object = None

    def offer(self, owner: object, name: str, lines: tuple[str, ...], *, typed: bool) -> int:
        """Lines taken, as many as there is room for; JobError when this client may not print now."""
        feed = self._of(owner) or self._open(owner, name)
        for count, line in enumerate(lines):
            if not feed.offer(line, typed=typed):
                return count
        return len(lines)

    def running(self, owner: object) -> bool:
        """Whether this client's lines are being printed."""
        return self._of(owner) is not None

    def pending(self, owner: object) -> int:
        """Lines of this client whose motion has not ended."""
        feed = self._of(owner)
        return feed.pending if feed else 0

    def finish(self, owner: object) -> None:
        """This client sends no more: what it sent is printed to its end."""
        feed = self._of(owner)
        self._owner = self._feed = None if feed else self._feed
        if feed is not None:
            feed.finish()

    def abandon(self, owner: object, name: str) -> None:
        """This client has gone: a print in motion holds, one at rest ends."""
        feed = self._of(owner)
        if feed is None:
            return
        left = feed.pending
        self.finish(owner)
        if left and self._host.state is JobState.PRINTING:
            self._host.surface.hold(f"{name} has gone with {left} lines to print")

    def _of(self, owner: object) -> LineFeed | None:
        if self._feed is not None and self._host.state in OVER:
            self._feed = self._owner = None
        return self._feed if self._owner is owner else None

    def _open(self, owner: object, name: str) -> LineFeed:
        if self._feed is not None:
            raise refused("another client is printing", "wait until it has ended", kind="state")
        self._feed = self._host.surface.open_stream(name)
        self._owner = owner
        return self._feed
