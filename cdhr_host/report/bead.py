"""The beads of a run's log, for people and for machines."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdhr_host.extrusion.bead import Bead, beads
from cdhr_host.report.reading import LogFile, LogFileError
from cdhr_host.units import MM, MM3

COLUMNS: Final = ("t_s", "line", "x_mm", "y_mm", "z_mm", "flow_mm3_s", "deposited_mm3_s")
SHOWN: Final = 40
"""beads listed for a person"""


def laid_beads(path: Path) -> list[Bead]:
    """The beads of a log; raises LogFileError where it does not know what was deposited."""
    log = LogFile.opened(path)
    missing = [name for name in COLUMNS if name not in log.names]
    if missing:
        raise LogFileError(
            f"it has no column {missing[0]}: cdhr stream --log writes what the simulated clay does"
        )
    columns = [log.names.index(name) for name in COLUMNS]
    rows = np.concatenate([block[:, columns] for block in log.blocks()])
    if len(rows) < 2 or np.isnan(rows[:, -1]).any():
        raise LogFileError("nobody knows what was deposited: only loopback: and cdhr sim simulate the clay")
    t, line, flow, deposited = rows[:, 0], rows[:, 1].astype(np.int64), rows[:, 5], rows[:, 6]
    return beads(line, rows[:, 2:5] * MM, flow * MM3, deposited * MM3, float(t[1] - t[0]))


def bead_records(found: Sequence[Bead]) -> list[dict[str, Any]]:
    """JSON of beads."""
    return [
        {
            "line": bead.line,
            "length_mm": bead.length / MM,
            "planned_mm3": bead.planned / MM3,
            "laid_mm3": bead.laid / MM3,
            "least": bead.least,
            "most": bead.most,
            "start_late_mm": bead.start_late / MM,
            "end_late_mm": bead.end_late / MM,
            "seam": bead.seam,
        }
        for bead in found
    ]


def bead_lines(found: Sequence[Bead]) -> Iterator[str]:
    """A table; where there are many, of the worst."""
    head = ("line", "length mm", "wanted mm³", "laid mm³", "on each mm %", "start mm", "end mm", "seam %")
    worst = sorted(found, key=lambda bead: min(bead.least, 2.0 - bead.most))[:SHOWN]
    rows = [_row(bead) for bead in (found if len(found) <= SHOWN else worst)]
    for row in (head, *rows):
        yield "".join(f"{text:>14}" for text in row).rstrip()
    least, most = min(bead.least for bead in found), max(bead.most for bead in found)
    yield f"{len(found)} beads: {100 * least:.1f} to {100 * most:.1f} % of the clay wanted on each millimetre"


def _row(bead: Bead) -> tuple[str, ...]:
    return (
        str(bead.line),
        f"{bead.length / MM:.1f}",
        f"{bead.planned / MM3:.1f}",
        f"{bead.laid / MM3:.1f}",
        f"{100 * bead.least:.1f}-{100 * bead.most:.1f}",
        f"{bead.start_late / MM:+.2f}",
        f"{bead.end_late / MM:+.2f}",
        "" if bead.seam is None else f"{100 * bead.seam:.1f}",
    )
