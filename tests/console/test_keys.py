"""Keys: what a terminal sends, and what the console makes of it."""

import pytest

from cdhr_host.console.keys import read_key
from cdhr_host.console.session import Reply
from cdhr_host.console.terminal import KeyConsole


def keys(text: str) -> list[str]:
    """All keys of what was typed, up to the end of input."""
    waiting = list(text)

    def read(_: bool) -> str:
        return waiting.pop(0) if waiting else ""

    found = []
    while (key := read_key(read)) != "end":
        found.append(key)
    return found


@pytest.mark.parametrize(
    ("sent", "found"),
    [
        ("\x1b[A\x1b[B\x1b[C\x1b[D", ["up", "down", "right", "left"]),
        ("\x1bOA\x1b[5~\x1b[6~", ["up", "page up", "page down"]),
        ("G1\r\x7f", ["G", "1", "enter", "backspace"]),
        ("\x1b", [""]),
        ("\x1b[Z", [""]),
        ("\x04x", []),
    ],
)
def test_sequences_become_keys(sent: str, found: list[str]) -> None:
    assert keys(sent) == found


class Recorder:
    """A session that moves nothing."""

    def __init__(self) -> None:
        self.did: list[tuple[object, ...]] = []

    def run(self, line: str) -> Reply:
        self.did.append((line,))
        return Reply(True, "there")

    def jog(self, axis: str, distance_mm: float) -> Reply:
        self.did.append((axis, distance_mm))
        return Reply(False, "error: no")


@pytest.fixture
def console() -> tuple[KeyConsole, Recorder, list[str]]:
    shown: list[str] = []
    recorder = Recorder()
    return KeyConsole(recorder, shown.append), recorder, shown  # type: ignore[arg-type]


def press(console: KeyConsole, *pressed: str) -> list[bool]:
    return [console.press(key) for key in pressed]


def test_arrows_jog_by_the_step(console: tuple[KeyConsole, Recorder, list[str]]) -> None:
    keyboard, session, shown = console
    press(keyboard, "right", "+", "up", "-", "-", "page down", "-", "left")
    assert session.did == [("X", 1.0), ("Y", 10.0), ("Z", -0.1), ("X", -0.1)]
    assert shown == ["error: no"] * 4


def test_typed_lines_run_on_enter(console: tuple[KeyConsole, Recorder, list[str]]) -> None:
    keyboard, session, shown = console
    assert all(press(keyboard, *"G1 X-5q+?", "backspace", "enter", "enter"))
    assert session.did == [("G1 X-5q+",)]
    assert shown == ["> G1 X-5q+", "ok there"]


def test_the_prompt_shows_step_and_line(console: tuple[KeyConsole, Recorder, list[str]]) -> None:
    keyboard, _, _ = console
    press(keyboard, "+", *"G1")
    assert keyboard.prompt == "[10 mm] > G1"


@pytest.mark.parametrize("key", ["q", "end"])
def test_leaving(console: tuple[KeyConsole, Recorder, list[str]], key: str) -> None:
    assert not console[0].press(key)


def test_help(console: tuple[KeyConsole, Recorder, list[str]]) -> None:
    keyboard, _, shown = console
    press(keyboard, "?", "")
    assert "PgUp" in shown[0]
