"""Programs made by formula: the committed files are what their first comment says made them."""

import math
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from cdhr_host.cli.app import app
from cdhr_host.samples import LAWS, Ring, ring, traced
from cdhr_host.samples.words import word
from cdhr_host.units import MM

GCODE = Path(__file__).resolve().parents[2] / "gcode"
SHIPPED = sorted(GCODE.glob("paper_*.gcode"))
NUMBER = re.compile(r"([XYZEFIJ])([-+\d.]+)")


def words(line: str) -> dict[str, float]:
    return {letter: float(number) for letter, number in NUMBER.findall(line.partition(";")[0])}


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_programs_are_what_their_command_makes(path: Path, tmp_path: Path) -> None:
    command = path.read_text().split("\n", 1)[0].removeprefix("; cdhr ").partition(" : ")[0]
    made = tmp_path / "made.gcode"
    result = CliRunner().invoke(app, [*shlex.split(command), "-o", str(made)])
    assert result.exit_code == 0, result.output
    assert made.read_bytes() == path.read_bytes()


def test_the_four_programs_of_the_paper_are_shipped() -> None:
    assert [path.stem for path in SHIPPED] == ["paper_eq15", "paper_eq35", "paper_eq36", "paper_ring_double"]


def test_the_ring_closes_and_is_laid_layer_by_layer() -> None:
    shape = Ring(diameter=0.2, layers=3, bead=0.005, layer_height=0.002, speed=0.02)
    text = list(ring(shape))
    arcs = [words(line) for line in text if line.startswith("G3")]
    heights = [words(line)["Z"] for line in text if line.startswith("G0 Z")]
    assert len(arcs) == 12
    assert (arcs[3]["X"], arcs[3]["Y"]) == (100, 0)
    assert heights == [10, 2, 4, 6, 16]
    assert text[-2:] == ["G28 ; back to the reference, above the clay", "M84 ; cables stay taut"]


def test_the_ring_has_the_clay_of_its_bead() -> None:
    shape = Ring(diameter=0.15, layers=1, bead=0.005, layer_height=0.0025, speed=0.02)
    last = [words(line) for line in ring(shape) if line.startswith("G3")][-1]
    section_mm2 = 2.5 * 2.5 + math.pi * 2.5**2 / 4
    assert last["E"] == pytest.approx(section_mm2 * math.pi * 150, abs=1e-4)
    assert last["F"] == 1200


@pytest.mark.parametrize("equation", LAWS)
def test_a_traced_law_keeps_its_places_and_its_time(equation: str) -> None:
    law = LAWS[equation]
    t = law.times(0.5)
    moves = [words(line) for line in traced(t, law.position(t)) if line.startswith("G1")]
    places = np.array([[move[axis] for axis in "XYZ"] for move in moves])
    np.testing.assert_allclose(places[-1], law.position(t[-1:])[0] / MM, atol=0.05)
    lengths = np.linalg.norm(np.diff(places, axis=0, prepend=law.position(t[:1]) / MM), axis=1)
    taken = sum(length / move["F"] * 60 for length, move in zip(lengths, moves, strict=True))
    assert taken == pytest.approx(law.duration, rel=1e-3)


def test_a_law_that_does_not_begin_at_the_reference_is_travelled_to() -> None:
    t = np.array([0.0, 1.0])
    lines = list(traced(t, np.array([[0.01, 0.0, 0.0], [0.01, 0.001, 0.0]])))
    assert lines[2] == "G0 X10 Y0 Z0 F1200"
    assert lines[3] == "G1 X10 Y1 Z0 F60"


def test_samples_too_near_to_each_other_are_one_move() -> None:
    t = np.array([0.0, 1.0, 2.0, 3.0])
    lines = list(traced(t, np.array([[0, 0, 0], [0, 0, 0], [4e-5, 0, 0], [0.003, 0, 0]])))
    assert [line for line in lines if line.startswith("G1")] == ["G1 X3 Y0 Z0 F60"]


@pytest.mark.parametrize(
    ("value", "text"), [(1e-5, "X0.00001"), (-1e-9, "X0"), (-0.5, "X-0.5"), (1200, "X1200"), (1e-7, "X0")]
)
def test_numbers_have_no_exponent_and_no_negative_zero(value: float, text: str) -> None:
    assert word("X", value) == text
