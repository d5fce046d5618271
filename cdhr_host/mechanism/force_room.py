"""How far acceleration may move the forces: what they are at rest, and the most it adds. Eq. (11)-(14)."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.mechanism.bounds import UpperBounds
from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.dynamics import affine_nine_tensions
from cdhr_host.mechanism.pairs import Pairs
from cdhr_host.mechanism.response import Windows
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class Swings:
    """Forces of pairs 1-3, left 1-3, right 1-3, upper 4-6 at N poses: within ``rest`` ± ``gain`` |a|."""

    rest: Array
    """(N, 12) N: at rest"""
    gain: Array
    """(N, 12) kg: for each acceleration of the platform that the cables hold"""

    def by(self, nozzle: float, upper: float) -> Array:
        """(N, 12) N: the most that accelerations of the two platforms, m/s², add or take."""
        return np.asarray(self.gain * np.repeat([nozzle, upper], [9, 3]), dtype=np.float64)

    def room(self, windows: Windows, bounds: UpperBounds, speed: float) -> Array:
        """(N, 24) m/s²: the nozzle's acceleration that may bring each force to the low, then the high end.

        Less than nothing where a force is outside at rest. The upper platform accelerates as
        UpperBounds says at up to ``speed``, m/s.
        """
        ends = np.hstack((self.rest - windows.low, windows.high - self.rest))
        held = ends / np.hstack((self.gain, self.gain))
        upper = np.tile(np.repeat([False, True], [9, 3]), 2)
        followed = (held - bounds.bend * speed**2) / bounds.slope
        return np.asarray(np.where(upper, followed, held), dtype=np.float64)


def swings(cables: Cables, loads: Loads, pairs: Pairs, lower: Array, upper: Array) -> Swings:
    """(N, 3), (N, 3) m -> Swings. Raises like ``nine_tensions``."""
    nine = affine_nine_tensions(cables, loads, pairs, lower, upper)
    rest = np.hstack((nine.rest[:, :3] + nine.rest[:, 3:6], nine.rest))
    below = np.concatenate((nine.lower[:, :3] + nine.lower[:, 3:], nine.lower), axis=1)
    return Swings(rest, np.hstack((_norms(below), _norms(nine.upper))))


def _norms(gain: Array) -> Array:
    """(N, K, 3) -> (N, K)."""
    return np.asarray(np.sqrt(np.einsum("nij,nij->ni", gain, gain)), dtype=np.float64)
