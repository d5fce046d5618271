"""``cdhr calibrate plan``, ``geometry``, ``study``, ``cdhr study``: from poses to a profile that prints."""

import csv
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdhr_host.cli.app import app
from cdhr_host.mechanism import Cables
from cdhr_host.mechanism.calibration_model import SIZE, Doubts, Frame, predicted
from cdhr_host.pipeline import open_profile
from cdhr_host.units import MM


def run(*words: str) -> None:
    app(list(words), standalone_mode=False)


def measured(folder: Path, seed: int, share: float = 1.0, noise: float = 0.05) -> Path:
    """Planned poses of a machine drawn from the doubts, filled in as a camera would."""
    plan, table = folder / "poses.csv", folder / "points.csv"
    run("calibrate", "plan", str(plan), "--count", "24")
    rows = list(csv.DictReader(io.StringIO(plan.read_text(encoding="utf-8"))))
    run_out = MM * np.array([[float(row[f"slider{i}_mm"]) for i in (1, 2, 3)] for row in rows])
    rng = np.random.default_rng(seed)
    truth = share * Doubts().each() * rng.standard_normal(SIZE)
    place = predicted(Cables.from_profile(open_profile("paper")), Frame.same(), truth, run_out) / MM
    place += noise * rng.standard_normal(place.shape)
    for row, (x, y, z) in zip(rows, place, strict=True):
        row.update(x_mm=f"{x:.4f}", y_mm=f"{y:.4f}", z_mm=f"{z:.4f}")
    with table.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    return table


def refusal(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    with pytest.raises(SystemExit) as ended:
        app(list(words))
    return int(ended.value.code or 0), capsys.readouterr().err


def test_from_a_plan_to_a_profile_that_prints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table, mine, picture = measured(tmp_path, 1, 0.2), tmp_path / "mine.toml", tmp_path / "fit.png"
    capsys.readouterr()
    run("calibrate", "geometry", str(table), "--write", str(mine), "--plot", str(picture))
    said = capsys.readouterr()
    assert "not observable with these poses" in said.out
    assert f"{mine}: written" in said.err
    assert picture.stat().st_size > 20_000
    profile = open_profile(str(mine))
    assert profile.calibration.greatest() > 0.2 * MM
    run("dry-run", "gcode/paper_eq15.gcode", "--profile", str(mine), "--json")
    assert json.loads(capsys.readouterr().out)["ok"] is True


def test_the_plan_s_program_can_be_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = tmp_path / "poses.gcode"
    run("calibrate", "plan", str(tmp_path / "poses.csv"), "--count", "12", "--gcode", str(program))
    capsys.readouterr()
    run("dry-run", str(program), "--json")
    record = json.loads(capsys.readouterr().out)
    assert record["ok"] is True
    assert record["moves"] >= 12


def test_json_has_it_all_and_writes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = measured(tmp_path, 2)
    capsys.readouterr()
    run("calibrate", "geometry", str(table), "--json", "--noise", "0.05")
    record: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert record["written"] is None
    assert record["held_out"]["rms_after_mm"] < 0.1 * record["held_out"]["rms_before_mm"]
    assert set(record["parameters"]["offset 1"]) == {"value", "sigma", "before", "learned"}
    assert not list(tmp_path.glob("*.toml"))


def test_the_old_profile_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table, mine = measured(tmp_path, 3), tmp_path / "mine.toml"
    mine.write_text("mine", encoding="utf-8")
    code, said = refusal(capsys, "calibrate", "geometry", str(table), "--write", str(mine))
    assert code == 2
    assert f"{mine} exists" in said
    assert mine.read_text(encoding="utf-8") == "mine"


def test_a_fit_that_tells_nothing_is_not_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The machine as drawn, seen by a poor camera: a fit can only follow the noise."""
    poses = tmp_path / "poses.csv"
    run("calibrate", "plan", str(poses), "--count", "24")
    rows = list(csv.reader(io.StringIO(poses.read_text(encoding="utf-8"))))
    rng, cables = np.random.default_rng(5), Cables.from_profile(open_profile("paper"))
    for row in rows[1:]:
        slider = MM * np.array([[float(cell) for cell in row[:3]]])
        place = predicted(cables, Frame.same(), np.zeros(SIZE), slider)[0] / MM
        row[6:] = [f"{value:.3f}" for value in place + rng.normal(0.0, 5.0, 3)]
    poses.write_text("\n".join(",".join(row) for row in rows), encoding="utf-8")
    mine = tmp_path / "mine.toml"
    code, said = refusal(capsys, "calibrate", "geometry", str(poses), "--write", str(mine))
    assert (code, mine.exists()) == (3, False)
    assert "no better than by the drawing" in said


def test_rows_that_fit_no_pose_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "points.csv"
    head = "slider1_mm,slider2_mm,slider3_mm,z_mm\n"
    table.write_text(head + "0,0,0,0\n-800,-800,900,5\n", encoding="utf-8")
    code, said = refusal(capsys, "calibrate", "geometry", str(table))
    assert code == 5
    assert f"{table}:3: error: no pose" in said


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("calibrate", "plan", "poses.txt"), 2, "does not end in .csv"),
        (("calibrate", "geometry", "no.csv"), 3, "no.csv: No such file"),
        (("calibrate", "geometry", "no.csv", "--noise", "0"), 2, "must be above 0"),
        (("study", "tolerance", "--trajectory", "7"), 2, "no trajectory 7"),
        (("calibrate", "plan", "p.csv", "--profile", "paper-simulation"), 5, "while moving"),
    ],
)
def test_refusals(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    code: int,
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    ended, text = refusal(capsys, *words)
    assert ended == code
    assert said in text
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words", [("calibrate", "study"), ("study", "tolerance"), ("calibrate", "geometry", "a.csv")]
)
def test_a_picture_that_cannot_be_drawn_is_refused_before_the_work(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: tuple[str, ...]
) -> None:
    monkeypatch.setattr("cdhr_host.report.plot.write.find_spec", lambda _: None)
    monkeypatch.setattr("cdhr_host.cli.study.open_machine", lambda _: pytest.fail("work was begun"))
    ended, text = refusal(capsys, *words, "--plot", "a.png")
    assert ended == 2
    assert "pip install 'cdhr-host[plot]'" in text


def test_a_pretended_machine_is_found_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tables = [tmp_path / name for name in ("one.csv", "same.csv", "other.csv")]
    for table, seed in zip(tables, ("4", "4", "5"), strict=True):
        run("calibrate", "plan", str(table), "--count", "12", "--pretend", seed)
    one, same, other = (table.read_text(encoding="utf-8") for table in tables)
    assert one == same != other
    capsys.readouterr()
    run("calibrate", "geometry", str(tables[0]), "--json")
    held_out = json.loads(capsys.readouterr().out)["held_out"]
    assert held_out["rms_after_mm"] < 0.2 * held_out["rms_before_mm"]


def test_points_of_another_frame_are_doubted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = measured(tmp_path, 6)
    rows = [line.split(",") for line in table.read_text(encoding="utf-8").splitlines()]
    turned = [rows[0], *([*row[:6], row[7], f"{-float(row[6]) + 300:.3f}", row[8]] for row in rows[1:])]
    table.write_text("\n".join(",".join(row) for row in turned), encoding="utf-8")
    run("calibrate", "geometry", str(table))
    assert "hint: a camera's own frame needs --frame free" in capsys.readouterr().err
    run("calibrate", "geometry", str(table), "--frame", "free", "--json")
    record = json.loads(capsys.readouterr().out)
    assert record["noise_mm"] < 0.1
    assert "frame turn z" in record["parameters"]


def test_a_terminal_is_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from cdhr_host.cli import calibrate_geometry

    table, mine = measured(tmp_path, 1, 0.2), tmp_path / "asked.toml"
    for stream in ("stdin", "stderr"):
        monkeypatch.setattr(f"sys.{stream}.isatty", lambda: True, raising=False)
    answers = iter(["", str(mine)])
    monkeypatch.setattr(calibrate_geometry.typer, "prompt", lambda *_, **__: next(answers))
    run("calibrate", "geometry", str(table))
    assert not mine.exists()
    run("calibrate", "geometry", str(table))
    assert open_profile(str(mine)).calibration.greatest() > 0.0


def test_studies_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = "--workers", "1", "--json"
    run("calibrate", "study", "--machines", "3", "--count", "12", *one)
    assert len(json.loads(capsys.readouterr().out)["rms_after_mm"]) == 3
    run("study", "tolerance", "--machines", "2", *one)
    assert set(json.loads(capsys.readouterr().out)["greatest_mm"]) == {
        "pulley",
        "attachment",
        "offset",
        "radius",
    }
    nodes = tmp_path / "nodes.csv"
    run("study", "workspace", "--step", "160", "--write", str(nodes), *one)
    record = json.loads(capsys.readouterr().out)
    assert record["volume_l"] > 5.0
    assert nodes.read_text(encoding="ascii").startswith("x_mm,y_mm,z_mm,margin\n-320,-320,0,")
