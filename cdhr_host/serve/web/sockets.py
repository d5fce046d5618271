"""Websockets: calls in, status out once a second and whenever the job changes."""

import asyncio
from contextlib import suppress
from typing import Final

from aiohttp import WSMsgType, web

from cdhr_host.job.surface import Event, JobState
from cdhr_host.serve.host import Host, Message
from cdhr_host.serve.model import changes, chosen
from cdhr_host.serve.web.methods import Methods, Session, proc_stats
from cdhr_host.serve.web.rpc import answered, notification

EVERY: Final = 1.0
"""s between two pushes; pages call a socket dead after 10 s of silence"""
MESSAGE_MAX: Final = 1 << 20
WAITING_MAX: Final = 64
"""messages a client may leave unread; then it is hung up on"""
READS_WITHIN: Final = 30.0
"""s a client may leave its answers unread"""
CLIENTS_MAX: Final = 32


class Listener:
    """One websocket."""

    def __init__(self, socket: web.WebSocketResponse, session: Session) -> None:
        self.socket = socket
        self.session = session
        self._waiting: asyncio.Queue[tuple[str, bool]] = asyncio.Queue(WAITING_MAX)
        self._answers = asyncio.Semaphore(WAITING_MAX // 2)
        """So that one who asks much, and reads, has room left for what is told."""
        self._writer = asyncio.create_task(self._write())

    def tell(self, text: str) -> None:
        """Send when it can take it; a client that reads nothing is let go."""
        try:
            self._waiting.put_nowait((text, False))
        except asyncio.QueueFull:
            self._writer.cancel()

    async def answer(self, text: str) -> None:
        """Send, and read no further call before there is room; TimeoutError when nothing is read."""
        async with asyncio.timeout(READS_WITHIN):
            await self._answers.acquire()
            await self._waiting.put((text, True))

    def end(self) -> None:
        """No more."""
        self._writer.cancel()

    async def _write(self) -> None:
        try:
            while True:
                text, answers = await self._waiting.get()
                await self.socket.send_str(text)
                if answers:
                    self._answers.release()
        except (ConnectionError, RuntimeError):
            return
        finally:
            with suppress(Exception):
                await asyncio.wait_for(self.socket.close(), 1.0)


class Sockets:
    """All websockets of one port."""

    def __init__(self, host: Host, methods: Methods) -> None:
        self._host = host
        self._methods = methods
        self._listeners: set[Listener] = set()
        self._halted = False
        self._ends = (host.on_message(self._message), host.on_event(self._event))
        self._pushing = asyncio.create_task(self._push_for_ever())

    def close(self) -> None:
        """Hang up on all."""
        for end in self._ends:
            end()
        self._pushing.cancel()
        for listener in self._listeners:
            listener.end()

    async def serve(self, request: web.Request) -> web.StreamResponse:
        """One client, until it goes."""
        if len(self._listeners) >= CLIENTS_MAX:
            raise web.HTTPServiceUnavailable(reason="too many websockets")
        socket = web.WebSocketResponse(max_msg_size=MESSAGE_MAX, heartbeat=30.0)
        await socket.prepare(request)
        listener = Listener(socket, self._methods.session(lasting=True))
        self._listeners.add(listener)
        try:
            listener.tell(notification("notify_klippy_ready"))
            with suppress(TimeoutError):
                await self._converse(socket, listener)
        finally:
            self._listeners.discard(listener)
            listener.end()
        return socket

    async def _converse(self, socket: web.WebSocketResponse, listener: Listener) -> None:
        async for message in socket:
            if message.type is not WSMsgType.TEXT:
                continue
            answer = await answered(self._methods, listener.session, message.data)
            if answer is not None:
                await listener.answer(answer)

    def push(self) -> None:
        """Tell everyone what has changed."""
        wanted = {name for listener in self._listeners for name in listener.session.subscribed}
        found = self._host.objects(wanted) if wanted else {}
        now = self._host.monotonic()
        for listener in self._listeners:
            session = listener.session
            if session.subscribed:
                mine = chosen(
                    {name: found[name] for name in session.subscribed if name in found}, session.subscribed
                )
                listener.tell(notification("notify_status_update", changes(session.sent, mine), now))
                session.sent = mine

    def files_changed(self, action: str, path: str, size: int, modified: float) -> None:
        """A program has come or gone."""
        item = {"path": path, "root": "gcodes", "size": size, "modified": modified, "permissions": "rw"}
        self._tell(notification("notify_filelist_changed", {"action": action, "item": item}))

    async def _push_for_ever(self) -> None:
        while True:
            await asyncio.sleep(EVERY)
            self.push()
            self._tell(notification("notify_proc_stat_update", proc_stats()))

    def _event(self, event: Event) -> None:
        halted = event.status.state is JobState.FAULT
        if halted != self._halted:
            self._halted = halted
            self._tell(notification("notify_klippy_shutdown" if halted else "notify_klippy_ready"))
        if event.kind == "state":
            self.push()

    def _message(self, message: Message) -> None:
        if message.kind == "response":
            self._tell(notification("notify_gcode_response", message.text))

    def _tell(self, text: str) -> None:
        for listener in list(self._listeners):
            listener.tell(text)
