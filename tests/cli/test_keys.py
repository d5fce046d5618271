"""Keys pressed while a print runs: all of them count, however fast they come."""

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest

from cdhr_host.cli.keys import Keys
from cdhr_host.job.surface import JobState


@dataclass
class Printer:
    state: JobState = JobState.PRINTING
    pause: None = None
    feed: float = 1.0
    words: list[str] = field(default_factory=list)

    def status(self) -> SimpleNamespace:
        return SimpleNamespace(feed_override=self.feed)

    def override(self, *, feed: float) -> None:
        self.words.append(f"feed {feed}")

    def hold(self, reason: str) -> None:
        self.words.append("hold")
        self.state = JobState.HELD

    def resume(self) -> None:
        self.words.append("resume")


@pytest.fixture
def keyboard(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    keys, terminal = os.openpty()
    with os.fdopen(terminal) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        yield keys


@pytest.mark.parametrize(
    ("pressed", "words"),
    [
        (b"", []),
        (b"+++", ["feed 1.3"]),
        (b"--+", ["feed 0.9"]),
        (b" ", ["hold"]),
        (b"+ ", ["hold", "feed 1.1"]),
        (b"  ", ["hold", "resume"]),
        (b"x\n", []),
        (b"-" * 30, ["feed 0.1"]),
        (b"+" * 30, ["feed 3.0"]),
    ],
)
def test_every_key_counts_at_once(keyboard: int, pressed: bytes, words: list[str]) -> None:
    printer = Printer()
    with Keys() as keys:
        os.write(keyboard, pressed)
        keys.obey(printer)  # type: ignore[arg-type]
    assert printer.words == words


def test_a_terminal_that_is_gone_presses_nothing(keyboard: int) -> None:
    printer = Printer()
    with Keys() as keys:
        os.close(keyboard)
        keys.obey(printer)  # type: ignore[arg-type]
    assert printer.words == []
