"""``cdhr stream --control``: loops closed on the simulated machine."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from cdhr_host.cli.app import app


def stream(tmp_path: Path, *arguments: str):
    file = tmp_path / "part.gcode"
    file.write_text("G1 X3 Y2 F600\nG4 P200\nG1 X0 Y0\n")
    return CliRunner().invoke(app, ["stream", str(file), "--speed", "1000", *arguments])


@pytest.mark.parametrize("control", ["none", "outer", "ppc"])
def test_each_loop_prints_to_the_end(tmp_path, control):
    result = stream(tmp_path, "--control", control)
    assert result.exit_code == 0, result.stderr
    assert "at rest, air off" in result.stdout


def test_loops_are_for_the_simulated_machine(tmp_path):
    result = stream(tmp_path, "--control", "outer", "--drives", "socketcan:can0")
    assert result.exit_code == 2


def test_unknown_loop_is_refused(tmp_path):
    assert stream(tmp_path, "--control", "magic").exit_code == 2
