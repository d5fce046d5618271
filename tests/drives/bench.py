"""A far side on the bench: no process, no thread, no wall clock.

Time is a number. Whenever the master lets it pass, the far side is handed what was sent and
its answers are put where the master reads them: in memory, or through a real pseudo-terminal.
"""

import fcntl
import math
import os
import select
import struct
import tempfile
import termios
import time
import tty
from pathlib import Path

from trajectories import PAPER

from cdhr_host.drives.bridge.host import BridgeLink
from cdhr_host.drives.canopen.port import SlcanPort
from cdhr_host.drives.cyclic import CyclicLink
from cdhr_host.drives.reference import ReferenceStore
from cdhr_host.drives.sim.adapter import Adapter
from cdhr_host.drives.sim.bridge import Bridge
from cdhr_host.drives.sim.station import Station

STEP = 1e-3


class FarClock:
    """The clock of the master: letting time pass lets the far side work."""

    speed = 1.0

    def __init__(self):
        self.time = 100.0
        self.work = lambda now: None

    def now(self):
        return self.time

    def wait_until(self, when):
        while self.time < when:
            self.time = min(when, self.time + STEP)
            self.work(self.time)

    def stall(self, duration):
        """The master does nothing at all for a while."""
        self.wait_until(self.time + duration)


class MemoryPort:
    """Frames in a list."""

    def __init__(self):
        self.sent, self.arrived = [], []
        self.broken = None
        self.trouble = None

    def send(self, frames):
        if self.broken is not None:
            raise self.broken
        self.sent += frames

    def receive(self):
        if self.broken is not None:
            raise self.broken
        frames, self.arrived = self.arrived, []
        return frames

    def close(self):
        pass


class MemoryWire:
    """Joins a MemoryPort to a far side that exchanges frames."""

    def __init__(self, far):
        self.far = far
        self.port = MemoryPort()

    def connect(self):
        return self.port

    def work(self, now):
        sent, self.port.sent = self.port.sent, []
        self.port.arrived += self.far.exchange(now, sent)

    def close(self):
        pass


def _waiting(fd):
    """Bytes that can be read."""
    return struct.unpack("i", fcntl.ioctl(fd, termios.FIONREAD, bytes(4)))[0]


def _settle(arrived, count):
    """Terminals hand bytes over in their own time: wait for it, so that tests see the same each time."""
    for _ in range(200_000):
        if arrived() >= count:
            return
        time.sleep(0)
    raise AssertionError("the terminal swallowed something")


class _Settled:
    """A port whose bytes have arrived once ``send`` returns."""

    def __init__(self, port, far):
        self._port, self._far = port, far
        self.receive, self.close = port.receive, port.close

    @property
    def trouble(self):
        return self._port.trouble

    def send(self, frames):
        try:
            before = _waiting(self._far)
        except OSError:
            self._port.send(frames)
            return
        self._port.send(frames)
        expected = before + sum(6 + 2 * len(data) for _, data in frames)
        _settle(lambda: _waiting(self._far), expected)


class PtyWire:
    """Joins an SlcanPort to a far side through a pseudo-terminal."""

    def __init__(self, far):
        self.far = far
        self.adapter = Adapter()
        self._fd, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._said = 0

    def connect(self):
        port = SlcanPort(self.path, 1_000_000)
        self._line, self._said = port._bus._line, 0
        return _Settled(port, self._fd)

    def say(self, text):
        """Bytes to the master, who has them once this returns."""
        os.write(self._fd, text)
        self._said += len(text)
        _settle(lambda: self._line.heard, self._said)

    def work(self, now):
        data = os.read(self._fd, 65536) if select.select([self._fd], [], [], 0)[0] else b""
        text = self.adapter.text(self.far.exchange(now, self.adapter.frames(data)))
        if text:
            self.say(text)

    def unplug(self):
        for fd in (self._fd, self._slave):
            os.close(fd)
        self._fd = None
        self.work = lambda now: self.far.exchange(now, [])
        _settle(lambda: self._line.gone is not None, True)

    def close(self):
        if self._fd is not None:
            os.close(self._fd)
            os.close(self._slave)


class LinkClock:
    """The clock of a user of the link: while time passes, the link's cycles run."""

    speed = 1.0

    def __init__(self, clock, link):
        self._clock, self._link = clock, link

    def now(self):
        return self._clock.now()

    def wait_until(self, when):
        while self._link.due <= when and math.isfinite(self._link.due):
            self._link.turn()
        self._clock.wait_until(when)


class Bench:
    """A link to six simulated drives and a coupler, and everything to spoil it with."""

    def __init__(self, profile=PAPER, wire=MemoryWire, far=None, store=None, **changes):
        settings = profile.canopen.model_copy(update={"allow_soft_realtime": False} | changes)
        self.profile = profile.model_copy(update={"canopen": settings})
        self.clock = FarClock()
        self.far = Station(self.profile) if far is None else far(self.profile)
        self.wire = wire(self.far)
        self.clock.work = lambda now: self.wire.work(now)  # noqa: PLW0108 - tests replace it
        folder = tempfile.mkdtemp(dir=os.environ["XDG_STATE_HOME"])  # which the tests take away at their end
        store = ReferenceStore(Path(folder) / "references.json") if store is None else store
        self.link = CyclicLink(self.profile, self.clock, self.wire.connect, store)
        self.user = LinkClock(self.clock, self.link)
        self.far.start(self.clock.now())

    def opened(self):
        self.link.open()
        return self

    def close(self):
        try:
            self.link.close()
        finally:
            self.wire.close()


class MemoryLine:
    """Bytes in a list."""

    rate = 92_160.0

    def __init__(self):
        self.sent, self.arrived = b"", b""

    def write(self, data):
        self.sent += data

    def read(self):
        data, self.arrived = self.arrived, b""
        return data

    def close(self):
        pass


class BridgeBench:
    """A BridgeLink to a simulated bridge; ``garble`` and ``lose`` change the bytes on the way."""

    def __init__(self, profile=PAPER, **far):
        self.clock = FarClock()
        self.far = Bridge(profile, self.clock.now(), **far)
        self.line = MemoryLine()
        self.inbound = self.outbound = lambda data: data
        self.clock.work = self.work
        self.link = BridgeLink(profile, self.clock, lambda: self.line)
        self.user = LinkClock(self.clock, self.link)

    def work(self, now):
        sent, self.line.sent = self.line.sent, b""
        self.line.arrived += self.outbound(self.far.exchange(now, self.inbound(sent)))

    def close(self):
        self.link.close()
