"""What a leg never exceeds, at any instant: bounds in continuous time, not samples.

On each piece of the time law s', s'' and s''' are bounded by their values at its ends, and
on the path pieces it runs over |q''|, |q'''| and their parts along the path are (motion.budget).
Where a law has short pieces (motion.hastened) these are bounded together (motion.closely).
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.budget import Bends
from cdhr_host.motion.closely import close_bounds, overlapped
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
    pieces, (_, _, change, jerk) = leg.law.pieces, leg.law.state
    rate = pieces.fastest()
    harshest = np.maximum(np.abs(change), np.abs(change + pieces.lasting * jerk))
    rows = overlapped(leg.path.start, *pieces.reached)
    bends = Bends(*(_largest(row, rows) for row in leg.bends.rows))
    segment = leg.path.segment
    steep, clay = leg.path.steep, leg.segments.clay[segment]
    acceleration = bends.acceleration(rate, harshest)
    jerks = bends.jerk(rate, harshest, np.abs(jerk))
    close = np.flatnonzero(leg.law.close)
    if len(close):
        acceleration[close], jerks[close] = close_bounds(leg.path, pieces.only(close))
    flow = rate * _largest(clay * steep, rows)
    return LegBounds(
        float((rate * _largest(steep, rows)).max()),
        float((rate * _largest(steep / leg.segments.feed[segment], rows)).max()),
        float(acceleration.max()),
        float(jerks.max()),
        float(flow.max()),
        float(leg.segments.air.max()),
    )


def _largest(values: Array, rows: Ints) -> Array:
    """Greatest value over each pair of rows."""
    padded = np.append(values, -np.inf)
    found: Array = np.maximum.reduceat(padded, rows)[::2]
    return found
