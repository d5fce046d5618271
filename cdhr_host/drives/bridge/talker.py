"""A conversation with a bridge: greeting, clock, keep-alive, and waiting for answers."""

import math
import struct
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from cdhr_host.drives.bridge import messages as m
from cdhr_host.drives.bridge.clock_sync import ClockSync
from cdhr_host.drives.bridge.frames import Frame, Type
from cdhr_host.drives.bridge.line import Line
from cdhr_host.drives.bridge.session import Session
from cdhr_host.drives.clock import Clock
from cdhr_host.drives.faults import fault
from cdhr_host.errors import DriveError, Problem

TURN: Final = 0.01
"""s between two turns"""
KEEPALIVE: Final = 0.02
CLOCK_EVERY: Final = 0.25
ANSWER: Final = 2.0
"""s an answer may take"""
LEAST_RETRY: Final = 0.02
STATUS_EVERY: Final = 0.02
"""s between two STATUS: what was sent is acknowledged by the next one only"""


class Talker:
    """Who talks to a bridge; ``turn`` must be called every TURN or so.

    ``due`` is when the next turn begins, infinite while there is no line.
    """

    def __init__(self, clock: Clock, connect: Callable[[], Line]) -> None:
        self.due = math.inf
        self.sync = ClockSync()
        self._clock, self._connect = clock, connect
        self._session: Session | None = None
        self._greeted = False
        self._asked_at = -math.inf

    @property
    def retry(self) -> float:
        """S after which what was not acknowledged is sent again: two round trips, and a STATUS."""
        return max(LEAST_RETRY, 2.0 * self.sync.round_trip) + STATUS_EVERY + TURN

    @property
    def session(self) -> Session:
        """The session; DriveError while there is none."""
        if self._session is None:
            raise DriveError(Problem("state", "the drives are closed, not open"))
        return self._session

    def greet(self) -> None:
        """Open the line and begin a session; raises DriveError, with the line closed again."""
        self._session = Session(self._connect(), self._clock)
        self.sync = ClockSync()
        self._greeted = False
        self.due = self._clock.now()
        try:
            hello = m.HELLO.pack(1, 1, m.ROLE_HOST, 6, 0, 0, 1, 0, bytes(8))
            self.repeat(Type.HELLO, hello, lambda: self._greeted, "the bridge does not answer")
        except DriveError:
            self.hang_up()
            raise

    def hang_up(self) -> None:
        """Give the line back."""
        if self._session is not None:
            self._session.line.close()
        self._session, self.due = None, math.inf

    def turn(self) -> None:
        """A turn, once it is due."""
        if self.due < math.inf:
            self._clock.wait_until(self.due)
            self.poll()

    def poll(self) -> None:
        """A turn now: read, answer, send what there is to send."""
        if self.due == math.inf:
            return
        now = self._clock.now()
        self.due = now + TURN
        try:
            for frame in self.session.frames():
                with suppress(struct.error):
                    self._take(frame)
            self._speak()
            self._keep_alive(now)
        except DriveError as gone:
            self.due = math.inf
            self._lost(gone)

    def send(self, kind: Type, payload: bytes = b"") -> None:
        """One frame; raises DriveError when the line is gone."""
        self.session.send(kind, payload)

    def repeat(self, kind: Type, payload: bytes, done: Callable[[], bool], what: str) -> None:
        """Send until something is so; raises DriveError with ``what`` when it takes too long."""
        end = self._clock.now() + ANSWER
        while not done():
            if self._clock.now() > end:
                raise fault("bridge", what)
            self.send(kind, payload)
            self.until(done, 2.0 * self.retry)
            self._check()

    def demand(self, done: Callable[[], bool], what: str, patience: float = ANSWER) -> None:
        """Wait until something is so; raises DriveError with ``what`` when it takes too long."""
        if not self.until(done, patience):
            raise fault("bridge", f"{what} in {patience:g} s")

    def until(self, done: Callable[[], bool], patience: float) -> bool:
        """Take turns until something is so, or for ``patience`` s; whether it is so."""
        end = self._clock.now() + patience
        while not done() and self._clock.now() < end:
            if self.due == math.inf:
                self._check()
                break
            self.turn()
        return done()

    def _keep_alive(self, now: float) -> None:
        if now - self._asked_at >= CLOCK_EVERY:
            self._asked_at = now
            self.send(Type.CLOCK_REQ, m.CLOCK_REQ.pack(int(now * 1e9)))
        if now - self.session.sent_at >= KEEPALIVE:
            self.send(Type.KEEPALIVE, m.KEEPALIVE.pack(int(now * 1e3) & 0xFFFFFFFF, self._wanted()))

    def _take(self, frame: Frame) -> None:
        """One frame; struct.error for a payload of another length."""
        if frame.type == Type.HELLO_ACK:
            self._greeted = m.HELLO_ACK.unpack(frame.payload)[3] == 6
        elif frame.type == Type.CLOCK:
            asked, microseconds, tick = m.CLOCK.unpack(frame.payload)
            self.sync.add(asked * 1e-9, self._clock.now(), microseconds * 1e-6, tick)

    def _speak(self) -> None:
        """Send what there is to send."""

    def _wanted(self) -> int:
        """Number of the output wanted next."""
        return 0

    def _check(self) -> None:
        """Raise what was found out meanwhile."""

    def _lost(self, gone: DriveError) -> None:
        """The line is gone."""
        raise gone
