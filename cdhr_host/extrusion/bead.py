"""What was laid against what was wanted, bead by bead and millimetre by millimetre of path."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.units import MM
from cdhr_host.values import Array, Ints

TRAVEL: Final = 0.5 * MM
"""m of path without clay that end a bead; a rest does not"""
ENDS: Final = 5.0 * MM
"""m at a bead's start and end in which clay is late or early"""
MEETS: Final = 1.0 * MM
"""m between start and end of a bead that closes a ring"""


@dataclass(frozen=True, slots=True)
class Bead:
    """One bead, as planned and as it came out."""

    line: int
    """where it begins"""
    length: float
    """m"""
    planned: float
    """m³"""
    laid: float
    """m³ from its start to the next one's"""
    least: float
    """clay on a millimetre of path, of what was planned there"""
    most: float
    start_late: float
    """m by which the clay comes late; negative is early"""
    end_late: float
    """m by which it ends late"""
    seam: float | None
    """clay on the last and first millimetre, of what was planned there, where the end meets the start"""


def beads(line: Ints, nozzle_G: Array, flow: Array, deposited: Array, period: float) -> list[Bead]:
    """(N,), (N, 3) m, (N,) m³/s planned, (N,) m³/s laid, s -> the beads of consecutive ticks."""
    steps = np.linalg.norm(np.diff(nozzle_G, axis=0, prepend=nozzle_G[:1]), axis=1)
    way = np.cumsum(steps)
    clay = np.flatnonzero((flow > 0.0) & (steps > 0.0))
    if not len(clay):
        return []
    apart = np.flatnonzero(np.diff(way[clay]) > TRAVEL + steps[clay[1:]])
    firsts, lasts = clay[np.concatenate(([0], apart + 1))], clay[np.append(apart, len(clay) - 1)]
    untils = np.append(firsts[1:], len(flow))
    begins = [0, *((lasts[:-1] + firsts[1:]) // 2).tolist()]
    spans = zip(begins, firsts.tolist(), lasts.tolist(), [*begins[1:], int(untils[-1])], strict=True)
    return [
        _bead(int(line[first]), way, nozzle_G, np.stack((flow, deposited)) * period, (a, first, last, b))
        for a, first, last, b in spans
    ]


def _bead(line: int, way: Array, nozzle_G: Array, volume: Array, span: tuple[int, int, int, int]) -> Bead:
    """``volume`` (2, N) m³ planned and laid; rows from, first, last, until."""
    begin, first, last, until = span
    start = way[max(first - 1, 0)]
    length = float(way[last] - start)
    planned, laid = volume[:, begin:until].sum(axis=1).tolist()
    rows = slice(begin, until)
    place = np.clip(way[rows] - start, 0.0, length)
    a_metre, share = planned / length, _shares(place, volume[:, rows], length)
    head = _missing(volume[:, rows], place <= ENDS)
    tail = -_missing(volume[:, rows], place >= length - ENDS)
    meets = length > ENDS and np.linalg.norm(nozzle_G[last] - nozzle_G[max(first - 1, 0)]) < MEETS
    seam = _share_of(volume[:, rows], (place <= MM) | (place >= length - MM)) if meets else None
    return Bead(line, length, planned, laid, *share, head / a_metre, tail / a_metre, seam)


def _shares(place: Array, volume: Array, length: float) -> tuple[float, float]:
    """Least and greatest clay of a whole millimetre, of what was planned there."""
    count = max(int(length / MM + 1e-6), 1)
    at = np.minimum((place / MM).astype(int), count - 1)
    planned, laid = (np.bincount(at, each, count) for each in volume)
    share = laid / planned
    return float(share.min()), float(share.max())


def _missing(volume: Array, rows: Array) -> float:
    planned, laid = volume[:, rows].sum(axis=1)
    return float(planned - laid)


def _share_of(volume: Array, rows: Array) -> float:
    planned, laid = volume[:, rows].sum(axis=1)
    return float(laid / planned)
