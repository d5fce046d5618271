"""Connections before they speak: how many there may be, and how long they may stay silent."""

import asyncio
import logging
from typing import Final
from weakref import WeakSet

from aiohttp import web
from aiohttp.http import HttpProcessingError

from cdhr_host.serve.names import shown

CONNECTIONS_MAX: Final = 64
HEADERS_WITHIN: Final = 10.0
"""s for the first request's headers"""


def _plainly(record: logging.LogRecord) -> bool:
    """What is no HTTP is a client's slip: one line, no traceback."""
    error = record.exc_info[1] if record.exc_info else None
    if isinstance(error, HttpProcessingError):
        record.msg, record.args = f"refused a request that is not HTTP: {shown(error.message, 200)}", ()
        record.exc_info = record.exc_text = None
        record.levelno, record.levelname = logging.WARNING, "WARNING"
    return True


PARSER_LOG: Final = logging.getLogger("cdhr.serve.http")
PARSER_LOG.addFilter(_plainly)


class Gates:
    """All connections of one port."""

    def __init__(self, server: web.Server, *, headers_within: float = HEADERS_WITHIN) -> None:
        self._server = server
        self.headers_within = headers_within
        self.count = 0
        self.spoke: WeakSet[asyncio.BaseTransport] = WeakSet()

    def __call__(self) -> asyncio.Protocol:
        """A protocol for a new connection."""
        return Gate(self._server(), self)


class Gate(asyncio.Protocol):
    """One connection: aiohttp's protocol behind a door-keeper."""

    def __init__(self, inner: asyncio.Protocol, gates: Gates) -> None:
        self._inner = inner
        self._gates = gates
        self._timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Count it; one too many is hung up on."""
        assert isinstance(transport, asyncio.Transport)
        self._gates.count += 1
        self._inner.connection_made(transport)
        if self._gates.count > CONNECTIONS_MAX:
            transport.abort()
            return
        loop = asyncio.get_running_loop()
        self._timer = loop.call_later(self._gates.headers_within, self._check, transport)

    def _check(self, transport: asyncio.Transport) -> None:
        if transport not in self._gates.spoke:
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """It has gone."""
        self._gates.count -= 1
        if self._timer is not None:
            self._timer.cancel()
        self._inner.connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Handed on."""
        self._inner.data_received(data)

    def eof_received(self) -> bool | None:
        """Handed on."""
        return self._inner.eof_received()

    def pause_writing(self) -> None:
        """Handed on."""
        self._inner.pause_writing()

    def resume_writing(self) -> None:
        """Handed on."""
        self._inner.resume_writing()
