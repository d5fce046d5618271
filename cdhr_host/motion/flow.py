"""What the air can push: bounds on the flow of clay and on how fast it changes, as bounds on speed.

With c (m³/m) of clay along the path the flow is c s', and it changes at c s''. A greatest flow
is a greatest s' where clay is laid; a greatest change of flow a smaller share of the nozzle's
acceleration and jerk there. Where clay begins, ends or changes its width the flow would jump,
so the nozzle rests there.
"""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cdhr_host.values import Array, Flags

SAME: Final = 0.05
"""of the clay per metre: a change up to this needs no rest"""


def _none() -> Array:
    return np.array([np.inf])


@dataclass(frozen=True, slots=True, eq=False)
class FlowLimits:
    """Of one clay and its air; without arguments nothing is bounded."""

    greatest: float = math.inf
    """m³/s"""
    flow: Array = field(default_factory=lambda: np.zeros(1))
    """(M,) m³/s, ascending"""
    change: Array = field(default_factory=_none)
    """(M,) m³/s², the greatest change of flow on the way to each of these and back to rest"""
    steepness: float = math.inf
    """1/s: the change of that change, over it, with which these were found"""
    rests: bool = False
    """whether the nozzle rests where the clay per metre changes"""

    def feed(self, feed: Array, clay: Array) -> Array:
        """(M,) m/s wanted, (M,) m³/m -> (M,) m/s that the air can push."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.minimum(feed, np.where(clay > 0.0, self.greatest / clay, np.inf)))

    def share(self, feed: Array, clay: Array, acceleration: float) -> Array:
        """(M,) of the acceleration m/s², and of the jerk, that segments run at ``feed`` may use."""
        allowed = np.interp(clay * feed, self.flow, self.change)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.minimum(1.0, np.where(clay > 0.0, allowed / (clay * acceleration), 1.0)))

    def slowest(self, flow: float) -> float:
        """m³/s -> s: what the steepest ramp to a flow would take if it were as steep all the way."""
        change = float(np.interp(flow, self.flow, self.change))
        return flow / min(change, math.sqrt(flow * change * self.steepness)) if flow > 0.0 else 0.0

    def jumps(self, clay: Array, before: float) -> Flags:
        """(M,) whether the clay per metre changes where each segment begins; ``before`` them it was that."""
        if not self.rests:
            return np.zeros(len(clay), dtype=np.bool_)
        earlier = np.concatenate(([before], clay[:-1]))
        return np.asarray(np.abs(clay - earlier) > SAME * np.maximum(clay, earlier))


UNBOUNDED: Final = FlowLimits()
"""Air that pushes anything."""
