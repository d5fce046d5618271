"""The real programs in gcode/, against a second, naive reading of them."""

import math
import re

import numpy as np
import pytest
from program_reading import PAPER_WIDE, ROOT, warnings

from cdhr_host.program import Interpreter
from cdhr_host.values import Arc, Command, Moves, Notice, Prime

FILES = {
    "arcwelder_ring_absE": 10,
    "cura_ring": 10,
    "cura_tile_volumetric": 5,
    "fullcontrol_nonplanar_generic_relE": 0,
    "fullcontrol_nonplanar_wasp2040clay": 0,
    "prusa_ring_double_absE": 10,
    "prusa_tile_fwretract_marlin_temps": 5,
    "prusa_tile_infill_volE": 5,
    "prusa_vase_spiral_relE": 48,
}
WORD = re.compile(r"([GMXYZEF])(-?\d*\.?\d+)")
CLAY = math.pi / 4 * 1.1283791671**2


def naive(text: str) -> tuple[list[tuple[float, ...]], float]:
    """(points in mm in the order they are reached, clay in mm³), leaving G28 out."""
    at = {"X": 0.0, "Y": 0.0, "Z": 0.0, "E": 0.0}
    relative = {"G91": False, "M83": False}
    points, highest, reached = [], 0.0, 0.0
    for line in text.splitlines():
        words = WORD.findall(line.split(";")[0])
        if not words or line.startswith("M117"):
            continue
        code = words[0][0] + words[0][1]
        relative |= {"G90": {"G91": False}, "M82": {"M83": False}}.get(code, {})
        relative |= {code: True} if code in relative else {}
        before = dict(at)
        if code in {"G0", "G1", "G2", "G3", "G92"}:
            for letter, number in words[1:]:
                if letter in at:
                    moved = relative["M83" if letter == "E" else "G91"] and code != "G92"
                    at[letter] = at[letter] * moved + float(number)
        if code == "G28":
            at |= {"X": 0.0, "Y": 0.0}
        if code in {"G0", "G1", "G2", "G3"}:
            points.append((at["X"], at["Y"], at["Z"]))
            reached += at["E"] - before["E"]
            highest = max(highest, reached)
    return points, highest * CLAY


def read_file(name: str) -> tuple[str, list[Command], Interpreter]:
    data = (ROOT / "gcode" / f"{name}.gcode").read_bytes()
    interpreter = Interpreter(PAPER_WIDE)
    return data.decode(), list(interpreter.commands([data])), interpreter


@pytest.mark.parametrize("name", FILES)
def test_real_program(name: str) -> None:
    text, commands, interpreter = read_file(name)
    points, clay = naive(text)
    moves = [item for item in commands if isinstance(item, Moves)]
    arcs = [item for item in commands if isinstance(item, Arc)]
    primes = [item for item in commands if isinstance(item, Prime)]
    laid = sum(item.clay.sum() for item in moves) + sum(item.clay for item in [*arcs, *primes])
    assert laid == pytest.approx(clay * 1e-9, rel=1e-9)
    layers = [item.text for item in commands if isinstance(item, Notice) and item.kind == "layer"]
    assert layers == [str(layer) for layer in range(1, FILES[name] + 1)]
    assert interpreter.lines == text.count("\n")
    lines = text.splitlines()
    reached = {
        tuple(np.round(row * 1e3, 6))
        for item in moves
        for line, row in zip(item.line, item.end_G, strict=True)
        if "G28" not in lines[line - 1]
    } | {tuple(np.round(item.end_G * 1e3, 6)) for item in arcs}
    assert reached <= {tuple(np.round(point, 6)) for point in points}
    assert len(reached) > 0.9 * len(set(points))


def test_warnings_of_a_marlin_file_with_temperatures() -> None:
    given = warnings(read_file("prusa_tile_fwretract_marlin_temps")[1])
    assert [text.split()[0].rstrip(":") for text in given] == [
        "M201",
        "M203",
        "M204",
        "M205",
        "M190",
        "G28",
        "M84",
    ]


def test_arcs_of_arc_welder() -> None:
    arcs = [item for item in read_file("arcwelder_ring_absE")[1] if isinstance(item, Arc)]
    assert len(arcs) == 58
    for arc in arcs:
        radii = [math.dist(point[:2], arc.centre_G) for point in (arc.start_G, arc.end_G)]
        assert radii[0] == pytest.approx(radii[1], abs=5e-6)
        assert 0 < arc.sweep < 2 * math.pi
        assert arc.clay > 0
