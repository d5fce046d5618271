"""What measured points say about the geometry, what they leave open, and where to measure next."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import qr, solve_triangular

from cdhr_host.mechanism.cables import Cables
from cdhr_host.mechanism.calibration_model import NAMES, Doubts, Frame, slopes
from cdhr_host.values import Array, Ints

PART: Final = 0.05
"""of the largest component, in doubts, that makes a parameter part of a direction"""


@dataclass(frozen=True, slots=True)
class Direction:
    """A combination of parameters about which the points say less than the drawing does."""

    parts: tuple[tuple[str, float], ...]
    """names and how far they move together, m or rad, in units of the first"""
    strength: float
    """what the points add, as a share of what the drawing says: 0 is nothing"""

    def words(self) -> str:
        """``attachment 1 x with pulley 1 x``: signs where they differ."""
        rest = [f"{name} x {ratio:+.2g}" if abs(ratio - 1.0) > 0.05 else name for name, ratio in self.parts]
        return " with ".join(rest)


def unobservable(information: Array, doubts: Doubts) -> list[Direction]:
    """(SIZE, SIZE) information in doubts -> directions weaker than the drawing, by an SVD of it.

    The null space has no basis of its own; the one given has as few parameters in each
    direction as a reduced echelon form finds.
    """
    each = doubts.each()
    free = np.flatnonzero(each > 0.0)
    strength, ways = np.linalg.eigh(information[np.ix_(free, free)])
    weak = ways[:, strength < 1.0].T
    if not len(weak):
        return []
    _, triangle, order = qr(weak, mode="economic", pivoting=True)
    count = len(weak)
    basis = np.zeros_like(weak)
    basis[:, order[:count]] = np.eye(count)
    basis[:, order[count:]] = solve_triangular(triangle[:, :count], triangle[:, count:])
    return [_direction(row, free, each, information) for row in basis]


def _direction(row: Array, free: Ints, each: Array, information: Array) -> Direction:
    whole = np.zeros(len(each))
    whole[free] = row / np.linalg.norm(row)
    told = float(whole @ information @ whole)
    order = [k for k in np.argsort(-np.abs(whole)) if abs(whole[k]) > PART * np.abs(whole).max()]
    first = whole[order[0]] * each[order[0]]
    parts = tuple((NAMES[k], float(whole[k] * each[k] / first)) for k in order)
    return Direction(parts, max(told, 0.0))


def learned(information: Array, doubts: Doubts) -> Array:
    """(SIZE, SIZE) -> (SIZE,) from 0 to 1: how much of each parameter's doubt the points take away."""
    left = np.diag(np.linalg.inv(information + np.eye(len(information))))
    return np.asarray(np.where(doubts.each() > 0.0, 1.0 - np.sqrt(left), 1.0))


def information_of(cables: Cables, frame: Frame, doubts: Doubts, slider: Array, noise: float) -> Array:
    """(N, 3) m of sliders 1-3 -> (N, SIZE, SIZE): what a point measured there says, in doubts."""
    each = doubts.each()
    _, by = slopes(cables, frame, np.zeros(len(each)), slider)
    rows = by * (each / noise)
    return np.asarray(np.einsum("nik,nil->nkl", rows, rows))


def best_poses(
    cables: Cables,
    doubts: Doubts,
    candidates: Array,
    count: int,
    noise: float,
    *,
    frame: Frame | None = None,
    known: Array | None = None,
) -> Ints:
    """(N, 3) m of sliders 1-3 that could be visited -> (count,) the most telling ones, most telling first.

    Greedy, D-optimal: each next pose makes the determinant of the information, the drawing's and
    ``known`` (SIZE, SIZE) included, as large as one pose can.
    """
    each = doubts.each()
    _, by = slopes(cables, frame or Frame.same(), np.zeros(len(each)), candidates)
    rows = by * (each / noise)
    inverse = np.linalg.inv(np.eye(len(each)) + (0.0 if known is None else known))
    picked: list[int] = []
    for _ in range(min(count, len(candidates))):
        gain = np.linalg.slogdet(np.eye(3) + np.einsum("nik,kl,njl->nij", rows, inverse, rows))[1]
        gain[picked] = -np.inf
        best = int(np.argmax(gain))
        picked.append(best)
        seen = rows[best] @ inverse
        inverse = inverse - seen.T @ np.linalg.solve(np.eye(3) + seen @ rows[best].T, seen)
    return np.array(picked, dtype=np.int64)


def in_turn(places: Array, start: Array) -> Ints:
    """(N, 3), (3,) m -> (N,) the order in which each next place is the nearest: a short way round."""
    left, at, order = list(range(len(places))), start, list[int]()
    while left:
        nearest = min(left, key=lambda k: float(np.linalg.norm(places[k] - at)))
        left.remove(nearest)
        order.append(nearest)
        at = places[nearest]
    return np.array(order, dtype=np.int64)
