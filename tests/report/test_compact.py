"""The compact log: the same rows as the full one, to half a unit."""

import numpy as np
import pyarrow.parquet as pq
import pytest

from cdhr_host.pipeline import open_profile, prove
from cdhr_host.report.compact import COMPACT_COLUMNS, CompactLog
from cdhr_host.report.files import TargetError
from cdhr_host.report.log import SetpointLog

PROGRAM = b"M83\nG1 Z5 F1200\nG1 X60 Y-20 E300\nG1 X-30 Y40 Z9 E200\nG4 P200\nG1 X0 Y0 F3000\n"


@pytest.fixture
def logs(tmp_path):
    paper = open_profile("paper")
    with CompactLog(tmp_path / "small.parquet", 0.001) as small:
        quick = prove([PROGRAM], paper, rate_hz=1000.0, trace=small.add_trace)
        small.keep()
    with SetpointLog(tmp_path / "full.parquet") as full:
        whole = prove([PROGRAM], paper, rate_hz=1000.0, sink=full.add_setpoints)
        full.keep()
    assert quick.duration == whole.duration
    return pq.read_table(tmp_path / "small.parquet"), pq.read_table(tmp_path / "full.parquet")


def test_rows_are_those_of_the_full_log(logs):
    small, full = logs
    assert small.num_rows == full.num_rows
    assert np.array_equal(small["line"], full["line"])
    for name in (*"xyz", *(f"slider{i}" for i in range(1, 7))):
        units = full[f"{name}_mm"].to_numpy() * 1e4
        assert np.abs(small[f"{name}_tenth_um"].to_numpy() - units).max() <= 0.5 + 1e-6
    assert np.abs(small["pressure_pa"].to_numpy() / 1e3 - full["pressure_kpa"].to_numpy()).max() <= 5.1e-4


def test_columns_are_delta_packed_integers_and_the_period_is_told(logs, tmp_path):
    small, _ = logs
    assert tuple(small.column_names) == COMPACT_COLUMNS
    assert small.schema.metadata[b"period_s"] == b"0.001"
    group = pq.ParquetFile(tmp_path / "small.parquet").metadata.row_group(0)
    assert all("DELTA_BINARY_PACKED" in group.column(i).encodings for i in range(group.num_columns))
    size = (tmp_path / "small.parquet").stat().st_size
    assert size < (tmp_path / "full.parquet").stat().st_size / 4


def test_only_parquet_is_compact(tmp_path):
    with pytest.raises(TargetError, match=r"\.parquet"):
        CompactLog(tmp_path / "a.csv", 0.001)
