"""What a leg never exceeds, at any instant: bounds in continuous time, not samples.

On each piece of the time law s', s'' and s''' are bounded by their values at its ends, and
on the path pieces it runs over |q''|, |q'''| and their parts along the path are (motion.budget).
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.budget import Bends
from cdhr_host.motion.leg import Leg
from cdhr_host.values import Array, Ints


@dataclass(frozen=True, slots=True)
class LegBounds:
    """Greatest values over a whole leg."""

    speed: float
    """m/s"""
    over_feed: float
    """greatest ratio of the speed to the programmed one"""
    acceleration: float
    """m/s²"""
    jerk: float
    """m/s³"""
    flow: float
    """m³/s"""
    air: float
    """Pa held by air words"""


def leg_bounds(leg: Leg) -> LegBounds:
    """Bounds of a leg, from its time law and path alone."""
    start, speed, change, jerk = leg.law.state
    after = np.diff(leg.law.t, append=leg.law.duration)
    rate = np.maximum(speed, speed + after * (change + after * jerk / 2))
    harshest = np.maximum(np.abs(change), np.abs(change + after * jerk))
    reached = np.clip((start, np.append(start[1:], leg.law.end)), *leg.law.within)
    rows = _overlapped(leg.path.start, *reached)
    bends = Bends(*(_largest(row, rows) for row in leg.bends.rows))
    segment = leg.path.segment
    steep, clay = leg.path.steep, leg.segments.clay[segment]
    acceleration = bends.acceleration(rate, harshest)
    jerks = bends.jerk(rate, harshest, np.abs(jerk))
    flow = rate * _largest(clay * steep, rows)
    return LegBounds(
        float((rate * _largest(steep, rows)).max()),
        float((rate * _largest(steep / leg.segments.feed[segment], rows)).max()),
        float(acceleration.max()),
        float(jerks.max()),
        float(flow.max()),
        float(leg.segments.air.max()),
    )


def _overlapped(pieces: Array, start: Array, end: Array) -> Ints:
    """(2 K,) first path piece of each stretch of s, and the one after its last, in turn."""
    first = np.maximum(np.searchsorted(pieces, start, side="right") - 1, 0)
    last = np.maximum(np.searchsorted(pieces, end, side="left"), first + 1)
    return np.column_stack((first, last)).ravel()


def _largest(values: Array, rows: Ints) -> Array:
    """Greatest value over each pair of rows."""
    padded = np.append(values, -np.inf)
    found: Array = np.maximum.reduceat(padded, rows)[::2]
    return found
