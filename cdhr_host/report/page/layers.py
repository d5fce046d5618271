"""The layers of a program with their times: as its comments say, or as the clay lies."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.pipeline import Proof
from cdhr_host.report.page.trail import COLUMNS
from cdhr_host.units import MM
from cdhr_host.values import Array

LEVEL: Final = 0.05 * MM
"""m: heights nearer to each other are of one layer"""
SLOPE: Final = 1e-3
"""rise of a path that is level all the same; a spiral of 1 mm has more up to a girth of 1 m"""
FLAT: Final = 0.9
"""of the laid path that must be level for heights to make layers"""


@dataclass(frozen=True, slots=True)
class Layer:
    """A stretch of the program that lays one layer, travel included."""

    name: str
    line: int
    first: int
    """the vertex it begins with"""
    begin: float
    """s since the program's start"""
    duration: float
    """s"""
    height: float | None
    """m, the middle of the laid vertices; None where nothing is laid"""


def layers_of(rows: Array, proof: Proof) -> list[Layer]:
    """(M, 9) vertices -> its layers in order; none where neither comments nor heights tell any.

    What comes before the first layer is a layer without a height, named ``before``.
    """
    if not len(rows):
        return []
    line = rows[:, COLUMNS.index("line")]
    if proof.layers:
        first = np.searchsorted(line, [layer_line for layer_line, _ in proof.layers]).tolist()
        names, begins = [str(layer) for _, layer in proof.layers], list(proof.layer_times)
    else:
        first = _levels(rows)
        names = [str(number) for number in range(1, len(first) + 1)]
        begins = rows[first, COLUMNS.index("t")].astype(float).tolist()
    if first and begins[0] > 0.0:
        first, names, begins = [0, *first], ["before", *names], [0.0, *begins]
    return _layers(rows, names, first, [*begins, proof.duration])


def _layers(rows: Array, names: Sequence[str], first: Sequence[int], begins: Sequence[float]) -> list[Layer]:
    ends = [*first[1:], len(rows)]
    return [
        Layer(
            name,
            int(rows[min(at, len(rows) - 1), COLUMNS.index("line")]),
            at,
            begins[k],
            begins[k + 1] - begins[k],
            _height(rows[at : ends[k]]),
        )
        for k, (name, at) in enumerate(zip(names, first, strict=True))
    ]


def _height(rows: Array) -> float | None:
    laid = rows[rows[:, COLUMNS.index("flow")] > 0.0]
    return float(np.median(laid[:, 2])) if len(laid) else None


def _levels(rows: Array) -> list[int]:
    """Vertices at which clay is first laid at a new height; empty for a path that is not level."""
    laid = np.flatnonzero(rows[:, COLUMNS.index("flow")] > 0.0)
    if len(laid) < 2:
        return []
    way = np.diff(rows[laid, :3], axis=0)
    length = np.linalg.norm(way[:, :2], axis=1)
    level = np.abs(way[:, 2]) <= SLOPE * length
    if length[level].sum() < FLAT * length.sum():
        return []
    resting = laid[1:][level]
    heights = np.rint(rows[resting, 2] / LEVEL)
    return [int(laid[0]), *resting[1:][np.diff(heights) != 0].tolist()]
