"""Sect. 3.3 with the inertia of the spools, Eq. (16): two points on six cables that have to be sped up.

A spool of inertia I takes m l'' of its motor's force f, m = I / r²: the cable pulls with
T = f + m l''. The motors are told T - m l'' of the plan. With l'' = -e·a - e'·v the platform
moves by (M + m Σ e eᵀ) a = Σ e (f - m e'·v) + load.
"""

from typing import Final

import numpy as np

from cdhr_host.mechanism import Cables, Loads, cable_state, trajectories
from cdhr_host.mechanism.cables import GRAVITY
from cdhr_host.mechanism.pulley import PointWrap
from cdhr_host.plant.strands import LEFT, TOP, Strands
from cdhr_host.profile import Profile
from cdhr_host.units import MM
from cdhr_host.values import Array

STEP: Final = 1e-2
"""s"""
NEARBY: Final = 1e-3
"""s of motion over which a direction's change is taken"""


class Hung:
    """One platform as a point on three cables with spools."""

    def __init__(self, strands: Strands, which: tuple[int, ...], mass: float, spool: float) -> None:
        self._wrapped = [strands.wrapped[i] for i in which]
        level = np.array(strands.lower if which == LEFT else strands.upper)
        self._ends = [level + (np.array(strands.arms[i]) if which == LEFT else 0.0) for i in which]
        self._mass, self._spool = mass, spool
        self.place, self.speed = np.zeros(3), np.zeros(3)

    def drift(self, dt: float) -> None:
        """Move on at the present speed."""
        self.place = self.place + dt * self.speed

    def kick(self, force: Array, load: Array, dt: float) -> None:
        """Change of speed under the motors' (3,) N and a (3,) N load."""
        pulls = self._pulls(self.place)
        turning = (self._pulls(self.place + NEARBY * self.speed) - pulls) / NEARBY
        inertia = self._mass * np.eye(3) + self._spool * pulls.T @ pulls
        push = pulls.T @ (force - self._spool * (turning @ self.speed)) + load
        self.speed = self.speed + dt * np.linalg.solve(inertia, push)

    def _pulls(self, place: Array) -> Array:
        """(3, 3): e of each cable in a row."""
        return np.array(
            [
                wrapped(*(end + place).tolist())[1:]
                for wrapped, end in zip(self._wrapped, self._ends, strict=True)
            ]
        )


def worst_with_spools(profile: Profile, spool: float, seconds: float = 200.0) -> Array:
    """``spool`` kg = I / r² -> (3,) mm: greatest error along Eq. (15), forces not compensated."""
    loads, strands = Loads.from_profile(profile), Strands.from_profile(profile)
    lower = Hung(strands, LEFT, loads.lower_mass, spool)
    upper = Hung(strands, TOP, loads.upper_mass, spool)
    middle: Array = (np.arange(round(seconds / STEP), dtype=np.float64) + 0.5) * STEP
    q, a = trajectories.eq15(middle), trajectories.eq15(middle, 2)
    cables = Cables.from_profile(profile).with_pulley(PointWrap)
    state = cable_state(cables, loads, q, q, trajectories.eq15(middle, 1), a)
    force = state.tension - spool * state.acceleration
    goal, worst = trajectories.eq15(middle + 0.5 * STEP), np.zeros(3)
    weight = np.array([0.0, 0.0, GRAVITY])
    for row, target in zip(force, goal, strict=True):
        lower.drift(0.5 * STEP)
        upper.drift(0.5 * STEP)
        spring = _spring(loads, upper.place - lower.place)
        lower.kick(row[:3], spring - loads.lower_mass * weight, STEP)
        upper.kick(row[3:], -spring - loads.upper_mass * weight, STEP)
        lower.drift(0.5 * STEP)
        upper.drift(0.5 * STEP)
        worst = np.maximum(worst, np.abs(lower.place - target))
    return np.asarray(worst / MM)


def _spring(loads: Loads, apart: Array) -> Array:
    """(3,) N on the lower platform."""
    span = apart + np.array([0.0, 0.0, loads.separation])
    return np.asarray(loads.stiffness * (1.0 - loads.rest_length / np.linalg.norm(span)) * span)
