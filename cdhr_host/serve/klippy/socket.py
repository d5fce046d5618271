"""The unix socket itself: frames, clients, pushes."""

import asyncio
import json
import os
import socket
import stat
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from cdhr_host.job.surface import Event
from cdhr_host.serve.host import Host, Message
from cdhr_host.serve.klippy.endpoints import EndpointError, Endpoints, Session
from cdhr_host.serve.model import changes, chosen
from cdhr_host.serve.names import refused
from cdhr_host.serve.script import Executor

END: Final = b"\x03"
FRAME_MAX: Final = 1 << 20
CLIENTS_MAX: Final = 8
UNREAD_MAX: Final = 1 << 20
"""bytes a client may leave unread; then it is hung up on"""
CALLS_MAX: Final = 64
"""calls of one client under way at once"""
EVERY: Final = 0.25
"""s between two pushes, as in Klipper"""


class Client:
    """One connection: calls run side by side, each answered by its id."""

    def __init__(self, endpoints: Endpoints, writer: asyncio.StreamWriter) -> None:
        self.session = Session()
        self._endpoints = endpoints
        self._writer = writer
        self._calls: set[asyncio.Task[None]] = set()

    async def serve(self, reader: asyncio.StreamReader) -> None:
        """Until it goes, or sends a frame that is too long."""
        try:
            while True:
                frame = await reader.readuntil(END)
                await self._take(frame[:-1])
        except (asyncio.IncompleteReadError, asyncio.LimitOverrunError, ConnectionError):
            return
        finally:
            for call in self._calls:
                call.cancel()
            self._writer.close()

    def send(self, message: dict[str, Any]) -> None:
        """A message for it; one that reads nothing is let go."""
        if self._writer.is_closing():
            return
        self._writer.write(json.dumps(message).encode() + END)
        if self._writer.transport.get_write_buffer_size() > UNREAD_MAX:
            self._writer.transport.abort()

    def hang_up(self) -> None:
        """End it."""
        self._writer.transport.abort()

    async def _take(self, frame: bytes) -> None:
        try:
            asked = json.loads(frame)
        except (ValueError, RecursionError):
            return
        if not isinstance(asked, dict) or not isinstance(asked.get("method"), str):
            return
        while len(self._calls) >= CALLS_MAX:
            await asyncio.wait(self._calls, return_when=asyncio.FIRST_COMPLETED)
        call = asyncio.create_task(self._call(asked))
        self._calls.add(call)
        call.add_done_callback(self._calls.discard)

    async def _call(self, asked: dict[str, Any]) -> None:
        params, number = asked.get("params") or {}, asked.get("id")
        try:
            if not isinstance(params, dict):
                raise EndpointError("params must be a dictionary")
            answer = {"result": await self._endpoints.call(self.session, asked["method"], params)}
        except EndpointError as error:
            answer = {"error": {"error": "WebRequestError", "message": str(error)}}
        if number is not None:
            self.send({"id": number, **answer})


def _heard(path: Path) -> bool:
    """Whether a socket has a listener; one that was left behind has none."""
    with socket.socket(socket.AF_UNIX) as asking, suppress(FileNotFoundError, ConnectionRefusedError):
        asking.connect(str(path))
        return True
    return False


class KlippyDoor:
    """The socket at one path; only this user may open it."""

    def __init__(self, host: Host, executor: Executor, path: Path) -> None:
        self.path = path
        self._host = host
        self._endpoints = Endpoints(host, executor)
        self._clients: set[Client] = set()
        self._server: asyncio.Server | None = None
        self._ends = (host.on_message(self._message), host.on_event(self._event))
        self._pushing: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Listen; JobError when the path is taken by something else."""
        if self.path.exists() and not stat.S_ISSOCK(self.path.stat().st_mode):
            raise refused(f"{self.path} is there already and is no socket", "name another --klippy-socket")
        if _heard(self.path):
            raise refused(f"something listens at {self.path} already", "name another --klippy-socket")
        self.path.unlink(missing_ok=True)
        before = os.umask(0o077)
        try:
            self._server = await asyncio.start_unix_server(self._serve, self.path, limit=FRAME_MAX)
        finally:
            os.umask(before)
        self._pushing = asyncio.create_task(self._push_for_ever())

    async def close(self) -> None:
        """Hang up, close, and take the name away."""
        for end in self._ends:
            end()
        if self._pushing is not None:
            self._pushing.cancel()
        if self._server is not None:
            self._server.close()
            with suppress(FileNotFoundError):
                self.path.unlink()
        for client in list(self._clients):
            client.hang_up()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._clients) >= CLIENTS_MAX:
            writer.close()
            return
        client = Client(self._endpoints, writer)
        self._clients.add(client)
        try:
            await client.serve(reader)
        finally:
            self._clients.discard(client)

    def push(self) -> None:
        """Tell every subscriber what has changed."""
        wanted = {name for client in self._clients for name in client.session.status.wanted}
        found = self._host.objects(wanted) if wanted else {}
        now = self._host.monotonic()
        for client in self._clients:
            told = client.session.status
            mine = chosen({name: found[name] for name in told.wanted if name in found}, told.wanted)
            changed = changes(told.sent, mine)
            told.sent = mine
            if changed:
                client.send({**told.template, "params": {"eventtime": now, "status": changed}})

    async def _push_for_ever(self) -> None:
        while True:
            await asyncio.sleep(EVERY)
            self.push()

    def _event(self, event: Event) -> None:
        if event.kind == "state":
            self.push()

    def _message(self, message: Message) -> None:
        if message.kind != "response":
            return
        for client in self._clients:
            if client.session.output is not None:
                client.send({**client.session.output, "params": {"response": message.text}})
