"""Bounds that hold over the whole bed."""

import itertools
import math
from typing import Final, NamedTuple

import numpy as np

from cdhr_host.mechanism.cables import Cables
from cdhr_host.mechanism.policy import Policy
from cdhr_host.profile import Profile
from cdhr_host.values import Array

SAFETY: Final = 1.1
"""on what is found on a grid of poses and directions"""
WAYS: Final = np.array(
    [way for way in itertools.product((-1, 0, 1), repeat=3) if way > (0, 0, 0)], dtype=float
)
"""thirteen directions, the others are their opposites"""
STEP: Final = 1e-4
"""m, between two looks for a third derivative"""


def direction_change_bound(profile: Profile) -> float:
    """1/m: most a cable's direction turns for each metre of nozzle travel, anywhere on the bed.

    The second derivative of the length has the terms (n·v)²/L + cos(theta)/rho (h·v)², so
    1/L + 1/rho bounds it, with rho at least the pulley circle less the platform and the bed,
    and L² = rho² + w² - r² at least rho² - r².
    """
    shape, bed = profile.geometry, profile.bed
    platform = max(shape.lower_attachment_radius, shape.upper_attachment_radius)
    rho = shape.pulley_circle_radius - platform - bed.radius - math.hypot(bed.origin_x, bed.origin_y)
    rho -= profile.calibration.greatest()
    return 1.0 / rho + 1.0 / math.sqrt(rho**2 - shape.pulley_radius**2)


class UpperBounds(NamedTuple):
    """How the upper platform's motion is bounded by the lower one's speed v, acceleration a and jerk j.

    |v_u| <= slope v;  |a_u| <= slope a + bend v²;  |j_u| <= slope j + 3 bend v a + twist v³.
    """

    slope: float
    bend: float
    """1/m"""
    twist: float
    """1/m²"""


def upper_bounds(profile: Profile, policy: Policy) -> UpperBounds:
    """UpperBounds over the bed, from a grid of it with some safety; exactly 1, 0, 0 for a constant offset."""
    if policy.field is None:
        return UpperBounds(1.0, 0.0, 0.0)
    q = _bed(profile) - Cables.from_profile(profile).reference_G
    slope = float(np.linalg.norm(policy.slope(q), ord=2, axis=(1, 2)).max())
    bend = twist = 0.0
    for way in WAYS / np.linalg.norm(WAYS, axis=1)[:, None]:
        along, still = np.broadcast_to(way, q.shape), np.zeros_like(q)
        ahead, back = (policy.follow(q + side * STEP * way, along, still).acceleration for side in (1, -1))
        bend = max(bend, float(np.linalg.norm(ahead, axis=1).max()))
        twist = max(twist, float(np.linalg.norm(ahead - back, axis=1).max()) / (2.0 * STEP))
    return UpperBounds(SAFETY * slope, SAFETY * bend, SAFETY * twist)


def _bed(profile: Profile) -> Array:
    """(N, 3) m in program coordinates."""
    r, turn, z = np.meshgrid(
        np.linspace(0.0, profile.bed.radius, 9),
        np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False),
        np.linspace(0.0, profile.bed.height, 11),
    )
    return np.column_stack([(r * np.cos(turn)).ravel(), (r * np.sin(turn)).ravel(), z.ravel()])
