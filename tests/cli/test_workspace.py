"""``cdhr workspace``: radii, volumes and margins, in words, as a record and as a picture."""

import json

import pytest
from typer.testing import CliRunner

from cdhr_host.cli.app import app


def run(*arguments: str):
    return CliRunner().invoke(app, ["workspace", *arguments])


@pytest.fixture(scope="module")
def record():
    return json.loads(run("--profile", "paper-wide", "--json").stdout)


def test_free_reaches_further_than_the_others(record):
    radius = {name: max(values) for name, values in record["radius_mm"].items()}
    assert radius["free"] >= 380
    assert radius["free"] > max(radius[name] for name in ("fixed", "preload", "vertical")) + 100
    assert record["volume_l"]["free"] > 2 * record["volume_l"]["vertical"]


def test_margins_of_the_papers_trajectories_are_told_for_every_policy(record):
    assert set(record["margin"]) == {
        f"{name} {policy}"
        for name in ("15", "35", "36")
        for policy in ("fixed", "preload", "vertical", "free")
    }
    assert all(record["margin"][f"{name} free"] > 0 for name in ("15", "35", "36"))


def test_words_and_picture(tmp_path):
    picture = tmp_path / "radius.png"
    result = run("--profile", "paper", "--figure", str(picture))
    assert result.exit_code == 0
    assert "free" in result.stdout
    assert "Eq. (36)" in result.stdout
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_unknown_picture_kind_is_refused():
    assert run("--figure", "radius.bmp").exit_code == 2


def test_the_feasible_volume_is_told_with_its_doubt(record):
    feasible = record["feasible"]
    assert feasible["policy"] == "free"
    assert feasible["litres"] > record["volume_l"]["free"]
    assert feasible["doubt_litres"] < 0.01 * feasible["litres"]


def test_a_program_is_placed_and_the_map_shows_it(tmp_path):
    program, picture = tmp_path / "part.gcode", tmp_path / "map.png"
    program.write_text("M83\nG1 X150 F3000\nG1 Z2\nG1 X90 E300\nG1 Y40 E200\n")
    result = run("--file", str(program), "--map", str(picture), "--json")
    assert result.exit_code == 0
    part = json.loads(result.stdout)["file"]
    assert part["best"]["least_margin"] >= part["best_in_plane"]["least_margin"] > part["least_margin"]
    pixels = pytest.importorskip("matplotlib.image").imread(picture)[..., :3]
    part_colour = abs(pixels - [0xD5 / 255, 0x5E / 255, 0]).max(axis=2) < 0.05
    assert part_colour.sum() > 150


def test_a_program_without_clay_has_no_place(tmp_path):
    program = tmp_path / "travel.gcode"
    program.write_text("G1 X50 F3000\n")
    result = run("--file", str(program))
    assert result.exit_code == 2
    assert "lays no clay" in result.stderr


def test_a_full_disk_leaves_no_half_picture(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    for option in ("--map", "--figure"):
        result = run(option, str(tmp_path / "a.png"))
        assert result.exit_code == 2
        assert "No space left" in result.stderr
        assert list(tmp_path.iterdir()) == []
