"""The equations once more, one cable and one pose at a time, in mm and by the paper's text."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from cdhr_host.mechanism import Cables, Loads
from cdhr_host.profile import Profile, find, read_table, validate

COLUMNS = {"sim": "paper-simulation", "exp": "paper"}
"""Column of Table A1 -> profile"""
GRAVITY = 9.81


@dataclass(frozen=True)
class Machine:
    profile: Profile
    cables: Cables
    loads: Loads


@cache
def machine(name: str) -> Machine:
    profile, problems = validate(read_table(find(name)))
    assert problems == []
    return Machine(profile, Cables.from_profile(profile), Loads.from_profile(profile))


def workspace(
    rng: np.random.Generator, count: int, radius: float, low: float, high: float
) -> NDArray[np.float64]:
    """(count, 3) m: uniform in a cylinder given in m."""
    r, turn = radius * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), rng.uniform(low, high, count)])


def vector_ba(column: str, i: int, q: list[float]) -> tuple[float, float, float]:
    """Eq. (2), mm: q of the platform that cable i holds."""
    below = {"sim": 868.0, "exp": 438.5}[column]
    radial, height = (898.62 - 60.62, -below) if i < 3 else (898.62, 1796.0 - below - 55.0)
    beta = 2 * math.pi * (i % 3) / 3
    return radial * math.cos(beta) - q[0], radial * math.sin(beta) - q[1], height - q[2]


def wrap_angle(x: float, y: float, z: float, r: float) -> float:
    """Eq. (4)."""
    rho, w = math.hypot(x, y), abs(z)
    return math.asin(r / math.hypot(rho, w)) + math.atan2(w, rho)


def cable_length(x: float, y: float, z: float, r: float = 11.0) -> float:
    """Eq. (5), (8), (9) with BC from the corrected Eq. (6)."""
    e, straight = straight_part(x, y, z, r)
    assert math.isclose(math.hypot(*e), 1.0, rel_tol=1e-14)
    return r * wrap_angle(x, y, z, r) + straight


def straight_part(x: float, y: float, z: float, r: float = 11.0) -> tuple[list[float], float]:
    """e and |BC| from BC = BA + AC. Eq. (6) corrected, (7), (10)."""
    theta, b, k = wrap_angle(x, y, z, r), math.atan2(y, x), math.copysign(1.0, z)
    ac = (-r * math.sin(theta) * math.cos(b), -r * math.sin(theta) * math.sin(b), k * r * math.cos(theta))
    bc = [part + move for part, move in zip((x, y, z), ac, strict=True)]
    straight = math.hypot(*bc)
    return [part / straight for part in bc], straight


def forces(column: str, q: list[float], a: list[float]) -> list[float]:
    """Eq. (11), (12), N: six tensions; q in mm and a in mm/s² of both platforms."""
    mass, rest = {"sim": (1.0, 25.0), "exp": (0.76, 40.7)}[column]
    span = [q[3] - q[0], q[4] - q[1], 55.0 + q[5] - q[2]]
    size = math.hypot(*span)
    spring = [(size - rest) * part / size for part in span]
    found: list[float] = []
    for side, sign in ((0, -1.0), (3, 1.0)):
        columns = [straight_part(*vector_ba(column, side + i, q[side : side + 3]))[0] for i in range(3)]
        needed = [
            mass * a[side + axis] * 1e-3 + sign * spring[axis] + (mass * GRAVITY if axis == 2 else 0.0)
            for axis in range(3)
        ]
        found += np.linalg.solve(np.array(columns).T, needed).tolist()
    return found
