"""``cdhr plot``: pictures of real logs, looked at pixel by pixel; refusals with what to do."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from cdhr_host.cli.app import app
from cdhr_host.errors import Problem
from cdhr_host.job.black_box import BlackBox
from cdhr_host.pipeline import open_profile, prove
from cdhr_host.values import Feedback

image = pytest.importorskip("matplotlib.image")


def run(*arguments):
    return CliRunner().invoke(app, [str(each) for each in arguments])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plot")
    program = folder / "part.gcode"
    program.write_text("M83\nG1 Z5 F1200\nG1 X60 E300\nG1 Y40 E200\nG1 X0 Y0 Z0 F3000\n")
    assert run("dry-run", program, "--log", folder / "plan.parquet").exit_code == 0
    assert run("dry-run", program, "--log", folder / "plan.csv").exit_code == 0
    assert run("dry-run", program, "--log", folder / "small.parquet", "--compact").exit_code == 0
    assert run("stream", program, "--speed", "100", "--log", folder / "run.parquet").exit_code == 0
    return folder


def near(pixels, colour):
    """How many pixels have about this colour, 0 to 255."""
    return int((np.abs(pixels[..., :3] * 255 - np.array(colour)).max(axis=2) < 12).sum())


def test_all_that_a_plan_has(folder):
    result = run("plot", folder / "plan.parquet", "--out", folder / "all.png")
    assert result.exit_code == 0
    names = [f"all-{name}.png" for name in ("path", "sliders", "forces", "air")]
    assert result.stdout.split() == [str(folder / name) for name in names]
    forces = image.imread(folder / "all-forces.png")
    assert near(forces, (0xEE, 0xF3, 0xF0)) > 0.3 * forces[..., 0].size
    for blue in ("all-sliders.png", "all-forces.png", "all-air.png"):
        assert near(image.imread(folder / blue), (0x00, 0x72, 0xB2)) > 300


def test_a_run_shows_its_following_error_and_deposited_clay(folder):
    result = run("plot", folder / "run.parquet", "--out", folder / "run.png", "--profile", "paper")
    assert result.exit_code == 0
    assert (folder / "run-following.png").exists()
    assert near(image.imread(folder / "run-air.png"), (0xD5, 0x5E, 0x00)) > 200


def test_events_of_a_black_box_are_named(tmp_path):
    paper, blocks = open_profile("paper"), []
    prove([b"G1 X60 F1200\nG1 X0\n"], paper, sink=blocks.append)
    box = BlackBox(paper)
    for rows in blocks:
        none = np.zeros((len(rows), 6))
        box.executed(
            rows, Feedback(rows.tick, rows.slider, rows.slider, none.astype(int), none, rows.pressure)
        )
    box.event("fault", "slider 3 fell behind")
    box.write(tmp_path / "box.npz", Problem("fault", "slider 3 fell behind"), "part.gcode", [])
    out = tmp_path / "box.svg"
    assert run("plot", tmp_path / "box.npz", "-w", "following", "-o", out).exit_code == 0
    drawn = out.read_text(encoding="utf-8")
    assert "part.gcode: slider 3 fell behind" in drawn
    assert ">fault</text>" in drawn


@pytest.mark.parametrize("suffix", ["svg", "pdf"])
def test_other_kinds_of_picture(folder, suffix):
    out = folder / f"sliders.{suffix}"
    assert run("plot", folder / "small.parquet", "--what", "sliders", "--out", out).exit_code == 0
    head = {"svg": b"<?xml", "pdf": b"%PDF"}[suffix]
    assert out.read_bytes().startswith(head)
    if suffix == "svg":
        assert "mm/s³" in out.read_text(encoding="utf-8")


def test_json_tells_pictures_and_extremes(folder):
    out = folder / "path.png"
    result = run("plot", folder / "plan.parquet", "-w", "path", "-c", "tension", "-o", out, "--json")
    record = json.loads(result.stdout)
    assert record["pictures"] == [str(out)]
    assert record["extremes"]["x_mm"]["max"] == pytest.approx(60, abs=0.01)
    assert record["extremes"]["x_mm"]["max_line"] in {3, 4}
    assert 0 < record["extremes"]["margin"]["min"] < 1


def test_a_machine_that_is_not_named_is_told(folder):
    result = run("plot", folder / "plan.csv", "-w", "forces", "-o", folder / "forces.png")
    assert result.exit_code == 0
    assert "--profile P names it" in result.stderr
    windows = near(image.imread(folder / "forces.png"), (0xEE, 0xF3, 0xF0))
    run("plot", folder / "plan.csv", "-w", "forces", "-o", folder / "forces.png", "--profile", "paper")
    assert near(image.imread(folder / "forces.png"), (0xEE, 0xF3, 0xF0)) > windows + 10_000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plan.parquet", "-o", "a.bmp"], "does not end in .png or .svg or .pdf"),
        (
            ["plan.parquet", "-w", "following"],
            "nothing for --what following; it has path, sliders, forces, air",
        ),
        (["small.parquet", "-w", "forces"], "nothing for --what forces; it has path, sliders, air"),
        (["small.parquet", "-c", "tension"], "--colour speed would do"),
        (["plan.parquet", "--lines", "9:2"], "not A:B"),
        (["plan.parquet", "--from", "5", "--to", "4"], "not before"),
        (["plan.parquet", "--from", "5000"], "none of its rows"),
        (["part.gcode"], "does not end in .csv, .parquet, .npz"),
        (["missing.csv"], "no such file"),
    ],
)
def test_what_cannot_be_drawn_is_refused(folder, monkeypatch, arguments, words):
    monkeypatch.chdir(folder)
    result = run("plot", *arguments)
    assert result.exit_code == 2
    assert words in result.stderr


def test_without_matplotlib_the_command_to_install_it_is_told(folder, monkeypatch):
    monkeypatch.setattr("cdhr_host.report.plot.write.find_spec", lambda _: None)
    result = run("plot", folder / "plan.parquet")
    assert result.exit_code == 2
    assert "pip install 'cdhr-host[plot]'" in result.stderr


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_what_ends_early_leaves_no_half_picture(folder, tmp_path, monkeypatch, error):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", fails)
    result = run("plot", folder / "plan.parquet", "-o", tmp_path / "a.png")
    assert result.exit_code in {2, 130}
    assert list(tmp_path.iterdir()) == []
