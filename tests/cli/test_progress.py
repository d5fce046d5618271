"""Progress: plain lines now and then where there is no terminal, a bar where there is one."""

import io
import sys

import pytest

from cdhr_host.cli import progress
from cdhr_host.cli.progress import Progress, clock_text, status_text


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def run(clock: Clock, seconds: int) -> None:
    with Progress("printing") as shown:
        for k in range(seconds * 8):
            shown.show(k / (seconds * 8), f"layer 1/2  line {k}")
            clock.now += 0.125


def test_short_work_is_silent_off_a_terminal(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    run(clock, 1)
    assert capsys.readouterr() == ("", "")


def test_long_work_says_a_line_every_few_seconds(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    run(clock, 20)
    out, err = capsys.readouterr()
    lines = err.splitlines()
    assert out == ""
    assert len(lines) == 4
    assert lines[0] == "printing: 10.0 %  layer 1/2  line 16  0:02 elapsed  0:18 left"
    assert "\x1b" not in err
    assert "\r" not in err


def test_a_terminal_gets_a_bar_that_goes_away(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "110")
    run(clock, 3)
    assert "printing" in screen.getvalue()
    assert "layer 1/2  line 1" in screen.getvalue()
    assert screen.getvalue().endswith(("\x1b[2K", "\x1b[?25h"))


@pytest.mark.parametrize(("seconds", "text"), [(0, "0:00"), (59.6, "1:00"), (3725, "1:02:05"), (-1, "0:00")])
def test_clock_text(seconds: float, text: str) -> None:
    assert clock_text(seconds) == text


def test_what_is_not_known_is_left_out() -> None:
    assert status_text(None, 3, None, "line 5") == "line 5  0:03 elapsed"
