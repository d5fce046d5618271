"""Cables that give: how much longer the planned tension makes them, and what that does to the nozzle.

A cable under tension f is longer by f L / EA. L reaches from the platform over the pulley to the
slider and does not change: what the slider pays out it loses on its own side. Two cables of a pair
share f, so that a pair gives half as much. Slider positions count from the reference pose, where
the cables are stretched too.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.dynamics import tension_slopes
from cdhr_host.mechanism.forward import forward
from cdhr_host.mechanism.kinematics import jacobian, lengths
from cdhr_host.mechanism.statics import tensions
from cdhr_host.profile import Profile
from cdhr_host.units import MM
from cdhr_host.values import Array

ROUNDS = 30
"""of looking for the pose of stretched cables; four or five do at EA = 5 kN"""
SETTLED = 1e-11
"""m: a step this short leaves an error of the order of its square"""


@dataclass(frozen=True, slots=True)
class Give:
    """Elasticity of the six equivalent cables."""

    compliance: Array
    """(6,) m/N: L / EA, of both cables together for a pair"""
    reference_stretch: Array
    """(6,) m: at rest at the reference pose"""
    doubt: float
    """part of EA it may be off by"""

    @classmethod
    def from_profile(cls, profile: Profile) -> "Give":
        """[stretch] of the profile."""
        soft = profile.stretch
        cables, home = Cables.from_profile(profile), np.zeros((1, 3))
        dead = np.repeat([soft.lower_dead_length, soft.upper_dead_length], 3)
        together = soft.stiffness * np.repeat([2.0, 1.0], 3)
        compliance = (cables.reference_lengths + dead) / together
        force = tensions(cables, Loads.from_profile(profile), home, home)[0]
        return cls(compliance, force * compliance, soft.stiffness_doubt)

    def slider_correction(self, tension: Array) -> Array:
        """(N, 6) N -> (N, 6) m: to add to slider positions; zero at the reference pose."""
        return self.reference_stretch - tension * self.compliance

    def correction_rates(self, rate: Array) -> Array:
        """(N, 6) N/s or N/s² -> (N, 6) m/s or m/s²: what changing tensions add to the sliders' motion."""
        return -rate * self.compliance


def stretched_forward(cables: Cables, loads: Loads, give: Give, slider: Array) -> tuple[Array, Array]:
    """(N, 6) -> (N, 3), (N, 3): where the resting platforms hang at these slider positions, m.

    Newton's method on l(q) = slider + stretch(f(q)) from the pose of rigid cables. Raises like
    ``forward`` and ``tensions``, and where that does not settle.
    """
    rigid = cables.reference_lengths + slider
    lower, upper = forward(cables, rigid)
    size = 0.0
    for _ in range(ROUNDS):
        force = tensions(cables, loads, lower, upper)
        excess = lengths(cables, lower, upper) + give.slider_correction(force) - rigid
        step = np.linalg.solve(_slope(cables, loads, give, lower, upper), excess[:, :, None])[:, :, 0]
        lower, upper = lower - step[:, :3], upper - step[:, 3:]
        size = float(np.abs(step).max(initial=0.0))
        if size <= SETTLED:
            return lower, upper
    raise MotionError(
        Problem(
            "unsettled",
            f"the pose of the stretched cables still moves by {size / MM:.3g} mm after {ROUNDS} rounds",
            value=size / MM,
            unit="mm",
            hint="raise [stretch] stiffness_n: cables this soft do not hold the platforms",
        )
    )


def _slope(cables: Cables, loads: Loads, give: Give, lower: Array, upper: Array) -> Array:
    """(N, 6, 6): d(l - stretch)/dq of both platforms."""
    slope = -give.compliance[:, None] * np.concatenate(tension_slopes(cables, loads, lower, upper), axis=2)
    pulls = jacobian(cables, lower, upper)
    slope[:, :3, :3] += pulls[:, :3]
    slope[:, 3:, 3:] += pulls[:, 3:]
    return slope


def stretch_doubt(cables: Cables, give: Give, lower: Array, upper: Array, tension: Array) -> Array:
    """(N, 3), (N, 3), (N, 6) N -> (N, 3): how far the nozzle may be off along x, y, z for EA's doubt, m.

    Each lower cable's EA is taken to be off on its own, the sum of the magnitudes; counted from
    the reference pose. Raises MotionError out of reach.
    """
    pulls = jacobian(cables, lower, upper)[:, :3]
    off = give.doubt / (1.0 - give.doubt) * np.abs(give.slider_correction(tension)[:, :3])
    return np.asarray(np.einsum("nij,nj->ni", np.abs(np.linalg.inv(pulls)), off), dtype=np.float64)
