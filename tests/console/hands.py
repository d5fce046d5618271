"""An operator's hands and eyes."""

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path

from textual.pilot import Pilot
from textual.widgets import RichLog, Static

from cdhr_host.console.desk import Desk
from cdhr_host.job.printer import Printer
from cdhr_host.job.surface import JobState

PATIENCE = 30.0
"""s until something that should happen is given up"""


class Hands:
    """An operator: a desk, its printer, and what can be read."""

    def __init__(self, pilot: Pilot[None], printer: Printer) -> None:
        self.pilot = pilot
        self.printer = printer
        self.press = pilot.press

    @property
    def desk(self) -> Desk:
        assert isinstance(self.pilot.app, Desk)
        return self.pilot.app

    def text(self, name: str) -> str:
        return str(self.desk.query_one(f"#{name}", Static).content)

    @property
    def messages(self) -> str:
        return "\n".join(strip.text for strip in self.desk.query_one(RichLog).lines)

    async def until(self, happened: Callable[[], bool], *, every: float = 0.02) -> None:
        loop = asyncio.get_running_loop()
        given_up = loop.time() + PATIENCE
        while not happened():
            assert loop.time() < given_up, f"{self.text('job')}\n{self.messages}"
            await self.pilot.pause(every)

    async def type(self, text: str) -> None:
        await self.press("colon", *text, "enter")

    async def print(self, path: Path) -> None:
        await self.press("f3", *str(path), "enter")
        await self.until(lambda: self.printer.state is JobState.READY)
        await self.press("f5")
        await self.until(lambda: self.printer.state is JobState.PRINTING)


def run(test: Coroutine[None, None, None]) -> None:
    asyncio.run(test)
