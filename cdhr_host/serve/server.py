"""All doors of one printer on one event loop, until somebody says stop."""

import asyncio
import signal
from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

from cdhr_host.errors import JobError
from cdhr_host.job.surface import JobState, Surface
from cdhr_host.serve.folder import Folder, FolderLimits
from cdhr_host.serve.host import Host
from cdhr_host.serve.klippy.socket import KlippyDoor
from cdhr_host.serve.marlin.bench import Bench
from cdhr_host.serve.marlin.transport import PtyDoor, TcpDoor
from cdhr_host.serve.model import ACTIVE
from cdhr_host.serve.names import refused
from cdhr_host.serve.script import Executor
from cdhr_host.serve.streaming import Streams
from cdhr_host.serve.web.app import HttpDoor
from cdhr_host.serve.web.guard import Guard, is_loopback
from cdhr_host.serve.web.keys import ApiKey

SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
STANDS: Final = frozenset(JobState) - {
    JobState.PRINTING,
    JobState.HOLDING,
    JobState.RESUMING,
    JobState.STOPPING,
}
REST_WITHIN: Final = 30.0
"""s a print may take to come to rest when the server ends"""


@dataclass(frozen=True, slots=True)
class Doors:
    """Which ways in are open."""

    files: Path
    """the upload folder"""
    marlin: Path | None = None
    """name of the pseudo-terminal"""
    tcp: int | None = None
    """port of the line protocol, on loopback"""
    http: int | None = None
    klippy: Path | None = None
    address: str = "127.0.0.1"
    """of the HTTP port"""
    key: ApiKey | None = None
    demands_key: bool = False
    """ask for the key on loopback too"""
    names: frozenset[str] = field(default_factory=frozenset)
    origins: frozenset[str] = field(default_factory=frozenset)


class Server:
    """A printer behind its doors."""

    def __init__(self, surface: Surface, doors: Doors) -> None:
        limits = FolderLimits(surface.profile.serve.upload_max, surface.profile.serve.files_max)
        self.host = Host(surface, Folder(doors.files, limits))
        self.executor = Executor(self.host)
        self.streams = Streams(self.host)
        self.addresses: dict[str, str] = {}
        """where each door is"""
        self.http: HttpDoor | None = None
        self.interrupted = False
        """whether a print was under way when the server ended"""
        self._doors = doors
        if not is_loopback(doors.address) and doors.key is None:
            raise refused(f"{doors.address} can be reached from elsewhere: it needs an API key", kind="key")

    async def run(self, opened: Callable[[], None] = lambda: None, stop: asyncio.Event | None = None) -> None:
        """Open all doors, say so, serve until ``stop`` or a signal, come to rest, close."""
        stop = stop or asyncio.Event()
        async with AsyncExitStack() as stack:
            self.host.open()
            stack.push_async_callback(self.host.close)
            await self._open(stack)
            _on_signals(stop, stack)
            opened()
            await stop.wait()
            await self._come_to_rest()

    async def _open(self, stack: AsyncExitStack) -> None:
        doors = self._doors
        if doors.marlin is not None:
            pty = PtyDoor(doors.marlin, self._bench)
            pty.open()
            stack.callback(pty.close)
            self.addresses["marlin"] = str(doors.marlin)
        if doors.tcp is not None:
            tcp = TcpDoor(doors.tcp, self._bench)
            await tcp.open()
            stack.push_async_callback(tcp.close)
            self.addresses["tcp"] = f"127.0.0.1:{tcp.port}"
        if doors.http is not None:
            await self._open_http(stack, doors.http)
        if doors.klippy is not None:
            klippy = KlippyDoor(self.host, self.executor, doors.klippy)
            await klippy.open()
            stack.push_async_callback(klippy.close)
            self.addresses["klippy"] = str(doors.klippy)

    async def _open_http(self, stack: AsyncExitStack, port: int) -> None:
        doors = self._doors
        guard = Guard(
            doors.key,
            doors.demands_key or not is_loopback(doors.address),
            doors.names,
            doors.origins,
            now=self.host.monotonic,
        )
        self.http = http = HttpDoor(self.host, self.executor, guard, doors.address, port)
        await http.open()
        stack.push_async_callback(http.close)
        shown = f"[{doors.address}]" if ":" in doors.address else doors.address
        self.addresses["http"] = f"http://{shown}:{http.port}/"

    def _bench(self, name: str) -> Bench:
        return Bench(self.host, self.executor, self.streams, name)

    async def _come_to_rest(self) -> None:
        """A print that is under way holds on its path."""
        self.interrupted = self.host.state in ACTIVE
        try:
            if self.interrupted:
                self.host.surface.hold("the server ends")
            await asyncio.wait_for(self.host.until(lambda state: state in STANDS), REST_WITHIN)
        except (JobError, TimeoutError):
            return


def _on_signals(stop: asyncio.Event, stack: AsyncExitStack) -> None:
    loop = asyncio.get_running_loop()
    for number in SIGNALS:
        loop.add_signal_handler(number, stop.set)
        stack.callback(partial(loop.remove_signal_handler, number))
