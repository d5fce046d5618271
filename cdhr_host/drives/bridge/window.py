"""Setpoints on their way to the bridge: what it has not acknowledged, in frames of up to eight ticks."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

from cdhr_host.drives.bridge import messages as m
from cdhr_host.drives.buffer import Revision


class Window:
    """Go-back-N: ``base`` is the first tick the bridge may not have, ``next`` the next one to send."""

    def __init__(self) -> None:
        self.begin(0)

    def begin(self, first: int) -> None:
        """Nothing on its way, ``first`` is expected next."""
        self.replace(first, [], rests=False)

    def replace(self, first: int, ticks: Sequence[bytes], *, rests: bool) -> None:
        """From ``first`` on these are on their way, none of them sent yet."""
        self.base = self.next = first
        self._ticks: deque[bytes] = deque(ticks)
        self._rests = rests

    @property
    def end(self) -> int:
        """The tick after the last one."""
        return self.base + len(self._ticks)

    @property
    def unanswered(self) -> bool:
        """Whether something was sent that the bridge did not acknowledge."""
        return self.next > self.base

    def add(self, ticks: Sequence[bytes], *, rests: bool) -> None:
        """More to send; ``rests``: the last one is at rest with the air off."""
        self._ticks.extend(ticks)
        self._rests = rests

    def acknowledge(self, expected: int) -> bool:
        """The bridge has everything before ``expected``; whether that is news."""
        news = min(expected, self.end) - self.base
        for _ in range(news):
            self._ticks.popleft()
        self.base += max(news, 0)
        self.next = max(self.next, self.base)
        return news > 0

    def back_to(self, tick: int) -> None:
        """Send from here again, as far as it is still here."""
        self.next = min(max(tick, self.base), self.end)

    def payloads(self, until: int) -> Iterator[bytes]:
        """SETPOINTS for what was not sent yet and lies before the tick ``until``."""
        while self.next < min(self.end, until):
            count = min(m.PER_FRAME, self.end - self.next, until - self.next)
            skip = self.next - self.base
            body = b"".join(islice(self._ticks, skip, skip + count))
            rests = self._rests and self.next + count == self.end
            yield m.SETPOINTS.pack(self.next, count, 6, m.ENDS_AT_REST * rests, 0) + body
            self.next += count


@dataclass(frozen=True, slots=True)
class Pending:
    """A revision the bridge was told and did not carry out yet.

    Its first ``staged`` rows must be there before the bridge may change over; the rest
    follows as ordinary setpoints.
    """

    number: int
    revision: Revision
    ticks: list[bytes]
    staged: int
    rests: bool

    def payloads(self) -> Iterator[bytes]:
        """REVISE, all of it."""
        for at in range(0, self.staged, m.PER_FRAME):
            part = self.ticks[at : min(at + m.PER_FRAME, self.staged)]
            last = at + m.PER_FRAME >= self.staged
            flags = m.LAST_OF_REVISION * last | m.ENDS_AT_REST * (last and self.rests_at_once)
            yield m.SETPOINTS.pack(self.revision.first + at, len(part), 6, flags, self.number) + b"".join(
                part
            )

    @property
    def rests_at_once(self) -> bool:
        """Whether the staged rows end at rest."""
        return self.rests and self.staged == len(self.ticks)
