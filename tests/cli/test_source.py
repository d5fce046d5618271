"""Programs are read in chunks, whatever they are packed in; what is no program is refused kindly."""

import gzip
import io
import os
import sys
from pathlib import Path

import pytest

from cdhr_host.cli.refusals import Refusal
from cdhr_host.cli.source import CHUNK, Source

TEXT = b"G1 X1 F600\n" * 20_000


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "ring.gcode"
    path.write_bytes(TEXT)
    return path


def test_a_file_is_read_in_chunks_and_read_again(program: Path) -> None:
    source = Source(str(program))
    first = list(source.chunks())
    assert b"".join(first) == TEXT
    assert max(map(len, first)) <= CHUNK
    assert source.fraction == 1.0
    assert b"".join(source.chunks()) == TEXT


def test_gzip_is_told_by_its_first_bytes_not_its_name(program: Path) -> None:
    program.write_bytes(gzip.compress(TEXT))
    source = Source(str(program))
    assert b"".join(source.chunks()) == TEXT
    assert source.fraction == 1.0


def test_standard_input_has_no_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(TEXT)))
    source = Source("-")
    assert b"".join(source.chunks()) == TEXT
    assert (source.name, source.size, source.fraction) == ("<stdin>", None, None)


def test_a_missing_file_names_its_nearest_neighbour(program: Path) -> None:
    with pytest.raises(Refusal, match=r"no such file\nhint: did you mean .*ring\.gcode") as refused:
        Source(str(program.with_name("rign.gcode")))
    assert refused.value.exit_code == 2


@pytest.mark.parametrize(("what", "words"), [("folder", "this is a folder"), ("pipe", "not a regular file")])
def test_what_is_no_file_is_refused(tmp_path: Path, what: str, words: str) -> None:
    path = tmp_path / what
    path.mkdir() if what == "folder" else os.mkfifo(path)
    with pytest.raises(Refusal, match=words):
        Source(str(path))


@pytest.mark.parametrize("cut", [10, 100, -4])
def test_a_damaged_archive_is_refused(program: Path, cut: int) -> None:
    program.write_bytes(gzip.compress(TEXT)[:cut])
    with pytest.raises(Refusal, match="cannot read"):
        list(Source(str(program)).chunks())


def test_an_archive_of_rubbish_is_refused(program: Path) -> None:
    program.write_bytes(b"\x1f\x8b" + b"rubbish" * 100)
    with pytest.raises(Refusal, match="cannot read"):
        list(Source(str(program)).chunks())


def test_a_file_that_changes_between_proof_and_print_is_refused(program: Path) -> None:
    source = Source(str(program))
    source.still_the_same()
    program.write_bytes(TEXT + b"G1 X2\n")
    with pytest.raises(Refusal, match="changed"):
        source.still_the_same()
