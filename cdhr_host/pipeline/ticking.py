"""Nozzle and sliders of a leg at every tick, in one compiled loop.

Loading the compiler and what it kept takes half a second, so only who writes a log of many ticks
comes here. What is compiled is kept beside this file, or in the user's cache where this file's
folder cannot be written.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ParamSpec, TypeVar

import numpy as np
from numba import njit

from cdhr_host.motion.leg import Leg
from cdhr_host.pipeline.way import Way
from cdhr_host.values import Array, Ints

P = ParamSpec("P")
R = TypeVar("R")


def _compiling(fastmath: bool | set[str]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A decorator that compiles a function for the types it is called with, and keeps the code if it can."""

    def compiled(function: Callable[P, R]) -> Callable[P, R]:
        made: Callable[P, R]
        try:
            made = njit(cache=True, error_model="numpy", fastmath=fastmath)(function)
        except RuntimeError:  # no folder to keep it in: compiled anew in every process
            made = njit(error_model="numpy", fastmath=fastmath)(function)
        return made

    return compiled


exact = _compiling(False)
fused = _compiling({"contract", "arcp"})
"""With products added unrounded, and divisions by one number as products: some 1e-16 m of difference."""


@dataclass(frozen=True, slots=True)
class Ticked:
    """A leg at N instants; the vectors are by component."""

    segment: Ints
    """(N,) drawn segment"""
    speed: Array
    """(N,) m/s, of the nozzle"""
    nozzle_G: Array
    """(3, N) m"""
    slider: Array
    """(6, N) m"""


def ticked(leg: Leg, way: Way, t: Array) -> Ticked:
    """(N,) s since the leg began, ascending -> what nozzle and sliders do then."""
    law, path, count = leg.law, leg.path, len(t)
    piece, rows = np.empty(count, dtype=np.int64), np.empty((10, count))
    _tick(
        (law.t, law.state, law.within),
        (path.start, path.coefficients),
        (way.s, way.slider, way.slope),
        t,
        (piece, rows),
    )
    return Ticked(path.segment[piece], rows[0], rows[1:4], rows[4:])


@exact
def _tick(
    law: tuple[Array, Array, Array],
    path: tuple[Array, Array],
    way: tuple[Array, Array, Array],
    t: Array,
    out: tuple[Ints, Array],
) -> None:
    """Fill in the path's piece (N,), and speed, nozzle and sliders (10, N)."""
    (begins, state, within), (starts, cubics), (places, slider, slope), (pieces, rows) = law, path, way, out
    k = np.searchsorted(begins, t[0], side="right") - 1
    piece = interval = -1
    for n in range(len(t)):
        k = _onward(begins, k, len(begins) - 1, t[n])
        x, a, j = t[n] - begins[k], state[2, k], state[3, k]
        s = state[0, k] + x * (state[1, k] + x * (a / 2 + x * (j / 6)))
        s = min(max(s, within[0, k]), within[1, k])
        if n == 0:
            piece = max(np.searchsorted(starts, s, side="right") - 1, 0)
            interval = max(np.searchsorted(places, s, side="right") - 1, 0)
        piece = _onward(starts, piece, len(starts) - 1, s)
        interval = _onward(places, interval, len(places) - 2, s)
        pieces[n] = piece
        rate = state[1, k] + x * (a + x * (j / 2))
        rows[0, n] = rate * _nozzle(cubics, piece, s - starts[piece], rows[1:4, n])
        both, away = slice(interval, interval + 2), (s - places[interval], places[interval + 1] - s)
        _sliders(slider[both], slope[both], away, rows[4:, n])


@exact
def _onward(borders: Array, k: int, last: int, x: float) -> int:
    """The interval that holds x, not before the k-th."""
    while k < last and borders[k + 1] <= x:
        k += 1
    return k


@exact
def _nozzle(cubics: Array, piece: int, x: float, place: Array) -> float:
    """Fill in the nozzle's place (3,) as ``SmoothPath.at`` has it; |q'|."""
    square = 0.0
    for i in range(3):
        c0, c1, c2, c3 = cubics[0, i, piece], cubics[1, i, piece], cubics[2, i, piece], cubics[3, i, piece]
        place[i] = c0 + x * (c1 + x * (c2 / 2 + x * (c3 / 6)))
        square += (c1 + x * (c2 + x * (c3 / 2))) ** 2
    return math.sqrt(square)


@fused
def _sliders(slider: Array, slope: Array, away: tuple[float, float], place: Array) -> None:
    """Fill in (6,) from rows (2, 6) before and after, which are ``away``: Hermite's cubic."""
    width = away[0] + away[1]
    before, after = away[1] / width, away[0] / width
    rise, fall = before * before * away[0], after * after * away[1]
    weight = after * after * (1.0 + 2.0 * before)
    for i in range(6):
        way = slider[1, i] - slider[0, i]
        place[i] = slider[0, i] + weight * way + rise * slope[0, i] - fall * slope[1, i]
