"""profiles/slicers with the real slicers: a pot is sliced and proven, and has the clay it must have."""

import json
import os
import shutil
import subprocess
from itertools import pairwise
from math import cos, pi, sin
from pathlib import Path

import pytest
from typer.testing import CliRunner

from cdhr_host.cli.app import app
from cdhr_host.pipeline import open_profile

ROOT = Path(__file__).resolve().parents[2]
SLICERS = ROOT / "profiles" / "slicers"
DEFINITIONS = [
    ROOT / "build" / "cura" / "usr" / "share" / "cura" / "resources" / "definitions",
    Path("/usr/share/cura/resources/definitions"),
]
"""where fdmprinter.def.json is, of the package cura"""
RADIUS, HEIGHT, CORNERS = 60.0, 12.5, 72


@pytest.fixture
def pot(tmp_path: Path) -> Path:
    """A cylinder of 120 mm and five layers, as an STL."""
    around = [2 * pi * k / CORNERS for k in range(CORNERS + 1)]
    rim = [(RADIUS * cos(a), RADIUS * sin(a)) for a in around]
    facets = []
    for (a, b), (c, d) in pairwise(rim):
        low, on, high, over = (a, b, 0.0), (c, d, 0.0), (c, d, HEIGHT), (a, b, HEIGHT)
        facets += [(low, on, high), (low, high, over), ((0, 0, 0), on, low), ((0, 0, HEIGHT), over, high)]
    lines = ["solid pot"]
    for facet in facets:
        corners = [f"vertex {x:.6f} {y:.6f} {z:.6f}" for x, y, z in facet]
        lines += ["facet normal 0 0 0", "outer loop", *corners, "endloop", "endfacet"]
    path = tmp_path / "pot.stl"
    path.write_text("\n".join([*lines, "endsolid pot", ""]))
    return path


def run(*command: object, **environment: str) -> None:
    words = [str(word) for word in command]
    done = subprocess.run(
        words, capture_output=True, text=True, env=os.environ | environment, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


def proven(program: Path) -> dict[str, float]:
    """What the dry run says of it on the machine the profile is for."""
    words = ["dry-run", str(program), "-p", "paper-wide", "--material", "stoneware", "--json"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def check(program: Path, bead: float) -> None:
    """Two layers of base, five rounds of wall and a skirt of beads of that section, mm², within 4 %."""
    text = program.read_text(encoding="utf-8")
    assert not any(f"\n{word}" in text for word in ("M104", "M109", "M140", "M190", "M106 S"))
    record = proven(program)
    inner = RADIUS - 5.0
    clay = 2 * pi * inner**2 * 2.5 + bead * 2 * pi * (5 * (RADIUS - 2.5) + RADIUS + 22.5)
    assert record["extruded_mm3"] == pytest.approx(clay, rel=0.04)
    assert record["layers"] == 5


def test_prusa_slicer(pot: Path, tmp_path: Path) -> None:
    if shutil.which("prusa-slicer") is None:
        pytest.skip("prusa-slicer is not installed (apt-get install prusa-slicer)")
    program = tmp_path / "pot.gcode"
    settings = SLICERS / "paper-wide.ini"
    run("prusa-slicer", "--load", settings, "--center", "0,0", "--export-gcode", "-o", program, pot)
    check(program, (5.0 - 2.5) * 2.5 + pi * 2.5**2 / 4)


def test_cura_engine(pot: Path, tmp_path: Path) -> None:
    known = [path for path in DEFINITIONS if (path / "fdmprinter.def.json").is_file()]
    if shutil.which("CuraEngine") is None or not known:
        pytest.skip(
            "CuraEngine or the definitions of Cura are not installed (apt-get install cura-engine cura)"
        )
    program = tmp_path / "pot.gcode"
    definition = SLICERS / "cdhr_paper_wide.def.json"
    search = f"{known[0]}:{SLICERS}"
    run(
        "CuraEngine",
        "slice",
        "-j",
        definition,
        "-o",
        program,
        "-e0",
        "-l",
        pot,
        CURA_ENGINE_SEARCH_PATH=search,
    )
    check(program, 5.0 * 2.5)


def settings_of_prusa() -> dict[str, str]:
    rows = (line.split(" = ", 1) for line in (SLICERS / "paper-wide.ini").read_text().splitlines())
    return {row[0]: row[1] for row in rows if len(row) == 2}


def test_slicer_profiles_fit_the_machine() -> None:
    """Bed, height, nozzle, filament: the numbers of paper-wide."""
    machine, prusa = open_profile("paper-wide"), settings_of_prusa()
    cura = json.loads((SLICERS / "cdhr_paper_wide.def.json").read_text())["overrides"]
    bore, radius = machine.extruder.nozzle_diameter * 1e3, machine.bed.radius * 1e3
    corners = [[float(each) for each in corner.split("x")] for corner in prusa["bed_shape"].split(",")]
    assert all((x**2 + y**2) ** 0.5 == pytest.approx(radius, abs=0.01) for x, y in corners)
    assert cura["machine_width"]["default_value"] == cura["machine_depth"]["default_value"] == 2 * radius
    for height in (float(prusa["max_print_height"]), cura["machine_height"]["default_value"]):
        assert height == machine.bed.height * 1e3
    for nozzle in (float(prusa["nozzle_diameter"]), cura["machine_nozzle_size"]["default_value"]):
        assert nozzle == bore
    for filament in (float(prusa["filament_diameter"]), cura["material_diameter"]["default_value"]):
        assert filament == pytest.approx(machine.extruder.filament_diameter * 1e3, rel=1e-9)
        assert filament**2 * pi / 4 == pytest.approx(1.0, rel=1e-9)
    for speed in (float(prusa["travel_speed"]), cura["speed_travel"]["default_value"]):
        assert speed <= machine.limits.speed_max * 1e3
