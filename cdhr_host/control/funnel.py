"""The performance function: how large an error may be, and how soon it must be small."""

import math
from dataclasses import dataclass

from cdhr_host.units import MM


@dataclass(frozen=True, slots=True)
class Funnel:
    """rho(t) = (first - last) exp(-t / settling) + last."""

    first: float = 5.0 * MM
    """m at the start"""
    last: float = 1.5 * MM
    """m in the end"""
    settling: float = 5.0
    """s"""

    def radius(self, t: float) -> float:
        """M of error allowed ``t`` s after the start."""
        return (self.first - self.last) * math.exp(-t / self.settling) + self.last

    def pressing(self, error: float, t: float) -> float:
        """Rho artanh(|e| / rho), m: the error as it counts, |e| when small, without bound at the wall.

        Infinite at the wall and beyond it.
        """
        share = error / self.radius(t)
        return self.radius(t) * math.atanh(share) if share < 1.0 else math.inf
