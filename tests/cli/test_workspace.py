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
