"""Marlin's ways in: a pseudo-terminal with a stable name, and a TCP port on loopback."""

import asyncio
import errno
import os
import select
import tty
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from cdhr_host.serve.marlin.bench import Bench
from cdhr_host.serve.marlin.engine import Engine
from cdhr_host.serve.names import refused

READ: Final = 1 << 14
PATIENT: Final = 0.25
"""s between two looks at the clock while no answer is owed"""
EAGER: Final = 0.01
"""s between two looks while one is"""
CLIENTS_MAX: Final = 4
"""TCP clients at once"""

MakeBench = Callable[[str], Bench]


class Ticking:
    """Calls an engine now and then, sooner while it owes an answer."""

    def __init__(self, engine: Engine, after: Callable[[], None]) -> None:
        self._engine = engine
        self._after = after
        self._loop = asyncio.get_running_loop()
        self._eager = engine.waiting
        self._timer = self._later()

    def again(self) -> None:
        """The engine has heard something: look at it sooner where it owes an answer now."""
        if self._engine.waiting and not self._eager:
            self._timer.cancel()
            self._timer = self._later()

    def stop(self) -> None:
        """No more."""
        self._timer.cancel()

    def _later(self) -> asyncio.TimerHandle:
        self._eager = self._engine.waiting
        return self._loop.call_later(EAGER if self._eager else PATIENT, self._tick)

    def _tick(self) -> None:
        self._engine.tick(self._loop.time())
        self._timer = self._later()
        self._after()


class PtyDoor:
    """A pseudo-terminal whose client comes and goes; ``link`` always names it.

    The far end is closed here, so that its hang-up tells whether a client has it open.
    """

    def __init__(self, link: Path, make_bench: MakeBench) -> None:
        self.link = link
        self._make_bench = make_bench
        self._fd, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        os.close(slave)
        os.set_blocking(self._fd, False)
        self._engine: Engine | None = None
        self._ticking: Ticking | None = None
        self._looking: asyncio.TimerHandle | None = None
        self._loop = asyncio.get_running_loop()
        self._reads = self._writes = False
        """what the event loop looks out for; asking it for what it does already is dear"""

    def open(self) -> None:
        """Make the name, wait for clients; JobError when it means something else already."""
        if self.link.exists() and not self.link.is_symlink():
            raise refused(f"{self.link} is there already and is no link", "give another name to --marlin")
        if self.link.exists() and os.readlink(self.link) != self.path:
            raise refused(
                f"{self.link} leads to {os.readlink(self.link)}, which is in use",
                "another cdhr serve? Give another name to --marlin, or remove this one",
            )
        fresh = self.link.with_name(f"{self.link.name}.{os.getpid()}")
        fresh.symlink_to(self.path)
        fresh.replace(self.link)
        self._look()

    def close(self) -> None:
        """The name goes, the client is hung up."""
        if self._looking is not None:
            self._looking.cancel()
        self._gone()
        os.close(self._fd)
        with suppress(OSError):
            if os.readlink(self.link) == self.path:
                self.link.unlink()

    def _look(self) -> None:
        """Whether a client has opened the far end."""
        poll = select.poll()
        poll.register(self._fd, select.POLLIN)
        hung_up = any(event & select.POLLHUP for _, event in poll.poll(0))
        if not hung_up:
            self._come()
        self._looking = self._loop.call_later(0.05, self._look) if hung_up else None

    def _come(self) -> None:
        self._engine = Engine(self._make_bench("the serial line"))
        self._ticking = Ticking(self._engine, self._flush)
        self._look_out(reads=True, writes=False)

    def _look_out(self, *, reads: bool, writes: bool) -> None:
        if reads is not self._reads:
            self._reads = reads
            if reads:
                self._loop.add_reader(self._fd, self._readable)
            else:
                self._loop.remove_reader(self._fd)
        if writes is not self._writes:
            self._writes = writes
            if writes:
                self._loop.add_writer(self._fd, self._flush)
            else:
                self._loop.remove_writer(self._fd)

    def _gone(self) -> None:
        self._look_out(reads=False, writes=False)
        if self._ticking is not None:
            self._ticking.stop()
        if self._engine is not None:
            self._engine.closed()
        self._engine = self._ticking = None

    def _readable(self) -> None:
        if self._engine is None or self._ticking is None:
            return
        try:
            data = os.read(self._fd, READ)
        except BlockingIOError:
            return
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            data = b""
        if not data:
            self._gone()
            self._look()
            return
        self._engine.receive(data, self._loop.time())
        self._flush()
        self._ticking.again()

    def _flush(self) -> None:
        """Hand over what the client takes; read on only while the engine can hold it."""
        if self._engine is None:
            return
        out = self._engine.take()
        if out:
            with suppress(BlockingIOError, OSError):
                out = out[os.write(self._fd, out) :]
        if out:
            self._engine.put_back(out)
        self._look_out(reads=not self._engine.full, writes=bool(out))


class TcpClient(asyncio.Protocol):
    """One TCP connection."""

    def __init__(self, make_bench: MakeBench, clients: set["TcpClient"]) -> None:
        self._make_bench = make_bench
        self._clients = clients
        self._engine: Engine | None = None
        self._ticking: Ticking | None = None
        self._stalled = False
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has come."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        transport.set_write_buffer_limits(high=READ)
        if len(self._clients) >= CLIENTS_MAX:
            transport.write(b"Error:too many clients\n")
            transport.close()
            return
        self._clients.add(self)
        self._engine = Engine(self._make_bench("a TCP client"))
        self._ticking = Ticking(self._engine, self._flush)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's shape
        """It has gone."""
        self._clients.discard(self)
        if self._ticking is not None:
            self._ticking.stop()
        if self._engine is not None:
            self._engine.closed()
        self._engine = None

    def data_received(self, data: bytes) -> None:
        """Bytes of it."""
        if self._engine is None or self._ticking is None:
            return
        self._engine.receive(data, asyncio.get_running_loop().time())
        self._flush()
        self._ticking.again()

    def pause_writing(self) -> None:
        """It does not read."""
        self._stalled = True

    def resume_writing(self) -> None:
        """It reads again."""
        self._stalled = False
        self._flush()

    def hang_up(self) -> None:
        """End it."""
        if self._transport is not None:
            self._transport.abort()

    def _flush(self) -> None:
        if self._engine is None or self._transport is None:
            return
        if not self._stalled:
            self._transport.write(self._engine.take())
        if self._engine.full:
            self._transport.pause_reading()
        elif not self._transport.is_reading():
            self._transport.resume_reading()


class TcpDoor:
    """A TCP port on loopback: the protocol has no password, so it is never bound elsewhere."""

    def __init__(self, port: int, make_bench: MakeBench) -> None:
        self.port = port
        self._make_bench = make_bench
        self._clients: set[TcpClient] = set()
        self._server: asyncio.Server | None = None

    async def open(self) -> None:
        """Listen."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(
            lambda: TcpClient(self._make_bench, self._clients), "127.0.0.1", self.port
        )
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Hang up and close."""
        if self._server is not None:
            self._server.close()
        for client in list(self._clients):
            client.hang_up()

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()
