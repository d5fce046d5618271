"""Where the machine can hold, move and print: all limits at a pose, and the printable radius by height."""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.clearance import clear_radius
from cdhr_host.mechanism.dynamics import affine_nine_tensions
from cdhr_host.mechanism.kinematics import blocks, lengths, reachable, slider
from cdhr_host.mechanism.pairs import Pairs
from cdhr_host.mechanism.policy import POLICIES, Policy, PolicyName
from cdhr_host.mechanism.response import Windows
from cdhr_host.profile import Profile
from cdhr_host.units import DEG, MM
from cdhr_host.values import Array, Flags

SECTOR: Final = np.linspace(0.0, 60.0, 13) * DEG
"""azimuths looked at; the rest of the circle follows by symmetry, as drawn"""
AROUND: Final = np.linspace(0.0, 355.0, 72) * DEG
"""azimuths looked at where a machine differs from its drawing"""


class Angles(NamedTuple):
    """Of six cables at N poses."""

    wrap: Array
    """(N, 6) rad: about the pulley"""
    fleet: Array
    """(N, 6) rad, unsigned: horizontally, between BA and the azimuth in which the cable leaves"""


def angles(cables: Cables, lower: Array, upper: Array) -> Angles:
    """(N, 3), (N, 3) -> Angles. Raises MotionError out of reach."""
    wrap, fleet = np.empty((len(lower), 6)), np.empty((len(lower), 6))
    for rows, wraps in blocks(cables, lower, upper):
        for i, one in enumerate(wraps):
            wrap[rows, i] = one.angle()
    for i in range(6):
        flat = (cables.anchors[i] - cables.attachments[i] - (lower if i < 3 else upper))[:, :2]
        turn = np.arctan2(flat[:, 1], flat[:, 0]) - cables.azimuths[i]
        fleet[:, i] = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
    return Angles(wrap, fleet)


@dataclass(frozen=True, slots=True)
class Workspace:
    """One machine with a policy, and what it must stay within."""

    profile: Profile
    cables: Cables
    loads: Loads
    pairs: Pairs
    windows: Windows
    policy: Policy

    @classmethod
    def from_profile(cls, profile: Profile, policy: PolicyName | None = None) -> "Workspace":
        """``policy`` in place of the profile's own."""
        return cls(
            profile,
            Cables.from_profile(profile),
            Loads.from_profile(profile),
            Pairs.from_profile(profile),
            Windows.from_profile(profile),
            Policy.from_profile(profile, policy),
        )

    @property
    def symmetric(self) -> bool:
        """Whether the machine is as drawn: alike about its axis and mirrored at each cable."""
        return self.profile.calibration == type(self.profile.calibration)()

    def margin(self, lower: Array, acceleration: float = 0.0) -> Array:
        """(N, 3) -> (N,): smallest margin of the nine cables in half-widths of their windows.

        With ``acceleration``, m/s², of both platforms in whatever common direction is worst.
        -inf out of reach.
        """
        force, gain = self._forces(lower)
        half = 0.5 * (self.windows.high - self.windows.low)
        sway = acceleration * np.tile(np.linalg.norm(gain, axis=2) / half, 2)
        return _least(self.windows.margins(force) - sway)

    def acceleration_reserve(self, lower: Array) -> Array:
        """(N, 3) -> (N,) m/s²: what both platforms can be accelerated by in every direction.

        Negative where a window is left at rest already; -inf out of reach.
        """
        force, gain = self._forces(lower)
        room = np.minimum(force - self.windows.low, self.windows.high - force)
        return _least(room / np.linalg.norm(gain, axis=2))

    def within_limits(self, lower: Array) -> Flags:
        """(N, 3) -> (N,): slider travel, wrap and fleet angles of the profile are kept."""
        upper, sliders, shape = self.policy.upper(lower), self.profile.sliders, self.profile.geometry
        found = reachable(self.cables, lower, upper)
        lower, upper = lower[found], upper[found]
        travel = slider(self.cables, lengths(self.cables, lower, upper))
        turned = angles(self.cables, lower, upper)
        kept = (travel >= sliders.travel_min) & (travel <= sliders.travel_max)
        kept &= (turned.wrap <= shape.wrap_max) & (turned.fleet <= shape.fleet_max)
        found[found] = kept.all(axis=1)
        return found

    def feasible(self, lower: Array, acceleration: float = 0.0) -> Flags:
        """(N, 3) -> (N,): within limits, and wrench-feasible with the acceleration."""
        return (self.margin(lower, acceleration) >= 0.0) & self.within_limits(lower)

    def _forces(self, lower: Array) -> tuple[Array, Array]:
        """Twelve resting forces, and their gains by a common acceleration; NaN out of reach."""
        upper = self.policy.upper(lower)
        fits = reachable(self.cables, lower, upper)
        nine = affine_nine_tensions(self.cables, self.loads, self.pairs, lower[fits], upper[fits])
        gains = np.concatenate([nine.lower, nine.upper], axis=1)
        force, gain = np.full((len(lower), 12), np.nan), np.full((len(lower), 12, 3), np.nan)
        force[fits] = np.hstack([nine.rest[:, :3] + nine.rest[:, 3:6], nine.rest])
        gain[fits] = np.concatenate([gains[:, :3] + gains[:, 3:6], gains], axis=1)
        return force, gain


class Printable(NamedTuple):
    """Radii about the machine's axis by height of the lower attachment plane."""

    height: Array
    """(H,) m, above the plane of the lower pulleys"""
    radius: dict[PolicyName, Array]
    """(H,) m for each policy; 0 where not even the axis is feasible"""
    clear: Array
    """(H,) m: beyond it the lower cables would run into a flat part; the same for all policies"""

    def volume(self, policy: PolicyName) -> float:
        """m³, of slices as high as the heights are apart."""
        step = float(self.height[1] - self.height[0])
        return float(np.pi * step * (self.radius[policy] ** 2).sum())


def printable(
    profile: Profile, height: Array, *, step: float = 10.0 * MM, acceleration: float = 0.0
) -> Printable:
    """(H,) m, evenly apart -> Printable: forces, travel and angles at every azimuth up to each radius."""
    cables, pairs = Cables.from_profile(profile), Pairs.from_profile(profile)
    floor, nozzle = float(cables.anchors[0, 2]), profile.geometry.nozzle_length
    clear = [clear_radius(cables, pairs, nozzle, floor + h, step=5.0 * MM) for h in height]
    radius = {
        name: _radii(Workspace.from_profile(profile, name), height + floor, step, acceleration)
        for name in POLICIES
    }
    return Printable(height, radius, np.array(clear))


def _radii(space: Workspace, height: Array, step: float, acceleration: float) -> Array:
    anchors, attached = space.cables.anchors, space.cables.attachments
    reach = 0.5 * float(np.linalg.norm(anchors[0, :2]) - np.linalg.norm(attached[0, :2]))
    radii = np.arange(0.0, reach, step)
    turns = SECTOR if space.symmetric else AROUND
    r, turn, z = np.meshgrid(radii, turns, height - attached[0, 2], indexing="ij")
    places = np.column_stack([(r * np.cos(turn)).ravel(), (r * np.sin(turn)).ravel(), z.ravel()])
    good = space.feasible(places, acceleration).reshape(r.shape).all(axis=1)
    far = np.cumprod(good, axis=0).sum(axis=0) - 1
    return np.where(far >= 0, radii[np.maximum(far, 0)], 0.0)


def _least(values: Array) -> Array:
    return np.asarray(np.where(np.isnan(values), -np.inf, values).min(axis=1), dtype=np.float64)
