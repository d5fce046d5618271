"""Progress on standard error: a live bar on a terminal, now and then a line elsewhere."""

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

from cdhr_host.cli.refusals import say

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress

FIRST_LINE = 2.0
"""s of silence before the first plain line"""
BETWEEN_LINES = 5.0
"""s between plain lines"""
BETWEEN_FRAMES = 0.1
"""s between redraws of the bar"""


def clock_text(duration: float) -> str:
    """s -> ``m:ss`` or ``h:mm:ss``."""
    minutes, seconds = divmod(round(max(0.0, duration)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"


def status_text(fraction: float | None, elapsed: float, left: float | None, where: str) -> str:
    """``41.7 %  layer 2  line 118  0:12 elapsed  0:17 left``; what is not known is left out."""
    parts = [
        f"{100 * fraction:5.1f} %" if fraction is not None else "",
        where,
        f"{clock_text(elapsed)} elapsed",
        f"{clock_text(left)} left" if left is not None else "",
    ]
    return "  ".join(part for part in parts if part)


class Progress:
    """Shows how far a task is. ``show`` may be called at any rate."""

    def __init__(self, task: str) -> None:
        self._task = task
        self._start = time.monotonic()
        live = sys.stderr.isatty()
        self._due = self._start if live else self._start + FIRST_LINE
        self._bar = _bar() if live else None

    @property
    def due(self) -> bool:
        """Whether ``show`` would show anything now."""
        return time.monotonic() >= self._due

    def show(self, fraction: float | None, where: str, left: float | None = None) -> None:
        """``fraction`` of the task done, 0 to 1; ``left`` in s, guessed from the fraction when not given."""
        now = time.monotonic()
        if now < self._due:
            return
        elapsed = now - self._start
        if left is None and fraction:
            left = elapsed * (1 - fraction) / fraction
        text = status_text(fraction, elapsed, left, where)
        if self._bar is None:
            self._due = now + BETWEEN_LINES
            say(f"{self._task}: {text.strip()}")
        else:
            self._due = now + BETWEEN_FRAMES
            self._draw(fraction, text)

    def _draw(self, fraction: float | None, text: str) -> None:
        assert self._bar is not None
        if not self._bar.tasks:
            self._bar.start()
            self._bar.add_task(self._task, total=1.0 if fraction is not None else None, text="")
        self._bar.update(self._bar.task_ids[0], completed=fraction, text=text, refresh=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None and self._bar.tasks:
            self._bar.stop()


def _bar() -> "RichProgress":
    """A bar that is gone when it stops, redrawn only when told to: no thread beside a moving machine."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as RichProgress

    return RichProgress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("{task.fields[text]}"),
        console=Console(stderr=True),
        auto_refresh=False,
        transient=True,
    )
