"""The checker of logs can itself fail: each kind of damage is found."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from verify_log import verify

from cdhr_host.cli.source import Source
from cdhr_host.pipeline import open_profile, prove
from cdhr_host.report.log import SetpointLog

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "gcode" / "paper_ring_double.gcode"
PROFILE = ROOT / "profiles" / "paper.toml"
Columns = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def columns(tmp_path_factory: pytest.TempPathFactory) -> Columns:
    path = tmp_path_factory.mktemp("log") / "log.parquet"
    with SetpointLog(path) as log:
        prove(Source(str(PROGRAM)).chunks(), open_profile("paper"), sink=log.add_setpoints)
        log.keep()
    table = pq.read_table(path)
    return {name: table[name].to_numpy() for name in table.column_names}


def found(columns: Columns, tmp_path: Path, program: Path = PROGRAM) -> str:
    path = tmp_path / "damaged.parquet"
    pq.write_table(pa.table(columns), path)
    return "\n".join(verify(path, program, PROFILE))


def test_a_sound_log_has_no_findings(columns: Columns, tmp_path: Path) -> None:
    assert found(columns, tmp_path) == ""


def _bump(columns: Columns, name: str, size: float) -> Columns:
    """A smooth bump over 800 rows in the middle of the print."""
    bump = np.zeros(len(columns["t_s"]))
    bump[5000:5800] = size * np.sin(np.linspace(0, np.pi, 800)) ** 4
    return columns | {name: columns[name] + bump}


DAMAGE: dict[str, tuple[Callable[[Columns], Columns], str]] = {
    "time": (lambda c: c | {"t_s": c["t_s"] * (1 + 1e-6)}, "not uniform"),
    "beginning": (lambda c: {name: values[700:] for name, values in c.items()}, "t begins"),
    "end": (lambda c: {name: values[:7000] for name, values in c.items()}, "not at rest at the end"),
    "path": (lambda c: _bump(_bump(c, "x_mm", 0.5), "y_mm", 0.5), "off the path"),
    "slider": (lambda c: _bump(c, "slider3_mm", 1e-6), "sliders differ from the closed form"),
    "jerk": (lambda c: c | {"z_mm": c["z_mm"] + 1e-3 * (np.arange(len(c["z_mm"])) == 5000)}, "nozzle jerk"),
    "force": (lambda c: _bump(c, "tension2_n", 0.1), "out of balance"),
    "window": (lambda c: c | {"tension5_n": c["tension5_n"] + 5}, "upper cables"),
    "air": (lambda c: c | {"pressure_kpa": c["pressure_kpa"] + 1}, "pressure_kpa is"),
    "flow": (lambda c: c | {"flow_mm3_s": c["flow_mm3_s"] * 1.02}, "of clay laid"),
    "travel flow": (lambda c: c | {"flow_mm3_s": c["flow_mm3_s"] + 1e-3}, "clay flows on travel"),
    "missing": (lambda c: {n: np.delete(v, np.s_[4000:5000], 0) for n, v in c.items()}, "not covered"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_found(columns: Columns, tmp_path: Path, damage: str) -> None:
    change, words = DAMAGE[damage]
    assert words in found(change(columns), tmp_path)


def test_a_slower_feed_in_the_program_is_found(columns: Columns, tmp_path: Path) -> None:
    program = tmp_path / "slower.gcode"
    program.write_text(PROGRAM.read_text().replace("F1200", "F1190"))
    assert "speed above F" in found(columns, tmp_path, program)
