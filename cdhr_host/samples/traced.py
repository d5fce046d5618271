"""A motion law p(t) as a program: dense straight moves, each with the speed that keeps its time."""

from collections.abc import Iterator

import numpy as np

from cdhr_host.samples.words import DECIMALS, word, words
from cdhr_host.units import MINUTE, MM
from cdhr_host.values import Array

LEAST_MM = 0.05
"""no move is shorter, so that the rounding of its ends does not bend the path"""
TRAVEL_SPEED = 20 * MM
"""m/s to where the law begins"""


def _thinned(t: Array, position_mm: Array) -> Iterator[tuple[float, Array]]:
    """(time taken, end) of each move; samples too near to the last one are passed over."""
    began, last = t[0], position_mm[0]
    for now, place in zip(t[1:], position_mm[1:], strict=True):
        if np.linalg.norm(place - last) >= LEAST_MM:
            yield now - began, place
            began, last = now, place


def traced(t: Array, position_G: Array) -> Iterator[str]:
    """(N,), (N, 3) -> lines of the program: from the reference to the first place, then p(t)."""
    position_mm = np.round(position_G / MM, DECIMALS) + 0.0
    first = position_mm[0]
    yield "G21 ; millimetres"
    yield "G90 ; absolute"
    if np.any(first):
        yield f"G0 {_place(first)} {words(F=TRAVEL_SPEED / MM * MINUTE)}"
    last = first
    for duration, place in _thinned(t, position_mm):
        speed = float(np.linalg.norm(place - last)) / duration * MINUTE
        yield f"G1 {_place(place)} {words(F=speed)}"
        last = place
    yield "M400 ; come to rest"


def _place(mm: Array) -> str:
    return " ".join(word(axis, value) for axis, value in zip("XYZ", mm.tolist(), strict=True))
