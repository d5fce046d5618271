"""Laws of text -> commands, whatever the text."""

from collections.abc import Iterable
from dataclasses import astuple
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.errors import ProgramError
from cdhr_host.profile import read_table, validate
from cdhr_host.program import WORDS, Block, Interpreter, Word, parse_line, print_block
from cdhr_host.values import Arc, Command, Moves, Prime, Spline

ROOT = Path(__file__).resolve().parents[2]
PROFILE = validate(read_table(ROOT / "profiles" / "paper-wide.toml"))[0]

numbers = st.floats(-1e8, 1e8, allow_nan=False).map(lambda value: round(value, 6) + 0.0)
written = st.one_of(
    st.integers(-999, 999).map(str),
    st.decimals(-500, 500, places=3).map(str),
    st.sampled_from([".5", "-.25", "+3", "7.", "-0", "0.00001", "12345678901", "1e-05", "1,5", "nan", ""]),
)
feeds = st.sampled_from(["600", "1200.5", "9000", "0.5", "0.5", "0", "-1"])


@st.composite
def blocks(draw: st.DrawFn) -> Block:
    row = WORDS[draw(st.sampled_from(sorted(WORDS)))]
    letters = draw(st.permutations(row.letters))[: draw(st.integers(0, len(row.letters)))]
    letters += [letter for letter in row.needs if letter not in letters]
    words = []
    for letter in letters:
        bare = row.bare and draw(st.booleans())
        value = None if bare else draw(st.floats(0.001, 1e8) if letter == "F" else numbers)
        words.append(Word(letter, value))
    text = draw(st.sampled_from(["", "hello (you)", "5*3", "\u00e9t\u00e9"])) if row.text else ""
    return Block(draw(st.integers(1, 10**6)), row.code, tuple(words), text)


@st.composite
def straight_lines(draw: st.DrawFn) -> str:
    order = draw(st.sampled_from(["FXYZE", "XYZEF", "ZXYEF", "XYEF", "E", "XEYZ", "FXF", "X", "F", ""]))
    words = [f"{letter}{draw(feeds if letter == 'F' else written)}" for letter in order]
    tail = draw(st.sampled_from(["", "", "", " ", " ; note", ";"]))
    return " ".join([draw(st.sampled_from(["G0", "G1", "G1", "G01"])), *words]) + tail


OTHER_LINES = """
G20|G21|G90|G91|G92|G92 E0|G92 X3 E1|M82|M83|M200 D1.75|M200 D0|M220 S50|M221 S120|M3 S100|M5|G28
;LAYER:1|; note||G4 P10|M117 hi|G2 X5 I2.5|G3 X1 Y1 R9|M400|G6|M84|M2
G17|G18|G19|G2 X3 Z2 I1 K1|G3 Y1 K2|G5 X2 Y1 I1 J2 P-1 Q2 E1|G5 X5 P1 Q1|G5.1 X2 I1 J3|G61|G64|G64 P.1
"""
other_lines = st.sampled_from([word for row in OTHER_LINES.split("\n") for word in row.split("|")])
texts = st.lists(st.one_of(straight_lines(), straight_lines(), other_lines), max_size=25)


def plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value


def outcome(chunks: Iterable[bytes]) -> tuple[list[Any], list[Any]]:
    """(commands as plain values, problems without columns)."""
    made: list[Any] = []
    try:
        for command in Interpreter(PROFILE).commands(chunks):
            made.append((type(command).__name__, *(plain(value) for value in astuple(command))))
    except ProgramError as error:
        return made, [(problem.line, problem.kind, problem.message) for problem in error.problems]
    return made, []


def commands_of(lines: list[str]) -> list[Command]:
    try:
        return list(Interpreter(PROFILE).commands(["".join(line + "\n" for line in lines).encode()]))
    except ProgramError:
        return []


@given(blocks())
def test_a_printed_block_reads_back(block: Block) -> None:
    read, problems = parse_line(print_block(block).encode().decode("latin-1"), block.line)
    assert problems == []
    assert read == block


@given(texts, st.lists(st.integers(1, 40), min_size=1, max_size=10), st.sampled_from(["\n", "\r\n", "\r"]))
def test_the_size_of_chunks_does_not_matter(lines: list[str], sizes: list[int], end: str) -> None:
    data = "".join(line + end for line in lines).encode()
    chunks, at = [], 0
    while at < len(data):
        size = sizes[len(chunks) % len(sizes)]
        chunks.append(data[at : at + size])
        at += size
    assert outcome(chunks) == outcome([data])


@settings(max_examples=300)
@given(texts)
def test_the_fast_reader_and_the_parser_mean_the_same(lines: list[str]) -> None:
    fast = "".join(line + "\n" for line in lines)
    parsed = "".join(f"() {line}\n" if line.startswith("G") else f"{line}\n" for line in lines)
    assert outcome([fast.encode()]) == outcome([parsed.encode()])


def ends(item: Command) -> tuple[list[float], list[float]] | None:
    """Where a command that moves begins and ends."""
    if isinstance(item, Spline):
        return item.control_G[0].tolist(), item.control_G[3].tolist()
    if isinstance(item, Moves | Arc):
        return item.start_G.tolist(), np.atleast_2d(item.end_G)[-1].tolist()
    return None


@given(texts)
def test_the_path_has_no_gaps(lines: list[str]) -> None:
    for before, after in pairwise(filter(None, map(ends, commands_of(lines)))):
        assert before[1] == after[0]


@given(texts)
def test_clay_and_feeds_are_never_negative(lines: list[str]) -> None:
    for item in commands_of(lines):
        if isinstance(item, Moves | Arc | Spline):
            assert np.all(np.asarray(item.clay) >= 0)
            assert np.all(np.asarray(item.speed) > 0)
        if isinstance(item, Moves):
            points = np.vstack([item.start_G, item.end_G])
            assert np.all(np.any(np.diff(points, axis=0) != 0, axis=1))
        if isinstance(item, Prime):
            assert item.clay > 0
            assert item.flow > 0


@given(st.lists(st.integers(-40, 40), min_size=1, max_size=60), st.booleans())
def test_clay_is_what_e_reaches_beyond_its_highest(steps: list[int], absolute: bool) -> None:
    reached = np.cumsum(steps) / 8
    values = reached if absolute else np.array(steps) / 8
    lines = ["M200 D1", "M82" if absolute else "M83", "F600"]
    lines = [*lines[:2], "G1 F600", *(f"G1 X{n} E{value}" for n, value in enumerate(values, 1))]
    clay = sum(float(item.clay.sum()) for item in commands_of(lines) if isinstance(item, Moves))
    assert clay == pytest.approx(max(0.0, reached.max()) * 1e-9, abs=1e-15)


@settings(max_examples=300)
@given(st.one_of(st.binary(max_size=200), st.text(alphabet="GMTXYZEIJRFN0123456789.,-+*;() \t\r\ne\u00e9")))
def test_any_bytes_are_read_or_refused(data: bytes | str) -> None:
    made, problems = outcome([data if isinstance(data, bytes) else data.encode()])
    assert made or problems
