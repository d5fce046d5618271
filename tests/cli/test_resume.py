"""``cdhr resume``: after a kill -9, and what it refuses."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from cdhr_host.cli.app import app
from cdhr_host.job.journal import read_journal

ROOT = Path(__file__).parents[2]
PATIENCE = 120.0


def cdhr(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(each) for each in arguments])


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "cdhr" / "journals"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    shutil.copy(ROOT / "gcode" / "paper_ring_double.gcode", tmp_path / "ring.gcode")
    return tmp_path / "ring.gcode"


def killed(file: Path, state: Path, *, at_bytes: int = 12_000) -> Path:
    """A print that was killed with SIGKILL once its journal had grown so long; its journal."""
    command = [sys.executable, "-m", "cdhr_host", "stream", str(file), "--speed", "5"]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as host:
        given_up = time.monotonic() + PATIENCE
        while not (found := list(state.glob("*.journal"))) or found[0].stat().st_size < at_bytes:
            assert host.poll() is None
            assert time.monotonic() < given_up
            time.sleep(0.05)
        host.send_signal(signal.SIGKILL)
    return found[0]


def test_a_killed_print_goes_on_and_is_then_done(file: Path, state: Path) -> None:
    journal = killed(file, state)
    before = read_journal(journal)
    assert not before.finished
    assert before.executed is not None
    done = cdhr("resume", "--yes", "--speed", "200", "--json")
    assert done.exit_code == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["resumed"]["journal"] == str(journal)
    assert record["resumed"]["line"] <= before.executed.line
    assert "simulated anew" in done.stderr
    assert read_journal(max(state.glob("*.journal"))).finished
    again = cdhr("resume", "--yes")
    assert again.exit_code == 7
    assert "no interrupted print" in again.stderr


def test_a_journal_that_does_not_fit_is_refused(file: Path, state: Path) -> None:
    journal = killed(file, state)
    text = file.read_text()
    file.write_text(text.replace("F1200", "F1100", 1) + "\n; changed\n")
    refused = cdhr("resume", "--yes")
    assert refused.exit_code == 7
    assert "was changed since the print began" in refused.stderr
    file.unlink()
    assert "is not there" in cdhr("resume", journal, "--yes").stderr
    file.write_text(text)
    for layer, exit_code in ((9, 7), (2, 0)):
        found = cdhr("resume", "--yes", "--speed", "200", "--from-layer", layer)
        assert found.exit_code == exit_code, found.stderr
    assert "goes on   at line 1" in found.stderr


def test_without_a_terminal_nobody_is_asked(file: Path, state: Path) -> None:
    killed(file, state)
    asked = cdhr("resume")
    assert asked.exit_code == 2
    assert "--yes goes on without asking" in asked.stderr


def test_what_is_no_journal_is_refused(tmp_path: Path, state: Path) -> None:
    (tmp_path / "x.journal").write_text("hello\n")
    refused = cdhr("resume", tmp_path / "x.journal")
    assert refused.exit_code == 7
    assert "not the journal of a print" in refused.stderr
    assert cdhr("resume").exit_code == 7
