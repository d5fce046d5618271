"""``cdhr jog`` with lines from a pipe: answers, exit codes, Ctrl-C."""

import os
import pty
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from cdhr_host.cli.app import app

ROOT = Path(__file__).parents[2]
UNDER_WAY = 2.0
"""s after which a way of 20 s was begun, and is not done"""
PLACE = re.compile(r"ok X(\S+) Y(\S+) Z(\S+) \| sliders((?: \S+){6}) mm \| cables((?: \S+){9}) N")


def jogged(lines: str, *arguments: str) -> Result:
    return CliRunner().invoke(app, ["jog", "--speed", "1000", *arguments], input=lines)


def test_each_line_is_answered_with_where_the_machine_is() -> None:
    done = jogged("G1 X10 Y-5 F3000\n\nG28\nq\nG1 X99\n")
    assert done.exit_code == 0
    first, last = (PLACE.fullmatch(line) for line in done.stdout.splitlines())
    assert first is not None
    assert last is not None
    assert first.group(1, 2, 3) == ("10.000", "-5.000", "0.000")
    assert last[4].split() == ["0.000"] * 6
    assert all(0.5 <= float(force) <= 12.0 for force in first[5].split())


@pytest.mark.parametrize(
    ("line", "code", "why"),
    [
        ("G1 X oops", 4, "error: "),
        ("G1 X280 F3000", 5, "error: cable 4 would carry 13.0"),
        ("G1 Z-1", 5, "error: the nozzle would be at z = -1.000 mm, below the bed at 0 mm"),
    ],
)
def test_the_exit_code_is_that_of_the_first_refusal(line: str, code: int, why: str) -> None:
    done = jogged(f"G1 X5 F3000\n{line}\nG1 X oops\nG1 X6\n")
    assert done.exit_code == code
    answers = done.stdout.splitlines()
    assert answers[0].startswith("ok X5.000")
    assert answers[1].startswith(why)
    assert answers[-1].startswith("ok X6.000")


def test_speed_is_for_simulated_drives() -> None:
    done = CliRunner().invoke(app, ["jog", "--speed", "2", "--drives", "slcan:/dev/null@1000000"], input="")
    assert done.exit_code == 2
    assert "--speed is for simulated drives only" in done.stderr


def test_a_screen_does_not_go_into_a_file(tmp_path: Path) -> None:
    terminal, far = pty.openpty()
    try:
        command = [sys.executable, "-m", "cdhr_host", "jog"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(tmp_path)}
        done = subprocess.run(
            command, stdin=far, capture_output=True, encoding="utf-8", env=environment, check=False
        )
    finally:
        os.close(terminal)
        os.close(far)
    assert done.returncode == 2
    assert "which is no terminal\nhint: do not redirect it" in done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_stops_on_the_path(number: signal.Signals, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(tmp_path)}
    command = [sys.executable, "-m", "cdhr_host", "jog"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, encoding="utf-8", env=environment, **pipes) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdin.write("G1 X1 F600\n")
        process.stdin.flush()
        assert process.stdout.readline().startswith("ok X1.000")
        process.stdin.write("G1 X100 F300\nG1 X0\n")
        process.stdin.flush()
        time.sleep(UNDER_WAY)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    stopped = re.match(r"stopped on the path: X:(\S+) Y:0.000 Z:0.000\n", out)
    assert stopped is not None, out
    assert 1.0 < float(stopped[1]) < 60.0
    assert "X0.000" not in out
    assert err.splitlines() == ["cdhr: stopping on the path, air off"]
