"""A server on free ports with a scripted printer, for tests that speak to its doors."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import aiohttp
from serve_surface import ScriptedSurface

from cdhr_host.serve.server import Doors, Server


@dataclass
class Open:
    server: Server
    surface: ScriptedSurface
    web: aiohttp.ClientSession
    url: str


@asynccontextmanager
async def open_doors(tmp_path: Path, **doors: object) -> AsyncIterator[Open]:
    surface = ScriptedSurface()
    server = Server(surface, Doors(files=tmp_path / "programs", http=0, **doors))
    stop, opened = asyncio.Event(), asyncio.Event()
    running = asyncio.create_task(server.run(opened.set, stop))
    waiting = asyncio.create_task(opened.wait())
    await asyncio.wait([running, waiting], return_when=asyncio.FIRST_COMPLETED)
    if running.done():
        running.result()
    try:
        async with aiohttp.ClientSession(timeout=aiohttp.ClientTimeout(60)) as web:
            yield Open(server, surface, web, server.addresses["http"].rstrip("/"))
    finally:
        stop.set()
        await running


def with_doors(act: Callable[[Open], Awaitable[None]], tmp_path: Path, **doors: object) -> None:
    async def run() -> None:
        async with open_doors(tmp_path, **doors) as opened:
            await act(opened)

    asyncio.run(run())
