"""A client's end of the Marlin protocol, without I/O: bytes in, answers out.

One ``ok`` for each line, in order, when the next may come. What an answer waits for (room for
a move, the end of the motion, a script) is a ``Wait`` that is asked again and again; meanwhile
``busy`` is said. Words for emergencies act when they are received, before the queue.
"""

from collections import deque
from collections.abc import Iterable
from typing import Final

from cdhr_host.serve.marlin.bench import Bench
from cdhr_host.serve.marlin.commands import Answer, Commands, Wait
from cdhr_host.serve.marlin.lines import Damaged, Dropped, Framer, Numbering
from cdhr_host.serve.marlin.reports import Reports
from cdhr_host.serve.words import bare, code_of

QUEUE_MAX: Final = 2048
"""lines received and not answered; the transport stops reading there"""
OUT_MAX: Final = 1 << 16
"""bytes a client has not read; beyond them no further line is taken up and no report made"""
EMERGENCY: Final = frozenset({"M112", "M108", "M410", "M876"})


class Engine:
    """One client."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._framer = Framer()
        self._numbering = Numbering()
        self._queue: deque[str | None] = deque()
        self._wait: Wait | None = None
        self._out = bytearray()
        self._reports = Reports(bench)
        self._commands = Commands(bench, self._reports)

    @property
    def full(self) -> bool:
        """Whether the transport must not read further for now."""
        return len(self._queue) >= QUEUE_MAX or len(self._out) >= OUT_MAX

    @property
    def waiting(self) -> bool:
        """Whether an answer is still owed."""
        return self._wait is not None or bool(self._queue)

    def receive(self, data: bytes, now: float) -> None:
        """Bytes from the client at ``now``, s."""
        for line in self._framer.lines(data):
            if line is not None and ("M" in line or "m" in line):
                self._emergency(line)
            self._queue.append(line)
        self.tick(now)

    def tick(self, now: float) -> None:
        """Go on with what waited, and report what is due."""
        self._told()
        while self._go_on(now):
            pass
        if len(self._out) < OUT_MAX:
            self._write(self._reports.due(now))
        self._bench.end_if_silent(now, owing=self.waiting)

    def take(self) -> bytes:
        """Bytes for the client."""
        out = bytes(self._out)
        self._out.clear()
        return out

    def put_back(self, data: bytes) -> None:
        """Bytes the client did not take."""
        self._out[:0] = data

    def closed(self) -> None:
        """The client has gone: what it printed holds."""
        self._bench.leave()
        self._queue.clear()
        self._wait = None

    def _emergency(self, line: str) -> None:
        code = code_of(_unnumbered(line))
        if code in EMERGENCY:
            self._commands.at_once(code, bare(_unnumbered(line)))

    def _go_on(self, now: float) -> bool:
        """Answer one line; False when there is none or it must wait."""
        if self._wait is not None:
            return self._waited(now)
        if not self._queue or len(self._out) >= OUT_MAX:
            return False
        self._reports.busy_from(now)
        self._answer(self._reply(self._queue.popleft(), now))
        return True

    def _waited(self, now: float) -> bool:
        assert self._wait is not None
        answer = self._wait()
        if answer is None:
            self._write(self._reports.busy(now))
            return False
        self._wait = None
        self._answer(answer)
        return True

    def _reply(self, raw: str | None, now: float) -> Answer:
        if raw is None:
            return ["echo:a line longer than 1024 bytes was dropped", "ok"]
        line = self._numbering.check(raw)
        if isinstance(line, Damaged):
            return [f"Error:{line.why}", f"Resend: {line.wanted}", "ok"]
        if isinstance(line, Dropped):
            return ["ok"]
        self._bench.heard(now)
        text = bare(line.text)
        return self._commands.answer(text, numbered=line.numbered) if text else ["ok"]

    def _answer(self, answer: Answer) -> None:
        if isinstance(answer, list):
            self._write(answer)
        else:
            self._wait = answer

    def _told(self) -> None:
        """What the host has to say by itself."""
        if len(self._out) < OUT_MAX:
            self._write([*self._reports.changes(), *self._bench.said()])

    def _write(self, lines: Iterable[str]) -> None:
        for line in lines:
            self._out += line.encode("utf-8", "replace") + b"\n"


def _unnumbered(line: str) -> str:
    """A line without its number and checksum, whether they fit or not."""
    text = line.lstrip(" \t")
    if text[:1] in {"N", "n"}:
        text = text[1:].lstrip(" \t+-0123456789")
    return text.partition("*")[0]
