"""Differences against derivatives known in closed form; forces against the mechanism's own."""

import numpy as np
import pytest

from cdhr_host.mechanism import Cables, Loads, Pairs, Windows, nine_tensions
from cdhr_host.pipeline import open_profile, prove
from cdhr_host.report.log import SetpointLog
from cdhr_host.report.plot.deriving import Deriver, Stencil, Table, widened
from cdhr_host.report.plot.passing import Choice, drawn
from cdhr_host.report.reading import LogFile, LogFileError
from cdhr_host.units import MM

TEXT = b"M83\nG1 Z5 F1200\nG1 X60 E300\nG1 Y40 E200\nG4 P200\nG1 X0 Y0 Z0 F3000\n"


@pytest.fixture(scope="module")
def paper():
    return open_profile("paper")


def test_differences_are_the_derivatives_of_a_sine():
    t = np.arange(400) * 1e-3
    wide = np.sin(20 * t)[:, None]
    stencil = Stencil(1, 1e-3)
    found = stencil.differences(wide, t)
    inner = stencil.middle(t[:, None])[:, 0]
    for values, exact in zip(
        found, (20 * np.cos(20 * inner), -400 * np.sin(20 * inner), -8000 * np.cos(20 * inner)), strict=True
    ):
        assert values[:, 0] == pytest.approx(exact, abs=2e-4 * np.abs(exact).max())


def test_a_gap_in_time_is_not_differenced_across():
    t = np.r_[np.arange(50), np.arange(60, 110)] * 4e-3
    found = Stencil(1, 4e-3).differences(t[:, None], t)[0][:, 0]
    assert np.isnan(found[46:50]).all()
    assert np.delete(found, range(46, 50)) == pytest.approx(1.0)


@pytest.mark.parametrize("sizes", [[100], [1, 2, 3, 94], [50, 50], [3, 1]])
def test_widened_blocks_cover_every_row_once(sizes):
    rows = np.arange(float(sum(sizes)))[:, None]
    stencil = Stencil(2, 1.0)
    parts = widened(np.split(rows, np.cumsum(sizes)[:-1]), stencil.margin)
    assert np.array_equal(np.concatenate([stencil.middle(part) for part in parts]), rows)


def test_single_cables_and_margin_are_the_mechanisms(paper):
    blocks = []
    prove([TEXT], paper, sink=lambda rows: None, watch=blocks.append)
    nine = np.concatenate([block.nine for block in blocks])
    rows = np.concatenate([block.setpoints.nozzle_G for block in blocks])
    upper = np.concatenate([block.setpoints.upper for block in blocks])
    tension = np.concatenate([block.setpoints.tension for block in blocks])
    t = np.arange(len(rows)) * 4e-3
    names = ["t_s", "line", *(f"{axis}_mm" for axis in "xyzuvw"), *(f"slider{i}_mm" for i in range(1, 7))]
    names += [f"tension{i}_n" for i in range(1, 7)]
    whole = np.column_stack([t, t, rows / MM, upper / MM, np.zeros((len(t), 6)), tension])
    stencil = Stencil(1, 4e-3)
    found = Deriver(stencil, paper).derived(Table(names, whole))
    inner = stencil.middle(nine)
    for i in range(3):
        assert found[f"tension{i + 1}_left_n"] == pytest.approx(inner[:, i], abs=1e-9)
        assert found[f"tension{i + 1}_right_n"] == pytest.approx(inner[:, 3 + i], abs=1e-9)
    assert found["margin"] == pytest.approx(Windows.from_profile(paper).least_margin(inner), abs=1e-9)
    resting = nine_tensions(
        Cables.from_profile(paper), Loads.from_profile(paper), Pairs.from_profile(paper), rows[:1], rows[:1]
    )
    assert nine[0] == pytest.approx(resting[0], abs=0.01)


def test_a_pass_through_a_log_finds_what_the_proof_found(paper, tmp_path):
    path = tmp_path / "run.parquet"
    with SetpointLog(path) as log:
        proof = prove([TEXT], paper, sink=log.add_setpoints)
        log.keep()
    found = drawn(LogFile.opened(path), paper, Choice())
    for name, (low, _, high, _) in proof.extremes.items():
        assert (found.extremes[name][0], found.extremes[name][3]) == (low, high)
    assert found.rows == found.high["t_s"][-1] / 4e-3 + 1
    assert found.extremes["speed_mm_s"][3] == pytest.approx(50.0, rel=0.01)
    for i in range(1, 7):
        assert found.extremes[f"slider{i}_jerk_mm_s3"][3] <= paper.sliders.jerk_max / MM
        assert found.extremes[f"slider{i}_acceleration_mm_s2"][3] <= paper.sliders.acceleration_max / MM


def test_a_choice_leaves_the_rest_out(paper, tmp_path):
    path = tmp_path / "run.csv"
    with SetpointLog(path) as log:
        prove([TEXT], paper, sink=log.add_setpoints)
        log.keep()
    log = LogFile.opened(path)
    some = drawn(log, None, Choice(begin=1.0, end=2.0))
    assert some.times == (1.0, 2.0)
    assert some.rows == 251
    lines = drawn(log, None, Choice(lines=(3, 3)))
    assert set(lines.low["line"]) == {3}
    with pytest.raises(LogFileError, match="none of its rows"):
        drawn(log, None, Choice(begin=1e6))
