"""The text itself: line ends, encodings, cut-off, endless and binary files, in bounded memory."""

import gzip
import tracemalloc
from collections.abc import Iterator

import pytest
from program_reading import PAPER_WIDE, moves, only_problem, read, refused, shown, warnings

from cdhr_host.errors import Problem, ProgramError
from cdhr_host.program import Interpreter
from cdhr_host.program.text import LINE_MAX, Piece, pieces

THREE = ["G1 X1 F600", "; \u00e0 half \u2026", "G1 X2"]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
@pytest.mark.parametrize("size", [1, 2, 3, 1000])
def test_line_ends_encodings_and_chunks(end: str, encoding: str, size: int) -> None:
    text = THREE if encoding != "latin-1" else [line.replace("\u2026", "\u00b5") for line in THREE]
    data = "".join(line + end for line in text).encode(encoding)
    chunks = [data[at : at + size] for at in range(0, len(data), size)]
    assert shown(Interpreter(PAPER_WIDE).commands(chunks)) == [
        "1 move to 1 0 0 at 10",
        "3 move to 2 0 0 at 10",
    ]


@pytest.mark.parametrize("text", ["", "\n", "; only a comment", "\r\n\r\n", ";x\n(y)\n\n  \n"])
def test_a_text_without_commands_is_legal_with_a_warning(text: str) -> None:
    commands = read(text)
    assert warnings(commands) == ["the text holds no command"]
    assert len(commands) == 1


def test_no_chunks_at_all() -> None:
    assert len(list(Interpreter(PAPER_WIDE).commands([]))) == 1
    assert len(list(Interpreter(PAPER_WIDE).commands([b"", b""]))) == 1


@pytest.mark.parametrize("tail", ["G1 X2", "G", "G1 X2 ; whole?", "(a comment) M0", "(open"])
def test_a_file_that_ends_inside_a_line(tail: str) -> None:
    problem = only_problem("G1 X1 F600\n" + tail)
    assert problem.message == "the file ends inside line 2"
    assert (problem.line, problem.column, problem.kind) == (2, len(tail) + 1, "unfinished")
    assert "cut off" in (problem.hint or "")


@pytest.mark.parametrize("tail", ["; end", "  ", "(end)", "\r", "G1 X2\r", "M2\nG1 X"])
def test_a_file_that_ends_well(tail: str) -> None:
    assert moves(read("G1 X1 F600\n" + tail))[0] == [1, 0, 0]


@pytest.mark.parametrize("size", [1000, 40_000, 1 << 17, 1 << 20])
def test_long_lines_are_refused_once_and_counted_as_one(size: int) -> None:
    data = b"G1 X1 F600\n;" + b"x" * (LINE_MAX - 1) + b"\n;" + b"x" * LINE_MAX + b"\r\nG6\n" + b"G" * 300_000
    chunks = [data[at : at + size] for at in range(0, len(data), size)]
    with pytest.raises(ProgramError) as caught:
        list(Interpreter(PAPER_WIDE).commands(chunks))
    assert [(problem.line, problem.kind) for problem in caught.value.problems] == [
        (3, "long-line"),
        (4, "word"),
        (5, "long-line"),
    ]


def test_a_long_line_at_the_end_of_a_lone_cr_file() -> None:
    error = refused(b"G1 X1 F600\r;" + b"y" * 90_000 + b"\rG6\r")
    assert [problem.line for problem in error.problems] == [2, 3]


def test_an_endless_line_needs_no_memory() -> None:
    part = b"G1 X1 " * (1 << 16)

    def endless() -> Iterator[bytes]:
        yield b"G21\n"
        for _ in range(256):
            yield part

    tracemalloc.start()
    with pytest.raises(ProgramError) as caught:
        list(Interpreter(PAPER_WIDE).commands(endless()))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert caught.value.total == 1
    assert peak < 3_000_000


def test_memory_does_not_grow_with_the_program() -> None:
    def long(repeats: int) -> Iterator[bytes]:
        for _ in range(repeats):
            yield b"".join(b"G1 X%d Y%d E1 F600\n" % (n % 7, n % 11) for n in range(500))

    def peak(repeats: int) -> int:
        tracemalloc.start()
        for _ in Interpreter(PAPER_WIDE).commands(long(repeats)):
            pass
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    assert peak(120) < 1.2 * peak(30)


@pytest.mark.parametrize(
    ("data", "hint"),
    [
        (gzip.compress(b"G1 X1 F600\n" * 500, mtime=0), "gzip"),
        (b"PK\x03\x04" + bytes(range(256)), "zip"),
        (b"GCDE\x01\x00\x00\x00", "binary G-code"),
        ("G1 X1 F600\n".encode("utf-16"), "UTF-16"),
        (b"\x7fELF\x02\x01", "slicer"),
    ],
)
def test_binary_files(data: bytes, hint: str) -> None:
    problem = refused(data).problems[-1]
    assert problem.kind == "binary"
    assert "not a G-code text" in problem.message
    assert hint in (problem.hint or "")


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_binary_stops_the_reading_where_it_is(size: int) -> None:
    consumed: list[int] = []

    def chunks() -> Iterator[bytes]:
        data = b"G1 X1 F600\r\nG6\r\nG1 X\x00\nG7\n" + b"\x00" * 500_000
        for at in range(0, len(data), size):
            consumed.append(at)
            yield data[at : at + size]

    with pytest.raises(ProgramError) as caught:
        list(Interpreter(PAPER_WIDE).commands(chunks()))
    assert [(item.line, item.column, item.kind) for item in caught.value.problems] == [
        (2, 1, "word"),
        (3, 5, "binary"),
    ]
    assert consumed[-1] < 200_000


def test_pieces_are_whole_lines() -> None:
    assert list(pieces([b"a\r", b"\nb", b"c\rd\n"])) == [Piece(1, "a\nbc\nd\n")]
    (last,) = pieces([b"word"], first_line=9)
    assert isinstance(last, Problem)
    assert last.line == 9
