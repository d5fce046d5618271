"""How the forces of all nine cables answer to the spring: affine at a pose, and measured by margins.

Twelve forces have windows: three pairs, their six cables, three upper cables. A margin is the
distance to the nearer end of the window in half-widths: 1 in the middle, 0 at the end.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.mechanism.cables import GRAVITY, LOWER, Cables, Loads
from cdhr_host.mechanism.kinematics import components, jacobian, platform_blocks
from cdhr_host.mechanism.pairs import Pairs, left_shares
from cdhr_host.profile import Profile
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class Windows:
    """Bounds of pairs 1-3, left 1-3, right 1-3, upper 4-6."""

    low: Array
    """(12,) N"""
    high: Array
    """(12,) N"""

    @classmethod
    def from_profile(cls, profile: Profile) -> "Windows":
        """[forces]; a single cable never needs to carry more than its pair may."""
        forces = profile.forces
        single = min(forces.single_max, forces.lower_max)
        times = [3, 6, 3]
        return cls(
            np.repeat([forces.lower_min, forces.single_min, forces.upper_min], times),
            np.repeat([forces.lower_max, single, forces.upper_max], times),
        )

    def margins(self, force: Array) -> Array:
        """(..., 12) N -> (..., 24): to the low ends, then to the high ones."""
        half = 0.5 * (self.high - self.low)
        return np.concatenate([(force - self.low) / half, (self.high - force) / half], axis=-1)

    def least_margin(self, nine: Array) -> Array:
        """(N, 9) N of left, right, upper -> (N,): the smallest margin of all."""
        twelve = np.hstack([nine[:, :3] + nine[:, 3:6], nine])
        return np.asarray(self.margins(twelve).min(axis=1), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Response:
    """Twelve resting forces as ``weight + gain · s``; s is the spring's pull on the lower platform."""

    weight: Array
    """(N, 12) N"""
    gain: Array
    """(N, 12, 3)"""

    def force(self, spring: Array) -> Array:
        """(N, 3) N -> (N, 12) N."""
        return np.asarray(self.weight + np.einsum("nij,nj->ni", self.gain, spring), dtype=np.float64)


def response(cables: Cables, loads: Loads, pairs: Pairs, lower: Array, upper: Array) -> Response:
    """(N, 3), (N, 3) -> Response with the cables' directions at these places.

    Raises MotionError out of reach or at singular poses.
    """
    pulls = -jacobian(cables, lower, upper).transpose(0, 2, 1)
    below, above = np.linalg.inv(pulls[:, :, :3]), np.linalg.inv(pulls[:, :, 3:])
    weight = GRAVITY * np.stack([loads.lower_mass * below[:, :, 2], loads.upper_mass * above[:, :, 2]])
    columns = np.stack([weight[0], *(-below[:, :, axis] for axis in range(3))])
    left = np.array([_left(cables, pairs, lower, column) for column in columns])
    sides = np.concatenate([columns, left, columns - left], axis=2)
    return Response(
        np.hstack([sides[0], weight[1]]),
        np.concatenate([sides[1:].transpose(1, 2, 0), above], axis=1),
    )


def _left(cables: Cables, pairs: Pairs, lower: Array, force: Array) -> Array:
    found = np.empty_like(lower)
    for rows, wraps in platform_blocks(cables, LOWER, lower):
        for i, part in enumerate(left_shares(pairs, wraps, components(force, rows), None, rows.start)):
            found[rows, i] = part
    return found
