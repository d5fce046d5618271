"""The page is whole, holds its numbers, and asks nobody for anything."""

import base64
import json
import re
import zlib

import numpy as np
import pytest

from cdhr_host.errors import ProgramError
from cdhr_host.pipeline import open_profile, prove
from cdhr_host.report.page import Trail, write_page

TEXT = b"M83\n;LAYER:0\nG1 Z2 F1200\nG1 X40 E90\nG1 Y30 E70\n;LAYER:1\nG1 Z4\nG1 X0 E80\n"


@pytest.fixture(scope="module")
def paper():
    return open_profile("paper")


@pytest.fixture(scope="module")
def page(paper, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "part.html"
    trail = Trail(paper)
    proof = prove([TEXT], paper, watch=trail.watch)
    write_page(path, trail, paper, proof, ("</script><b>.gcode", "paper"))
    return path.read_text(encoding="utf-8"), trail.vertices(), proof


def facts(text):
    return json.loads(re.search(r'id="facts-data"[^>]*>(.*?)</script>', text, re.DOTALL)[1])


def test_numbers_are_those_of_the_proof(page):
    text, rows, proof = page
    found = facts(text)
    assert found["count"] == len(rows)
    assert dict(found["facts"])["program"] == "8 lines, 5 moves, 2 layers"
    assert sum(layer["seconds"] for layer in found["layers"]) == pytest.approx(proof.duration)
    assert {row[0]: tuple(row[1:]) for row in found["extremes"]} == proof.extremes


def test_vertices_come_back_within_a_step(page):
    text, rows, _ = page
    found = facts(text)
    packed = re.search(r'id="vertices-data"[^>]*>(.*?)</script>', text, re.DOTALL)[1]
    data, at, count = zlib.decompress(base64.b64decode(packed)), 0, found["count"]
    columns = []
    for kind in [np.uint32] * 2 + [np.uint16] * 6 + [np.uint8]:
        differences = np.frombuffer(data, kind, count, at)
        columns.append(np.cumsum(differences, dtype=kind))
        at += differences.nbytes
    assert at == len(data)
    low, high = np.array(found["box"]["low"]), np.array(found["box"]["high"])
    places = low + (high - low) * np.column_stack(columns[2:5]) / 65535
    assert places == pytest.approx(1e3 * rows[:, :3], abs=0.01)
    assert np.array_equal(columns[1], rows[:, 8])
    assert columns[0] == pytest.approx(1e3 * rows[:, 7], abs=1)
    speed = found["scales"]["speed"]
    assert speed["low"] + (speed["high"] - speed["low"]) * columns[5] / 65535 == pytest.approx(
        1e3 * rows[:, 3], abs=0.01
    )
    assert np.array_equal(columns[8] == 1, rows[:, 6] > 0)


def test_nothing_is_asked_of_the_network_and_names_cannot_break_out(page):
    text = page[0]
    assert not re.findall(r"(?:src|href)\s*=\s*[\"'](?!data:)", text)
    assert not re.findall(r"https?://|fetch\(|XMLHttpRequest|import\(", text)
    assert text.count("</script>") == 3
    assert "default-src 'none'" in text
    assert "<b>" not in text


def test_a_refused_program_has_its_problems_on_the_page(paper, tmp_path):
    trail = Trail(paper)
    with pytest.raises(ProgramError) as refused:
        prove([b"G1 X10 F1200\nG99\n"], paper, watch=trail.watch)
    write_page(tmp_path / "bad.html", trail, paper, refused.value, ("bad.gcode", "paper"))
    found = facts((tmp_path / "bad.html").read_text(encoding="utf-8"))
    assert found["verdict"] == "refused"
    assert [problem["line"] for problem in found["problems"]] == [2]


def test_a_full_disk_leaves_the_old_page(paper, tmp_path, monkeypatch):
    path = tmp_path / "part.html"
    path.write_text("old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    trail = Trail(paper)
    proof = prove([TEXT], paper, watch=trail.watch)
    with pytest.raises(OSError, match="No space"):
        write_page(path, trail, paper, proof, ("part.gcode", "paper"))
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
