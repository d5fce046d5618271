"""Sliders along a leg's path as cubics between places of it, near enough that no drive can tell.

A slider's place is a smooth function of the nozzle's, and the path a cubic spline q(s). So the
place f(s) has four derivatives on each piece of the path, and over an interval of length w the
cubic that has its values and slopes at both ends (Hermite's) is within w⁴/384 max|f''''| of it.
With |q'| <= 1 the chain rule gives

    |f''''| <= L4 + 6 L3 |q''| + L2 (3 |q''|² + 4 |q'''|),

where L2, L3 and L4 bound the sliders' derivatives along straight lines. Pieces of the path are
divided until that is below NEAR.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.budget import Bends
from cdhr_host.motion.leg import Leg
from cdhr_host.pipeline.rig import Rig
from cdhr_host.values import Array

NEAR = 1e-9
"""m, by which the cubics may leave the sliders' places"""


@dataclass(frozen=True, slots=True)
class Turns:
    """Bounds of the sliders' derivatives along straight lines over the bed."""

    second: float
    """1/m"""
    third: float
    """1/m²"""
    fourth: float
    """1/m³"""

    @classmethod
    def of(cls, rig: Rig) -> "Turns":
        """Of cables whose l'' is at most g and l''' at most 6 g², as ``motion.limits`` has them.

        The upper platform's way adds its own. The fourth grows over the third by no more than
        the third over the second; ``tests/pipeline/test_way.py`` looks for anything steeper.
        """
        g, upper = rig.bend, rig.upper
        second = g * upper.slope**2 + upper.bend
        third = 6.0 * g**2 * upper.slope**3 + 3.0 * g * upper.slope * upper.bend + upper.twist
        return cls(second, third, third**2 / second)

    def along(self, bends: Bends) -> Array:
        """(K,) 1/m³: bound of |f''''| on each piece of a path."""
        bent, harder = bends.second, bends.third
        turning = 6.0 * self.third * bent + self.second * (3.0 * bent**2 + 4.0 * harder)
        return np.asarray(self.fourth + turning, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Way:
    """Sliders at M places along a leg, from where its law begins to where it ends."""

    s: Array
    """(M,) m, ascending"""
    slider: Array
    """(M, 6) m"""
    slope: Array
    """(M, 6) their change for each metre of s"""


def places(leg: Leg, turns: Turns) -> Array:
    """(M,) m: places so near to each other that the cubics between them are good.

    Where q' jumps, at the ends of corners with gears, there are two: each cubic has the slope on its side.
    """
    start, (first, last) = leg.path.start, (leg.law.within[0, 0], leg.law.within[1, -1])
    inside = slice(
        max(int(np.searchsorted(start, first, side="right")) - 1, 0),
        int(np.searchsorted(start, last, side="left")),
    )
    borders = np.append(start[inside], last)
    borders[0] = first
    widths = np.diff(borders)
    asked = np.ceil(widths * (turns.along(leg.bends)[inside] / (384.0 * NEAR)) ** 0.25)
    count = np.maximum(asked, 1.0).astype(np.int64)
    whole = np.repeat(np.arange(len(count)), count)
    part = np.arange(len(whole)) - (np.cumsum(count) - count)[whole]
    even = borders[whole] + part * (widths / count)[whole]
    gear = leg.path.gear[:, inside]
    jumps = borders[1:-1][(np.diff(gear, axis=1) != 0.0).any(axis=0)]
    return np.sort(np.concatenate((even, np.nextafter(jumps, -np.inf), [last])))


def way(rig: Rig, leg: Leg, s: Array) -> Way:
    """Sliders at the places (M,) m; raises MotionError out of reach."""
    _, position_G, slope, _ = leg.path.at(s)
    return Way(s, *rig.slider_motion(position_G, slope))
