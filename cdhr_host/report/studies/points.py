"""Measured nozzle points as people write them: CSV, every bad row at once."""

import csv
import difflib
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from cdhr_host.errors import Problem, ProfileError
from cdhr_host.mechanism.calibration import Points
from cdhr_host.units import MM
from cdhr_host.values import Array

SLIDERS: Final = ("slider1_mm", "slider2_mm", "slider3_mm")
PLACES: Final = ("x_mm", "y_mm", "z_mm")
UNUSED: Final = ("slider4_mm", "slider5_mm", "slider6_mm")
"""the nozzle does not feel the upper platform's sliders"""
KNOWN: Final = (*SLIDERS, *PLACES, *UNUSED)


def read_points(path: Path) -> tuple[Points, list[int]]:
    """Points in SI and the line of each; raises ProfileError with every problem of the file.

    Columns are told by name: sliders 1-3, and those of x, y, z that were measured. An empty cell is
    a coordinate that was not; a row without any is not a point yet and is left out.
    """
    rows = list(_rows(path))
    if not rows:
        raise ProfileError(Problem("missing", f"{path} is empty", hint="cdhr calibrate plan writes a table"))
    names = [cell.strip().lower() for cell in rows[0][1]]
    _check(names, rows[0][0])
    problems: list[Problem] = []
    found = [(line, _numbers(line, names, cells, problems)) for line, cells in rows[1:]]
    if problems:
        raise ProfileError(problems)
    measured = [(line, row) for line, row in found if any(not math.isnan(row[name]) for name in PLACES)]
    if not measured:
        raise ProfileError(
            Problem("missing", f"no measured point in {path}", hint="fill in x_mm, y_mm, z_mm of some rows")
        )
    columns = [_columns([row for _, row in measured], keys) for keys in (SLIDERS, PLACES)]
    return Points(*columns), [line for line, _ in measured]


def _columns(rows: Sequence[dict[str, float]], names: Sequence[str]) -> Array:
    return MM * np.array([[row[name] for name in names] for row in rows])


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """(line number, cells) of every line that says something."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ProfileError(Problem("missing", f"cannot read {path}: {error.strerror}")) from error
    except UnicodeDecodeError as error:
        raise ProfileError(
            Problem("malformed", f"{path} is not text", hint="save the table as CSV, UTF-8")
        ) from error
    said = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip(" ,;") and line[0] != "#"]
    semicolons = bool(said) and ";" in said[0][1]
    for number, line in said:
        cells = next(csv.reader([line], delimiter=";" if semicolons else ","))
        yield number, [cell.replace(",", ".") for cell in cells] if semicolons else cells


def _check(names: Sequence[str], line: int) -> None:
    for name in names:
        if name not in KNOWN:
            near = difflib.get_close_matches(name, KNOWN, n=1, cutoff=0.4)
            hint = f"did you mean '{near[0]}'?" if near else f"known columns: {', '.join(KNOWN)}"
            raise ProfileError(Problem("unknown", f"unknown column '{name}'", line=line, hint=hint))
    missing = [name for name in SLIDERS if name not in names]
    if missing or len(set(names)) < len(names) or not set(PLACES) & set(names):
        raise ProfileError(
            Problem(
                "missing",
                f"columns {', '.join(names)} are no measured points",
                line=line,
                hint=f"{', '.join(SLIDERS)} once each, and those of {', '.join(PLACES)} that were measured",
            )
        )


def _numbers(
    line: int, names: Sequence[str], cells: Sequence[str], problems: list[Problem]
) -> dict[str, float]:
    """A row by name, NaN where it says nothing; what is wrong with it joins the problems."""
    row = dict.fromkeys(KNOWN, math.nan)
    if len(cells) != len(names):
        problems.append(Problem("malformed", f"{len(cells)} values for {len(names)} columns", line=line))
        return row
    for name, cell in zip(names, map(str.strip, cells), strict=True):
        try:
            row[name] = float(cell) if cell else math.nan
        except ValueError:
            problems.append(Problem("malformed", f"{name} = '{cell}' is not a number", line=line))
            continue
        if math.isinf(row[name]) or (not cell and name in SLIDERS) or (cell and math.isnan(row[name])):
            problems.append(Problem("malformed", f"{name} = '{cell}' must be a finite number", line=line))
    return row
