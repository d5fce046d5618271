"""A Marlin client, its engine, and a clock of its own."""

import asyncio
from collections.abc import Callable
from pathlib import Path

from serve_surface import ScriptedSurface

from cdhr_host.serve.folder import Folder
from cdhr_host.serve.host import Host
from cdhr_host.serve.marlin.bench import Bench
from cdhr_host.serve.marlin.engine import Engine
from cdhr_host.serve.script import Executor
from cdhr_host.serve.streaming import Streams


def checked(number: int, text: str) -> bytes:
    body = f"N{number} {text}".encode()
    value = 0
    for byte in body:
        value ^= byte
    return body + f"*{value}\n".encode()


class Client:
    """A client, its engine, and a clock of its own."""

    def __init__(self, tmp_path: Path, room: int = 32) -> None:
        self.surface = ScriptedSurface(room)
        self.folder = Folder(tmp_path / "programs")
        self.host = Host(self.surface, self.folder)
        self.host.open()
        self.executor = Executor(self.host)
        self.streams = Streams(self.host)
        self.now = 100.0
        self.engine = self.another()

    def another(self) -> Engine:
        return Engine(Bench(self.host, self.executor, self.streams, "a test"))

    def say(self, data: bytes | str) -> list[str]:
        self.engine.receive(data.encode() if isinstance(data, str) else data, self.now)
        return self.heard()

    def wait(self, seconds: float = 0.0) -> list[str]:
        self.now += seconds
        self.engine.tick(self.now)
        return self.heard()

    def heard(self) -> list[str]:
        return self.engine.take().decode().splitlines()

    async def settle(self) -> list[str]:
        for _ in range(8):
            await asyncio.sleep(0)
        return self.wait()


def with_client(act: Callable[[Client], object], tmp_path: Path, **more: int) -> None:
    async def run() -> None:
        client = Client(tmp_path, **more)
        made = act(client)
        if asyncio.iscoroutine(made):
            await made
        await client.host.close()

    asyncio.run(run())
