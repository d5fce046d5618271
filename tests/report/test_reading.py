"""Every kind of log reads back as the same rows, with what it says of itself."""

import numpy as np
import pytest

from cdhr_host.errors import Problem
from cdhr_host.job.black_box import BlackBox
from cdhr_host.pipeline import open_profile, prove
from cdhr_host.report.compact import CompactLog
from cdhr_host.report.log import SetpointLog, about
from cdhr_host.report.reading import LogFile, LogFileError
from cdhr_host.values import Feedback

TEXT = b"M83\nG1 Z5 F1200\nG1 X60 E300\nG1 X0 Z0 F3000\n"


@pytest.fixture(scope="module")
def paper():
    return open_profile("paper")


@pytest.fixture(scope="module")
def logs(paper, tmp_path_factory):
    folder, known = tmp_path_factory.mktemp("logs"), about(paper, "part.gcode")
    with (
        SetpointLog(folder / "a.csv") as csv,
        SetpointLog(folder / "a.parquet", known) as parquet,
        CompactLog(folder / "small.parquet", 0.004, known) as compact,
    ):
        prove([TEXT], paper, sink=csv.add_setpoints)
        prove([TEXT], paper, sink=parquet.add_setpoints, trace=compact.add_trace)
        for log in (csv, parquet, compact):
            log.keep()
    return folder


def rows(log):
    return dict(zip(log.names, np.concatenate(list(log.blocks())).T, strict=True))


def test_csv_and_parquet_are_the_same_rows(logs):
    csv, parquet = (LogFile.opened(logs / name) for name in ("a.csv", "a.parquet"))
    assert csv.names == parquet.names
    assert all(np.array_equal(values, rows(parquet)[name]) for name, values in rows(csv).items())


def test_a_compact_log_reads_in_the_units_of_the_others(logs):
    full, compact = (rows(LogFile.opened(logs / name)) for name in ("a.parquet", "small.parquet"))
    assert np.array_equal(compact["line"], full["line"])
    for name in ("t_s", "x_mm", "slider4_mm", "pressure_kpa"):
        tolerance = 0.0005001 if name == "pressure_kpa" else 0.00005001
        assert compact[name] == pytest.approx(full[name], abs=tolerance)


def test_a_log_says_which_machine_and_program(logs, paper):
    log = LogFile.opened(logs / "a.parquet")
    assert log.profile == paper
    assert log.program == "part.gcode"
    assert LogFile.opened(logs / "a.csv").profile is None


def test_a_black_box_is_a_log_with_events(paper, tmp_path):
    box, blocks = BlackBox(paper), []
    prove([TEXT], paper, sink=blocks.append)
    for block in blocks:
        zeros = np.zeros((len(block), 6))
        back = Feedback(block.tick, block.slider, block.slider, zeros.astype(int), zeros, block.pressure)
        box.executed(block, back)
    box.event("fault", "slider 3 fell behind")
    box.write(tmp_path / "box.npz", Problem("fault", "slider 3 fell behind"), "part.gcode", [])
    log = LogFile.opened(tmp_path / "box.npz")
    assert log.profile == paper
    assert [event.kind for event in log.events] == ["fault"]
    assert log.events[0].t == pytest.approx(rows(log)["t_s"][-1])
    assert "fell behind" in log.program
    assert np.array_equal(
        rows(log)["x_mm"], np.concatenate([block.nozzle_G[:, 0] for block in blocks]) / 1e-3
    )


def test_a_black_box_of_a_machine_that_did_not_move_says_so(paper, tmp_path):
    box = tmp_path / "box.npz"
    BlackBox(paper).write(box, Problem("fault", "no feedback from drive 1"), "part.gcode", [])
    with pytest.raises(LogFileError, match=r"nothing was executed .*: no feedback from drive 1"):
        LogFile.opened(box)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.txt", b"", "does not end in"),
        ("a.csv", b"alpha,beta\n1,2\n", "no column line"),
        ("a.csv", b"", "Empty"),
        ("a.parquet", b"nothing of the kind", "Parquet"),
        ("a.npz", b"nothing of the kind", "black box"),
    ],
)
def test_what_is_no_log_is_refused(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogFileError, match=words):
        LogFile.opened(tmp_path / name)
