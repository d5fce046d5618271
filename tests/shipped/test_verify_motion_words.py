"""The checker's own reading of planes, curves and blending: a program that says otherwise is found."""

from pathlib import Path

import pytest
from verify_log import verify

from cdhr_host.cli.source import Source
from cdhr_host.pipeline import open_profile, prove
from cdhr_host.report.log import SetpointLog

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "gcode" / "motion_words.gcode"
PROFILE = ROOT / "profiles" / "paper.toml"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "log.parquet"
    with SetpointLog(path) as file:
        prove(Source(str(PROGRAM)).chunks(), open_profile("paper"), sink=file.add_setpoints)
        file.keep()
    return path


CHANGES = {
    "plane": ("G18\n", "G17\n", "off the path"),
    "sense": ("G19\nG3", "G19\nG2", "off the path"),
    "first control point": ("I-10 J20", "I-10 J23", "off the path"),
    "second control point": ("P10 Q-10 E450", "P10 Q-13 E450", "off the path"),
    "the pull of the curve before": ("P10 Q-20 E700", "P10 Q-24 E700", "off the path"),
    "quadratic": ("I-30 J-25", "I-30 J-28", "off the path"),
    "exact stops": ("G64\nG1 X35", "G61\nG1 X35", "do not end in an exact stop"),
    "tolerance": ("G64 P2\n", "G64 P0.5\n", "off the path"),
    "end of the tolerance": ("G64 P0.02", "G64 P2", ""),
    "fine tolerance": ("G64\nG1 X35", "G64 P0.02\nG1 X35", "off the path"),
    "coarse left out": ("G64 P2\n", "", "off the path"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_another_program_is_not_this_log(name: str, log: Path, tmp_path: Path) -> None:
    before, after, says = CHANGES[name]
    text = PROGRAM.read_text()
    assert text.count(before) == 1
    program = tmp_path / "other.gcode"
    program.write_text(text.replace(before, after + "\n" * (before.count("\n") - after.count("\n"))))
    found = "\n".join(verify(log, program, PROFILE))
    assert says in found
    assert bool(found) == bool(says)
