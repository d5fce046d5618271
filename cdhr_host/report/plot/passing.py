"""One pass through a log: envelopes of its columns, the path, the extremes; memory stays flat."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from cdhr_host.profile import Profile
from cdhr_host.report.plot.deriving import Deriver, Stencil, Table, widened
from cdhr_host.report.plot.envelope import Envelope
from cdhr_host.report.reading import Event, LogFile, LogFileError
from cdhr_host.report.thinning import Thinner
from cdhr_host.values import Array, Flags

PLACES_MM: Final = 0.05
"""mm a drawn path may be off to begin with"""
SHADE: Final = 0.01
"""of a usual range, that a drawn colour may be off to begin with"""
SCALES: Final = {"speed_mm_s": 50.0, "tension": 5.0, "pressure_kpa": 100.0, "margin": 1.0}
"""usual ranges of what colours show"""
PATH: Final = ("x_mm", "y_mm", "z_mm", *SCALES, "flow")
"""columns of the path's vertices; ``tension`` is the greatest of the six, ``flow`` whether clay is laid"""
VERTICES: Final = 30_000

Extreme = tuple[float, float, int, float, float, int]
"""least, its t in s and line, greatest, its t and line"""


@dataclass(frozen=True, slots=True)
class Choice:
    """The rows to draw; all where nothing is chosen."""

    begin: float = -np.inf
    """s"""
    end: float = np.inf
    lines: tuple[float, float] = (-np.inf, np.inf)

    def of(self, table: Table) -> Flags:
        """(N,)"""
        t, line = table["t_s"], table["line"]
        first, last = self.lines
        return np.asarray((t >= self.begin) & (t <= self.end) & (line >= first) & (line <= last))


@dataclass(frozen=True, slots=True)
class Drawn:
    """What the pictures are drawn from."""

    path: Path
    program: str
    profile: Profile | None
    events: tuple[Event, ...]
    stencil: Stencil
    rows: int
    span: int
    """rows in each interval of the envelopes"""
    low: Table
    """(B,) of every column, the least in each interval"""
    high: Table
    vertices: Table
    """of PATH"""
    extremes: dict[str, Extreme] = field(default_factory=dict)

    def __contains__(self, name: str) -> bool:
        return name in self.low and bool(np.isfinite(self.low[name]).any())

    @property
    def times(self) -> tuple[float, float]:
        """s: of the first and the last row."""
        return float(self.low["t_s"][0]), float(self.high["t_s"][-1])


def drawn(
    log: LogFile,
    machine: Profile | None,
    choice: Choice,
    told: Callable[[int, float], None] = lambda _rows, _t: None,
) -> Drawn:
    """Pass through a log; ``told`` hears how many rows were read and where they are, s.

    Raises LogFileError where no row is chosen, OSError where the log cannot be read.
    """
    stencil = Stencil.of(log, _period(log))
    deriver, envelope, extremes = Deriver(stencil, machine), Envelope(), _Extremes()
    thinner = Thinner(_scale(), lambda rows: rows[:, -1] > 0.0, VERTICES)
    table, read, rows = Table(log.names, np.zeros((0, len(log.names)))), 0, 0
    for block in widened(log.blocks(), stencil.margin):
        table = deriver.derived(Table(log.names, block))
        read += len(table.rows)
        kept = Table(table.names, table.rows[choice.of(table)])
        rows += len(kept.rows)
        if len(kept.rows):
            envelope.add(kept.rows)
            extremes.add(kept)
            thinner.add(_vertices(kept))
        told(read, float(table["t_s"][-1]))
    if not rows:
        raise LogFileError("it has no rows" if not read else "none of its rows is in what was asked for")
    low, high = (Table(table.names, part) for part in envelope.extremes())
    vertices = Table(PATH, thinner.vertices())
    source = log.path, log.program, machine, log.events, stencil, rows, envelope.span
    return Drawn(*source, low, high, vertices, extremes.found)


def _period(log: LogFile) -> float:
    """s between the first two rows."""
    for block in log.blocks():
        if len(block) > 1:
            t = block[:2, log.names.index("t_s")]
            return float(t[1] - t[0])
    raise LogFileError("it has fewer than two rows")


def _scale() -> Array:
    shades = [SHADE * usual for usual in SCALES.values()]
    return np.array([PLACES_MM, PLACES_MM, PLACES_MM, *shades, 0.0])


def _vertices(table: Table) -> Array:
    """(N, len(PATH)); what a log does not tell is NaN-free zero."""
    return np.column_stack([*_vertex_columns(table)])


def _vertex_columns(table: Table) -> Iterator[Array]:
    yield from (table[name] for name in ("x_mm", "y_mm", "z_mm"))
    yield np.nan_to_num(table["speed_mm_s"])
    none = np.zeros(len(table.rows))
    yield table.columns([f"tension{i}_n" for i in range(1, 7)]).max(axis=1) if "tension1_n" in table else none
    yield table["pressure_kpa"]
    yield table.get("margin", none)
    yield (table.get("flow_mm3_s", table["pressure_kpa"]) > 0.0).astype(np.float64)


class _Extremes:
    """Least and greatest of every column, with their times and lines."""

    def __init__(self) -> None:
        self.found: dict[str, Extreme] = {}

    def add(self, table: Table) -> None:
        t, line = table["t_s"], table["line"]
        for name in table.names:
            values = table[name]
            if name not in {"t_s", "line"} and np.isfinite(values).any():
                at = int(np.nanargmin(values)), int(np.nanargmax(values))
                parts = [(float(values[k]), float(t[k]), int(line[k])) for k in at]
                known = self.found.get(name, (*parts[0], *parts[1]))
                low, high = min(known[:3], parts[0]), max(known[3:], parts[1], key=lambda part: part[0])
                self.found[name] = (*low, *high)
