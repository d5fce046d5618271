"""Calibration told and kept, poses planned, and studies that are the same however they are spread."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdhr_host.errors import MotionError, ProfileError
from cdhr_host.mechanism import Cables, forward
from cdhr_host.mechanism.calibration import Points
from cdhr_host.mechanism.calibration_model import SIZE, Doubts, Frame, predicted
from cdhr_host.pipeline import open_profile
from cdhr_host.report.studies.fit import calibrated_profile, fit, rms, without_pose
from cdhr_host.report.studies.picture import draw
from cdhr_host.report.studies.points import read_points
from cdhr_host.report.studies.poses import candidates, planned, program, sheet
from cdhr_host.report.studies.spread import ClusterError, spread
from cdhr_host.report.studies.summary import (
    calibration_jobs,
    calibration_study,
    slices,
    tolerance_jobs,
    tolerance_study,
    workspace_study,
)
from cdhr_host.report.studies.told import fit_lines, fit_record
from cdhr_host.report.studies.trials import margins, strayed, tried
from cdhr_host.units import MM

PAPER = open_profile("paper")
CABLES = Cables.from_profile(PAPER)
NOISE = 0.05 * MM


def machine(seed: int) -> np.ndarray:
    return Doubts().each() * np.random.default_rng(seed).standard_normal(SIZE)


def measured(seed: int, count: int = 30) -> Points:
    poses = planned(PAPER, Doubts(), count, NOISE)
    noise = NOISE * np.random.default_rng(seed + 100).standard_normal((count, 3))
    run = poses.slider[:, :3]
    return Points(run, predicted(CABLES, Frame.same(), machine(seed), run) + noise)


@pytest.mark.parametrize("name", ["paper", "paper-wide"])
def test_planned_poses_are_inside_and_on_a_short_way(name: str) -> None:
    profile = open_profile(name)
    could, poses = candidates(profile), planned(profile, Doubts(), 24, NOISE)
    assert len(poses.position_G) == 24
    places = {tuple(row) for row in could.position_G.tolist()}
    assert {tuple(row) for row in poses.position_G.tolist()} <= places
    way = np.linalg.norm(np.diff(poses.position_G, axis=0), axis=1).sum()
    random = np.random.default_rng(0).permutation(poses.position_G)
    assert way < 0.7 * np.linalg.norm(np.diff(random, axis=0), axis=1).sum()


def test_a_machine_that_bears_nothing_has_no_poses() -> None:
    windows = PAPER.forces.model_copy(update={"upper_max": 5.1})
    with pytest.raises(MotionError, match="no place over the bed"):
        candidates(PAPER.model_copy(update={"forces": windows}))


def test_sheet_and_program_are_of_the_poses(tmp_path: Path) -> None:
    poses = planned(PAPER, Doubts(), 6, NOISE)
    table = tmp_path / "poses.csv"
    rows = list(sheet(poses))
    table.write_text("\n".join(rows), encoding="utf-8")
    with pytest.raises(ProfileError, match="no measured point"):
        read_points(table)
    filled = [rows[0], *(row.rstrip(",") + f",{n},{n + 1},{n + 2}" for n, row in enumerate(rows[1:]))]
    table.write_text("\n".join(filled), encoding="utf-8")
    points, lines = read_points(table)
    assert np.allclose(points.slider, poses.slider[:, :3], rtol=0, atol=1e-9)
    assert points.place[2].tolist() == pytest.approx([2e-3, 3e-3, 4e-3])
    assert lines == list(range(2, 8))
    assert sum(line.startswith("G1 ") for line in program(poses, "told")) == 6


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("slider1_mm,slider2_mm,slider3_mm,xmm\n1,2,3,4", "unknown column 'xmm'"),
        ("slider1_mm,slider2_mm,x_mm\n1,2,3", "are no measured points"),
        ("slider1_mm,slider2_mm,slider3_mm,x_mm\n1,2,3", "3 values for 4 columns"),
        ("slider1_mm,slider2_mm,slider3_mm,x_mm\n1,2,three,4", "slider3_mm = 'three' is not a number"),
        ("slider1_mm,slider2_mm,slider3_mm,x_mm\n1,2,,4", "slider3_mm = '' must be a finite number"),
        ("slider1_mm,slider2_mm,slider3_mm,x_mm\n1,2,3,inf", "must be a finite number"),
    ],
)
def test_tables_that_are_refused(tmp_path: Path, text: str, words: str) -> None:
    table = tmp_path / "points.csv"
    table.write_text(text, encoding="utf-8")
    with pytest.raises(ProfileError, match=words):
        read_points(table)


def test_semicolons_and_decimal_commas(tmp_path: Path) -> None:
    table = tmp_path / "points.csv"
    table.write_text("slider1_mm;slider2_mm;slider3_mm;z_mm\n1,5;2;3;-4,25\n", encoding="utf-8")
    points, _ = read_points(table)
    assert points.slider[0].tolist() == pytest.approx([1.5e-3, 2e-3, 3e-3])
    assert np.isnan(points.place[0, :2]).all()
    assert points.place[0, 2] == pytest.approx(-4.25e-3)


def test_sliders_without_a_pose_are_named_by_line() -> None:
    points = Points(np.array([[0.0, 0.0, 0.0], [-0.8, -0.8, 0.9]]), np.zeros((2, 3)))
    problems = without_pose(PAPER, points, [2, 7])
    assert [problem.line for problem in problems] == [7]
    assert "no pose" in problems[0].message


def test_a_fit_is_judged_by_points_it_has_not_seen_and_kept_as_a_profile() -> None:
    points = measured(1)
    found = fit(PAPER, points, Doubts(), NOISE, free_frame=False)
    assert found.judged is not None
    assert found.judged.points == 30
    assert found.judged.after < 0.1 * found.judged.before
    assert found.doubt[1] < 0.05 * found.doubt[0]
    assert rms(found.found.residual) < 3 * NOISE < rms(found.first)
    profile = calibrated_profile(found)
    cables = Cables.from_profile(profile)
    assert np.allclose(cables.reference_G, CABLES.reference_G, rtol=0, atol=1e-12)
    length = np.tile(cables.reference_lengths, (len(points), 1))
    length[:, :3] += points.slider
    program_place = forward(cables, length)[0] + cables.reference_G
    rest = found.found.predicted(np.zeros((1, 3)))
    assert np.allclose(program_place, found.found.predicted(points.slider) - rest, rtol=0, atol=1e-8)


def test_calibrating_a_calibrated_machine_again_changes_little() -> None:
    points = measured(2)
    first = calibrated_profile(fit(PAPER, points, Doubts(), NOISE, free_frame=False))
    origin = predicted(Cables.from_profile(PAPER), Frame.same(), machine(2), np.zeros((1, 3)))
    again = fit(first, Points(points.slider, points.place - origin), Doubts(), NOISE, free_frame=False)
    assert rms(again.first) < 3 * NOISE
    assert np.abs(again.found.parameters).max() < 1.5 * MM


def test_words_record_and_picture(tmp_path: Path) -> None:
    found = fit(PAPER, measured(3), Doubts(), None, free_frame=False)
    text = "\n".join(fit_lines(found))
    for words in ("held out", "not observable", "attachment 1 z with pulley 1 z", "poses to add", "offset 2"):
        assert words in text
    record = json.loads(json.dumps(fit_record(found)))
    assert len(record["parameters"]) == 22
    assert record["held_out"]["rms_after_mm"] < record["held_out"]["rms_before_mm"]
    assert len(record["poses_to_add_mm"]) == 5
    draw(found, "points", tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 20_000


def test_a_camera_s_frame_needs_whole_points() -> None:
    points = measured(4, 8)
    points.place[:, 0] = np.nan
    with pytest.raises(MotionError, match="too few to find the measuring frame"):
        fit(PAPER, points, Doubts(), NOISE, free_frame=True)


JOBS = calibration_jobs(PAPER, 4, 16, NOISE)


@pytest.fixture(scope="module")
def alone() -> list[object]:
    return list(spread(tried, JOBS, workers=1))


def test_all_cores_find_the_same_bit_for_bit(alone: list[object]) -> None:
    assert list(spread(tried, JOBS, workers=2)) == alone
    assert list(spread(tried, JOBS)) == alone


def test_a_dask_cluster_finds_the_same_bit_for_bit(alone: list[object]) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as cluster:
        assert list(spread(tried, JOBS, scheduler=cluster.scheduler_address)) == alone
        level = slices(PAPER, 200 * MM)
        there = list(spread(margins, level, scheduler=cluster.scheduler_address))
    here = list(spread(margins, level, workers=1))
    assert all((a == b).all() for a, b in zip(here, there, strict=True))


def test_a_scheduler_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("cdhr_host.report.studies.spread.PATIENCE", 1)
    with pytest.raises(ClusterError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        list(spread(tried, JOBS, scheduler="tcp://127.0.0.1:9"))


def test_calibration_study_says_what_it_found(alone: list, tmp_path: Path) -> None:
    study = calibration_study(JOBS, alone)
    assert study.off.shape == (4, 22)
    assert (study.rms[:, 1] < 0.2 * study.rms[:, 0]).all()
    assert "better than the drawing: 4 of 4 machines" in "\n".join(study.lines())
    assert len(study.record()["rms_after_mm"]) == 4
    study.draw("four machines", tmp_path / "study.png")
    assert (tmp_path / "study.png").stat().st_size > 10_000


def test_tolerance_study_grows_with_the_fault(tmp_path: Path) -> None:
    jobs = tolerance_jobs(PAPER, 5, "15")
    study = tolerance_study(jobs, list(spread(strayed, jobs, workers=1)))
    middle = np.median(study.off, axis=2)
    assert (np.diff(middle, axis=1) > 0.0).all()
    assert middle[0, -1] / middle[0, 0] == pytest.approx(8.0, rel=0.1)
    assert "offset" in "\n".join(study.lines())
    assert len(study.record()["greatest_mm"]["pulley"]) == 4
    study.draw("tolerances", tmp_path / "study.svg")
    assert (tmp_path / "study.svg").stat().st_size > 10_000


def test_workspace_study_is_of_the_whole_bed(tmp_path: Path) -> None:
    """Its litres are those of the margin function; every node of the cylinder is a row."""
    jobs = slices(PAPER, 80 * MM)
    study = workspace_study(jobs, list(spread(margins, jobs, workers=1)))
    assert study.margin.shape == (len(jobs), 9, 9)
    assert study.volume == pytest.approx(np.sum(study.margin >= 0.0) * 0.08**3)
    assert study.margin[0, 4, 4] > 0.0
    rows = list(study.rows())
    assert len(rows) == 1 + study.margin.size
    assert study.record()["volume_l"] == pytest.approx(study.volume * 1e3)
    assert "largest margin" in "\n".join(study.lines())
    study.draw("margins", tmp_path / "study.png")
    assert (tmp_path / "study.png").stat().st_size > 10_000


def test_a_wrong_machine_is_told_by_the_points_held_out() -> None:
    """Points of random places: nothing to learn, and the fit says so."""
    points = measured(5)
    wild = replace(points, place=np.random.default_rng(6).uniform(-0.1, 0.1, points.place.shape))
    found = fit(PAPER, wild, Doubts(), None, free_frame=False)
    assert found.judged is not None
    assert found.judged.after > 0.5 * found.judged.before
