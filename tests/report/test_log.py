"""Logs: columns as the contract says, two formats that agree bit for bit, never half a file."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
import pytest

from cdhr_host.pipeline.columns import SETPOINT_COLUMNS
from cdhr_host.report import log as log_module
from cdhr_host.report.files import TargetError
from cdhr_host.report.log import RunLog, SetpointLog
from cdhr_host.values import Feedback, Setpoints

CONTRACT = [
    *("t_s", "line", "x_mm", "y_mm", "z_mm", "u_mm", "v_mm", "w_mm"),
    *("slider1_mm", "slider2_mm", "slider3_mm", "slider4_mm", "slider5_mm", "slider6_mm"),
    *("tension1_n", "tension2_n", "tension3_n", "tension4_n", "tension5_n", "tension6_n"),
    *("flow_mm3_s", "pressure_kpa"),
]
PERIOD = 0.004


def setpoints(first: int = 0, count: int = 100, seed: int = 0) -> Setpoints:
    random = np.random.default_rng(seed)
    tick = np.arange(first, first + count)
    return Setpoints(
        tick=tick,
        t=tick * PERIOD,
        line=tick // 7 + 1,
        nozzle_G=random.normal(size=(count, 3)),
        upper=random.normal(size=(count, 3)) * 1e-12,
        slider=random.normal(size=(count, 6)),
        tension=random.uniform(3, 60, size=(count, 6)),
        flow=np.zeros(count),
        pressure=random.uniform(0, 2e5, size=count),
    )


def feedback(of: Setpoints) -> Feedback:
    return Feedback(
        tick=of.tick,
        setpoint=of.slider,
        slider=of.slider - 1e-5,
        counts=np.full((len(of), 6), 2**40),
        torque=of.slider * 2,
        pressure=of.pressure,
    )


def write(path: Path, blocks: Iterable[Setpoints]) -> Path:
    with SetpointLog(path) as log:
        for block in blocks:
            log.add_setpoints(block)
        log.keep()
    return path


def read(path: Path) -> pa.Table:
    return pa_csv.read_csv(path) if path.suffix == ".csv" else pq.read_table(path)


def test_columns_are_the_contract() -> None:
    assert list(SETPOINT_COLUMNS) == CONTRACT


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_log_has_the_contract_columns_in_order(tmp_path: Path, suffix: str) -> None:
    assert read(write(tmp_path / f"a{suffix}", [setpoints()])).column_names == CONTRACT


def test_csv_header_is_plain_text(tmp_path: Path) -> None:
    assert write(tmp_path / "a.csv", [setpoints()]).read_text().splitlines()[0] == ",".join(CONTRACT)


def test_csv_and_parquet_hold_the_same_bits(tmp_path: Path) -> None:
    blocks = [setpoints(), setpoints(100, 37, seed=1)]
    csv, parquet = (read(write(tmp_path / name, blocks)) for name in ("a.csv", "a.parquet"))
    for name in CONTRACT:
        bits = [table[name].to_numpy().astype(float).view(np.int64) for table in (csv, parquet)]
        np.testing.assert_array_equal(*bits)


def test_values_are_in_the_unit_of_their_column(tmp_path: Path) -> None:
    given = setpoints()
    table = read(write(tmp_path / "a.parquet", [given]))
    np.testing.assert_allclose(table["slider4_mm"].to_numpy(), given.slider[:, 3] * 1e3, rtol=1e-15)
    np.testing.assert_allclose(table["w_mm"].to_numpy(), given.upper[:, 2] * 1e3, rtol=1e-15)
    np.testing.assert_allclose(table["pressure_kpa"].to_numpy(), given.pressure / 1e3, rtol=1e-15)
    np.testing.assert_array_equal(table["t_s"].to_numpy(), given.tick * PERIOD)


def test_rows_are_written_in_groups_of_bounded_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_module, "ROW_GROUP", 64)
    path = write(tmp_path / "a.parquet", (setpoints(50 * k, 50) for k in range(5)))
    assert pq.ParquetFile(path).metadata.num_row_groups == 3
    np.testing.assert_array_equal(read(path)["t_s"].to_numpy(), np.arange(250) * PERIOD)


def test_a_run_log_adds_what_came_back(tmp_path: Path) -> None:
    sent = setpoints()
    with RunLog(tmp_path / "run.parquet") as log:
        log.add_run(sent, feedback(sent))
        log.keep()
    table = read(tmp_path / "run.parquet")
    assert table.column_names[: len(CONTRACT)] == CONTRACT
    np.testing.assert_allclose(table["slider1_error_mm"].to_numpy(), 0.01, rtol=1e-9)
    assert table["slider6_counts"].to_pylist() == [2**40] * 100


def test_a_run_log_refuses_feedback_of_other_ticks(tmp_path: Path) -> None:
    sent = setpoints()
    with RunLog(tmp_path / "run.csv") as log, pytest.raises(ValueError, match="different ticks"):
        log.add_run(sent, feedback(setpoints(1)))


def test_a_log_not_kept_leaves_nothing(tmp_path: Path) -> None:
    with SetpointLog(tmp_path / "a.csv") as log:
        log.add_setpoints(setpoints())
    assert list(tmp_path.iterdir()) == []


def test_an_older_log_survives_a_run_that_failed(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("older")

    def blocks() -> Iterator[Setpoints]:
        yield setpoints()
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write(tmp_path / "a.csv", blocks())
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a.csv", "older")]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a.txt", ".csv or .parquet"),
        ("a", ".csv or .parquet"),
        ("none/a.csv", "no folder"),
        ("folder.csv", "not a regular file"),
    ],
)
def test_a_target_that_cannot_be_is_refused_at_once(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(TargetError, match=words):
        SetpointLog(tmp_path / name)


def test_an_empty_log_is_a_log(tmp_path: Path) -> None:
    assert read(write(tmp_path / "a.parquet", [])).num_rows == 0
