"""``cdhr jog`` in a real terminal: keys, typed G-code, Ctrl-C, and a terminal that goes away."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from pseudo import Pseudo
from terminal import ROOT, TMUX, Terminal, until

from cdhr_host.profile import find

tmux = pytest.mark.skipif(TMUX is None, reason="tmux is not installed")


@contextmanager
def far_side(folder: Path) -> Iterator[list[str]]:
    """``cdhr sim`` in a process of its own, and how it is jogged.

    The machine is a patient one: what is looked at here is the screen, not how punctual the computer is.
    """
    port, profile = folder / "machine", folder / "patient.toml"
    text = find("paper").read_text(encoding="utf-8")
    for key, patient in (("setpoint_watchdog_ms", 400.0), ("heartbeat_ms", 5000.0)):
        text, found = re.subn(rf"(?m)^{key} = .*$", f"{key} = {patient}", text)
        assert found == 1
    profile.write_text(text)
    with (folder / "sim.txt").open("w") as out:
        sim = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "cdhr_host",
                "sim",
                "--profile",
                str(profile),
                "--link",
                str(port),
                "--trace",
                str(folder / "trace.csv"),
            ],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=out,
            stderr=subprocess.STDOUT,
        )
        try:
            until(port.exists, (folder / "sim.txt").read_text)
            yield ["jog", "--profile", str(profile), "--drives", f"slcan:{port}@1000000"]
        finally:
            sim.send_signal(signal.SIGINT)
            sim.wait(30)


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def driven(terminal: Terminal) -> None:
    """What an operator does first."""
    terminal.shows("IDLE", "nozzle X    0.000 Y    0.000 Z    0.000 mm", "step 1 mm")
    terminal.keys("Right", "Right", "Up", "PPage")
    terminal.shows("nozzle X    2.000 Y    1.000 Z    1.000 mm", "ok X:2.000 Y:1.000 Z:1.000")
    terminal.keys("-", "Left")
    terminal.shows("nozzle X    1.900 Y    1.000 Z    1.000 mm", "step 0.1 mm")
    terminal.type(":G1 X5 Y-3 F1200\r")
    terminal.shows("nozzle X    5.000 Y   -3.000 Z    1.000 mm", "> G1 X5 Y-3 F1200")
    terminal.keys("h")
    terminal.shows("ok X:0.000 Y:0.000 Z:0.000")


@tmux
def test_over_loopback(tmp_path: Path) -> None:
    with Terminal(tmp_path, ["jog"]) as terminal:
        driven(terminal)
        lines = terminal.screen.splitlines()
        assert len(lines) <= 24
        assert max(map(len, lines)) <= 80
        terminal.keys("q")
        assert terminal.code == 0


@tmux
def test_over_a_serial_adapter(tmp_path: Path) -> None:
    with far_side(tmp_path) as jog, Terminal(tmp_path, jog) as terminal:
        driven(terminal)
        terminal.keys("c", *["Right"] * 10)
        terminal.shows("hold a key")
        until(lambda: "nozzle X    0.000" not in terminal.screen, lambda: terminal.screen)
        terminal.shows("  0.0 mm/s")
        terminal.keys("q")
        assert terminal.code == 0
        assert "leaked" not in terminal.screen
        assert "Traceback" not in terminal.screen


@tmux
def test_ctrl_c_holds_and_stays(tmp_path: Path) -> None:
    with Terminal(tmp_path, ["jog"]) as terminal:
        terminal.shows("IDLE")
        terminal.type(":G1 X80 F300\r")
        terminal.shows("> G1 X80 F300")
        until(lambda: "nozzle X    0.000" not in terminal.screen, lambda: terminal.screen)
        terminal.keys("C-c")
        terminal.shows("stopped on the path: X:")
        assert "X:80.000" not in terminal.screen
        assert alive(terminal.process)
        terminal.keys("q")
        assert terminal.code == 0


@tmux
def test_a_terminal_that_is_gone_brings_the_machine_to_rest(tmp_path: Path) -> None:
    with far_side(tmp_path) as jog, Terminal(tmp_path, jog) as terminal:
        terminal.shows("IDLE", "referenced")
        terminal.type(":G1 X120 F600\r")
        until(lambda: "nozzle X    0.000" not in terminal.screen, lambda: terminal.screen)
        process = terminal.process
        terminal.close()
        until(lambda: not alive(process), lambda: f"process {process} still runs")
    places = [line.split(",") for line in (tmp_path / "trace.csv").read_text().splitlines()]
    assert len(places) > 2
    assert places[-1][1:7] == places[-20][1:7]
    assert places[-1][1:7] != places[1][1:7]


def test_a_terminal_that_stalls_and_closes_ends_it(tmp_path: Path) -> None:
    """As a dropped SSH connection: nothing drawn is taken any more, then the other side is closed."""
    with Pseudo(tmp_path, ["jog"]) as terminal:
        terminal.shows("? shows what the keys do")
        terminal.type("?" * 200)
        terminal.stalls()
        terminal.close()
        assert terminal.code == 130


def test_a_terminal_that_closes_without_a_word_ends_it(tmp_path: Path) -> None:
    """Without SIGHUP: the terminal is not the controlling one."""
    with Pseudo(tmp_path, ["jog"], controlling=False) as terminal:
        terminal.shows("? shows what the keys do")
        terminal.type("!")
        terminal.shows("FAULT")
        terminal.close()
        assert terminal.code == 130
