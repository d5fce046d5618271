"""Every program of gcode/: proven, logged twice alike, and found right by a checker of its own."""

from pathlib import Path

import numpy as np
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
import pytest
from verify_log import verify

from cdhr_host.cli.source import Source
from cdhr_host.pipeline import Proof, open_profile, prove
from cdhr_host.report.log import SetpointLog
from cdhr_host.values import Setpoints

ROOT = Path(__file__).resolve().parents[2]
PROFILES = ROOT / "profiles"
PROGRAMS = sorted((ROOT / "gcode").glob("*.gcode*"))
SHORT = [path for path in PROGRAMS if path.stat().st_size < 40_000]


def logged(program: Path, profile: str, *logs: Path) -> Proof:
    files = [SetpointLog(path) for path in logs]

    def sink(block: Setpoints) -> None:
        for file in files:
            file.add_setpoints(block)

    proof = prove(Source(str(program)).chunks(), open_profile(profile), sink=sink)
    for file in files:
        file.keep()
    return proof


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.name)
def test_a_shipped_program_is_planned_within_every_limit(program: Path, tmp_path: Path) -> None:
    log = tmp_path / "log.parquet"
    assert logged(program, "paper-wide", log).ok
    assert verify(log, program, PROFILES / "paper-wide.toml") == []


@pytest.mark.parametrize("program", SHORT, ids=lambda path: path.name)
def test_csv_and_parquet_agree(program: Path, tmp_path: Path) -> None:
    csv, parquet = tmp_path / "log.csv", tmp_path / "log.parquet"
    assert logged(program, "paper", csv, parquet).ok
    rows, same = pa_csv.read_csv(csv), pq.read_table(parquet)
    assert rows.column_names == same.column_names
    for name in rows.column_names:
        np.testing.assert_array_equal(rows[name].to_numpy(), same[name].to_numpy())
    assert verify(csv, program, PROFILES / "paper.toml") == []


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_other_rates_keep_the_limits(rate: float, tmp_path: Path) -> None:
    program, log = ROOT / "gcode" / "paper_ring_double.gcode", tmp_path / "log.parquet"
    with SetpointLog(log) as out:
        prove(Source(str(program)).chunks(), open_profile("paper"), rate_hz=rate, sink=out.add_setpoints)
        out.keep()
    assert verify(log, program, PROFILES / "paper.toml", rate) == []
