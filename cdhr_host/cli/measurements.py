"""Measurements as people write them: CSV with units in the column names, every bad row at once."""

import csv
import difflib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from cdhr_host.errors import Problem, ProfileError
from cdhr_host.units import KPA, MM
from cdhr_host.values import Array

COLUMNS: Final = {
    "pressure_kpa": KPA,
    "mass_g": 1e-3,
    "time_s": 1.0,
    "t_s": 1.0,
    "density_kg_m3": 1.0,
    "speed_mm_s": MM,
    "width_mm": MM,
    "height_mm": MM,
}
"""column -> SI"""
KINDS: Final = {
    "weighings": (("pressure_kpa", "mass_g", "time_s"), ("density_kg_m3",)),
    "lines": (("pressure_kpa", "speed_mm_s", "width_mm", "height_mm"), ()),
    "steps": (("t_s", "pressure_kpa", "mass_g"), ()),
}
"""kind of table -> columns it needs, columns it may have"""
POSITIVE: Final = {"time_s", "density_kg_m3", "speed_mm_s", "height_mm"}
SIGNED: Final = {("steps", "t_s"), ("steps", "mass_g")}
MAX_ROWS: Final = 2_000_000


@dataclass(frozen=True, slots=True)
class Table:
    """One file of measurements, in SI."""

    path: Path
    kind: str
    columns: dict[str, Array]
    """name in the file -> (N,)"""


def read_measurements(path: Path) -> Table:
    """A CSV of one of KINDS, told by its columns; raises ProfileError with every problem of it.

    Commas part the columns; or semicolons, and then a comma may be the decimal sign. Lines that
    begin with # are left out.
    """
    rows = list(_rows(path))
    if not rows:
        raise _refused("missing", f"{path} has no rows", "write a line of column names first")
    names = [name.strip().lower() for name in rows[0][1]]
    kind = _kind(names, rows[0][0])
    numbers: dict[str, list[float]] = {name: [] for name in names}
    problems: list[Problem] = []
    for line, cells in rows[1:]:
        for name, value in _row(line, kind, names, cells, problems).items():
            numbers[name].append(value)
    if not problems and len(rows) == 1:
        problems.append(Problem("missing", f"no measurements below the column names of {path}"))
    if problems:
        raise ProfileError(problems)
    return Table(path, kind, {name: np.array(cells) * COLUMNS[name] for name, cells in numbers.items()})


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """(line number, cells) of every line that says something."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            text = [line for line, _ in zip(file, range(MAX_ROWS), strict=False)]
    except OSError as error:
        raise _refused("missing", f"cannot read {path}: {error.strerror}", None) from error
    except UnicodeDecodeError as error:
        raise _refused("malformed", f"{path} is not text", "save the table as CSV, UTF-8") from error
    said = [(number, line) for number, line in enumerate(text, 1) if line.strip() and line[0] != "#"]
    semicolons = bool(said) and ";" in said[0][1]
    for number, line in said:
        cells = next(csv.reader([line], delimiter=";" if semicolons else ","))
        yield number, [cell.replace(",", ".") for cell in cells] if semicolons else cells


def _kind(names: Sequence[str], line: int) -> str:
    """Which table has these columns; raises ProfileError with the nearest word."""
    for kind, (needed, optional) in KINDS.items():
        if set(needed) <= set(names) <= {*needed, *optional} and len(set(names)) == len(names):
            return kind
    unknown = [name for name in names if name not in COLUMNS]
    if unknown:
        near = difflib.get_close_matches(unknown[0], COLUMNS, n=1, cutoff=0.4)
        hint = f"did you mean '{near[0]}'?" if near else f"known columns: {', '.join(COLUMNS)}"
        raise _refused("unknown", f"unknown column '{unknown[0]}'", hint, line)
    wanted = "; ".join(f"{kind}: {', '.join(needed)}" for kind, (needed, _) in KINDS.items())
    raise _refused("unknown", f"columns {', '.join(names)} are no measurement", f"one of {wanted}", line)


def _row(
    line: int, kind: str, names: Sequence[str], cells: Sequence[str], problems: list[Problem]
) -> dict[str, float]:
    """Numbers of a row; what is wrong with it joins the problems."""
    if len(cells) != len(names):
        problems.append(Problem("malformed", f"{len(cells)} values for {len(names)} columns", line=line))
        return {}
    found = {}
    for name, cell in zip(names, map(str.strip, cells), strict=True):
        try:
            found[name] = _number(cell, name, signed=(kind, name) in SIGNED)
        except ValueError as error:
            problems.append(Problem("malformed", str(error), line=line))
    return found


def _number(cell: str, name: str, *, signed: bool) -> float:
    """A cell's number; raises ValueError saying what is wrong with it."""
    if not cell:
        raise ValueError(f"{name} is empty: fill it in or delete the row")
    try:
        value = float(cell)
    except ValueError:
        raise ValueError(f"{name} = '{cell}' is not a number") from None
    if not np.isfinite(value) or (value < 0.0 and not signed):
        raise ValueError(f"{name} = {cell} must be {'finite' if signed else 'at least 0'}")
    if value == 0.0 and name in POSITIVE:
        raise ValueError(f"{name} = {cell} must be above 0")
    return value


def _refused(kind: str, message: str, hint: str | None, line: int | None = None) -> ProfileError:
    return ProfileError(Problem(kind, message, line=line, hint=hint))
