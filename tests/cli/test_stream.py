"""``cdhr stream`` on simulated drives: what is sent is what was proven, and every end is at rest."""

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner, Result

from cdhr_host.cli import printing
from cdhr_host.cli.app import app
from cdhr_host.drives import Loopback
from cdhr_host.job.printer import Printer
from cdhr_host.pipeline.columns import SETPOINT_COLUMNS
from cdhr_host.units import MM
from cdhr_host.values import Feedback

GCODE = Path(__file__).resolve().parents[2] / "gcode"
RING = str(GCODE / "paper_ring_double.gcode")
FAST = ["--speed", "100000"]


def cdhr(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


def written(tmp_path: Path, text: str) -> str:
    path = tmp_path / "part.gcode"
    path.write_text(text)
    return str(path)


@pytest.fixture
def received(monkeypatch: pytest.MonkeyPatch) -> list[Feedback]:
    """What the simulated drives executed, batch by batch."""
    batches: list[Feedback] = []
    original = Loopback.feedback

    def feedback(self: Loopback) -> Feedback:
        batches.append(original(self))
        return batches[-1]

    monkeypatch.setattr(Loopback, "feedback", feedback)
    return batches


def test_the_dry_run_log_is_what_the_drives_received_tick_by_tick(
    tmp_path: Path, received: list[Feedback]
) -> None:
    dry, run = tmp_path / "dry.parquet", tmp_path / "run.parquet"
    assert cdhr("dry-run", RING, "--log", str(dry)).exit_code == 0
    assert cdhr("stream", RING, "--log", str(run), *FAST).exit_code == 0
    planned, done = pq.read_table(dry), pq.read_table(run)
    assert done.column_names[: len(SETPOINT_COLUMNS)] == list(SETPOINT_COLUMNS)
    assert done.select(list(SETPOINT_COLUMNS)).equals(planned)
    setpoint = np.concatenate([batch.setpoint for batch in received])
    sliders = np.stack([planned[f"slider{i}_mm"].to_numpy() for i in range(1, 7)], axis=1)
    np.testing.assert_array_equal(setpoint / MM, sliders)
    np.testing.assert_array_equal(np.concatenate([batch.tick for batch in received]), np.arange(len(sliders)))


def test_a_run_is_summed_up() -> None:
    result = cdhr("stream", RING, *FAST)
    assert result.exit_code == 0
    assert result.stdout.startswith(f"{RING}: printed, at rest, air off\n  program    26 lines, 15 moves")


def test_a_run_as_json() -> None:
    record = json.loads(cdhr("stream", RING, "--json", *FAST).stdout)
    assert (record["ok"], record["interrupted"], record["lines"]) == (True, False, 26)
    assert record["ticks"] * 0.004 == pytest.approx(record["duration_s"])
    assert max(record["following_max_mm"]) < 0.1


def interrupt_at(monkeypatch: pytest.MonkeyPatch, line: int, times: int = 1) -> None:
    """Ctrl-C as soon as this line is executed."""
    original, left = printing._show, [times]

    def shown(printer: Printer, progress: Any, speed: float) -> None:
        original(printer, progress, speed)
        done = printer.status().progress
        if done is not None and done.line >= line and left[0]:
            left[0] -= 1
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(printing, "_show", shown)


@pytest.mark.parametrize("times", [1, 2])
def test_ctrl_c_stops_on_the_path_with_the_air_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, times: int
) -> None:
    run, dry = tmp_path / "run.parquet", tmp_path / "dry.parquet"
    interrupt_at(monkeypatch, 13, times)
    result = cdhr("stream", RING, "--speed", "50", "--log", str(run))
    assert result.exit_code == 130
    assert "cdhr: stopping on the path, air off" in result.stderr
    assert "stopped on request at line 1" in result.stdout
    assert cdhr("dry-run", RING, "--log", str(dry)).exit_code == 0
    done, planned = (
        np.stack([pq.read_table(path)[f"{axis}_mm"].to_numpy() for axis in "xyz"], axis=1)
        for path in (run, dry)
    )
    assert len(done) < len(planned)
    assert np.linalg.norm(done[-1] - done[-2]) < 1e-3
    assert pq.read_table(run)["pressure_kpa"].to_numpy()[-1] == 0
    away = [np.linalg.norm(planned - place, axis=1).min() for place in done[::50]]
    assert max(away) < 0.1


def test_the_operators_own_handlers_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    before = signal.getsignal(signal.SIGINT)
    assert cdhr("stream", RING, *FAST).exit_code == 0
    assert signal.getsignal(signal.SIGINT) is before


def test_a_following_error_stops_the_run_and_keeps_its_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    profile = tmp_path / "tight.toml"
    profile.write_text(
        cdhr("profile", "show").stdout.replace(
            "following_error_max_mm = 1.0", "following_error_max_mm = 0.005"
        )
    )
    log = tmp_path / "run.parquet"
    result = cdhr("stream", RING, "--profile", str(profile), "--log", str(log), *FAST)
    assert result.exit_code == 6
    assert re_line(result.stderr, RING, "mm away from its setpoint")
    assert "the last minute is in " in result.stderr
    table = pq.read_table(log)
    assert 0 < table.num_rows < 13000
    assert table["pressure_kpa"].to_numpy()[-1] == 0


def re_line(stderr: str, file: str, words: str) -> bool:
    return any(line.startswith(f"{file}:") and words in line for line in stderr.splitlines())


PAUSED = "G1 X10 F6000\nM0 wet the clay\nG1 X0\n"


def test_pauses_need_someone_to_end_them(tmp_path: Path) -> None:
    result = cdhr("stream", written(tmp_path, PAUSED), *FAST)
    assert result.exit_code == 2
    assert "--yes passes the pauses" in result.stderr


def test_yes_passes_pauses(tmp_path: Path) -> None:
    log = tmp_path / "run.parquet"
    result = cdhr("stream", written(tmp_path, PAUSED), "--yes", "--log", str(log), *FAST)
    assert result.exit_code == 0
    t = pq.read_table(log)["t_s"].to_numpy()
    np.testing.assert_allclose(np.diff(t), 0.004, rtol=1e-9)


@pytest.mark.parametrize(("answers", "code"), [(True, 0), (False, 130)])
def test_an_operator_ends_a_pause(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answers: bool, code: int
) -> None:
    seen = []

    def goes_on(pause: Any, stop: Any) -> bool:
        seen.append((pause.line, pause.message))
        return answers

    monkeypatch.setattr(printing, "_goes_on", goes_on)
    monkeypatch.setattr("cdhr_host.cli.stream._agreed", lambda *_: None)
    assert cdhr("stream", written(tmp_path, PAUSED), *FAST).exit_code == code
    assert seen == [(2, "wet the clay")]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["-"], 2, "a print needs a file"),
        ([RING, "--drives", "slcan:/dev/null@1", "--speed", "2"], 2, "simulated drives only"),
        ([RING, "--drives", "lopback:"], 6, "did you mean loopback:?"),
    ],
)
def test_what_cannot_be_streamed_is_refused(arguments: list[str], code: int, words: str) -> None:
    result = cdhr("stream", *arguments)
    assert result.exit_code == code
    assert words in result.stderr


def test_a_file_that_changes_after_its_proof_does_not_move(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = written(tmp_path, "G1 X10 F600\n")
    monkeypatch.setattr(
        "cdhr_host.cli.stream._agreed", lambda *_: Path(file).write_text("G1 X10 F600\nG1 X300\n")
    )
    result = cdhr("stream", file, *FAST)
    assert result.exit_code == 2
    assert "changed" in result.stderr
