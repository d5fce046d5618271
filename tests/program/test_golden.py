"""Programs with the commands they must give, and programs with the error they must give.

``tests/golden/NAME.gcode`` gives the lines of ``NAME.commands``; the first line of
``tests/golden/bad/NAME.gcode`` is its only problem: ``; line:column: message | hint``.
"""

from pathlib import Path

import pytest
from program_reading import ROOT, only_problem, read, shown

GOLDEN = ROOT / "tests" / "golden"
PROGRAMS = sorted(path for path in GOLDEN.glob("*.gcode") if path.with_suffix(".commands").exists())
BAD = sorted((GOLDEN / "bad").glob("*.gcode"))


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_commands(path: Path) -> None:
    expected = path.with_suffix(".commands").read_text(encoding="utf-8").splitlines()
    assert shown(read(path.read_bytes())) == expected


@pytest.mark.parametrize("path", BAD, ids=lambda path: path.stem)
def test_errors(path: Path) -> None:
    problem = only_problem(path.read_bytes())
    first = path.read_text(encoding="utf-8").splitlines()[0]
    assert f"; {problem.line}:{problem.column}: {problem.message} | {problem.hint}" == first


def test_the_folders_are_not_empty() -> None:
    assert len(PROGRAMS) >= 7
    assert len(BAD) >= 20
