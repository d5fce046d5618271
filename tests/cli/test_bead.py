"""``cdhr bead`` on the log of a real simulated print."""

import json

import pytest
from typer.testing import CliRunner

from cdhr_host.cli.app import app

PROGRAM = "M83\nG0 X10 F3000\nG1 X30 E223.2 F1200\nG1 Y20 E223.2\nG0 Z9\n"


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bead")
    program, log = folder / "corner.gcode", folder / "run.csv"
    program.write_text(PROGRAM)
    words = ["stream", str(program), "--material", "porcelain", "--speed", "50", "--log", str(log)]
    assert CliRunner().invoke(app, words).exit_code == 0
    return log


def test_the_bead_of_a_print_is_even_and_starts_and_ends_where_it_was_drawn(logged):
    done = CliRunner().invoke(app, ["bead", str(logged), "--json"])
    assert done.exit_code == 0
    (bead,) = json.loads(done.stdout)["beads"]
    assert bead["line"] == 3
    assert bead["length_mm"] == pytest.approx(40.0, abs=0.5)
    assert bead["planned_mm3"] == pytest.approx(446.4, rel=0.01)
    assert 0.95 < bead["least"] <= bead["most"] < 1.05
    assert abs(bead["start_late_mm"]) < 0.5
    assert abs(bead["end_late_mm"]) < 0.5


def test_it_is_told_as_a_table(logged):
    done = CliRunner().invoke(app, ["bead", str(logged)])
    lines = done.stdout.splitlines()
    assert lines[0].split()[:2] == ["line", "length"]
    assert lines[-1].startswith("1 beads: ")


def test_a_log_without_clay_is_refused(tmp_path):
    log = tmp_path / "plain.csv"
    log.write_text("t_s,line\n0,1\n")
    done = CliRunner().invoke(app, ["bead", str(log)])
    assert done.exit_code == 2
    assert "has no column x_mm" in done.output
