"""``cdhr dry-run --report``: a page beside the words, whatever the verdict, or no page at all."""

import json

import pytest
from typer.testing import CliRunner

from cdhr_host.cli.app import app
from cdhr_host.cli.source import Source


@pytest.fixture
def part(tmp_path):
    path = tmp_path / "part.gcode"
    path.write_text("M83\nG1 Z2 F1200\nG1 X40 E90\nG1 Y30 E70\n")
    return path


def run(*arguments):
    return CliRunner().invoke(app, ["dry-run", *map(str, arguments)])


def test_words_name_the_page(part, tmp_path):
    page = tmp_path / "part.html"
    result = run(part, "--report", page)
    assert result.exit_code == 0
    assert str(page) in result.stdout
    assert page.read_text().startswith("<!DOCTYPE html>")


def test_json_tells_the_time_by_layer(tmp_path):
    path = tmp_path / "layers.gcode"
    path.write_text("M83\n;LAYER:0\nG1 Z2 F1200\nG1 X40 E90\n;LAYER:1\nG1 Z4\nG1 X0 E90\n")
    record = json.loads(run(path, "--json").stdout)
    layers = record["layer_times"]
    assert [layer["line"] for layer in layers] == [2, 5]
    assert sum(layer["duration_s"] for layer in layers) == pytest.approx(record["duration_s"])
    assert layers[1]["begin_s"] == pytest.approx(layers[0]["duration_s"])


def test_json_stays_one_object_and_names_the_page(part, tmp_path):
    page, log = tmp_path / "part.html", tmp_path / "part.csv"
    result = run(part, "--report", page, "--log", log, "--json")
    assert json.loads(result.stdout)["report"] == str(page)
    assert page.exists()
    assert log.exists()


@pytest.mark.parametrize(("text", "code"), [("G1 X340 F1200\n", 5), ("G1 X10 F1200\nG99\n", 4)])
def test_refused_programs_have_a_page_too(part, tmp_path, text, code):
    part.write_text(text)
    page = tmp_path / "part.html"
    result = run(part, "--report", page, "--json")
    assert result.exit_code == code
    assert json.loads(result.stdout)["report"] == str(page)
    assert '"problems": [{' in page.read_text()


@pytest.mark.parametrize(
    ("name", "words"),
    [("part.pdf", "does not end in .html"), ("nowhere/part.html", "there is no folder"), (".", ".html")],
)
def test_a_place_that_will_not_do_is_refused_before_any_work(part, tmp_path, monkeypatch, name, words):
    monkeypatch.setattr(Source, "chunks", lambda _: pytest.fail("read although the page cannot be written"))
    result = run(part, "--report", tmp_path / name)
    assert result.exit_code == 2
    assert words in result.stderr


def test_an_interrupted_run_leaves_no_page(part, tmp_path, monkeypatch):
    def interrupted(_):
        yield b"G1 X10 F1200\n"
        raise KeyboardInterrupt

    monkeypatch.setattr(Source, "chunks", interrupted)
    result = run(part, "--report", tmp_path / "part.html")
    assert result.exit_code == 130
    assert [path.name for path in tmp_path.iterdir()] == ["part.gcode"]


def test_a_full_disk_is_told(part, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    result = run(part, "--report", tmp_path / "part.html")
    assert result.exit_code == 2
    assert "No space left on device" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["part.gcode"]
