"""Which ticks of a stretch a proof must look at.

Where bounds already prove every setpoint of a stretch, samples at most SPACING apart are
enough to find its extremes; where they do not, every tick is looked at:

* speed, acceleration, jerk and flow of the nozzle: bounds in continuous time (motion.bounds);
  the sliders' follow, as in ``MotionLimits.from_profile``;
* the bed: a cylinder is convex and the smoothed path a weighted mean of drawn points, so a
  leg whose drawn points are all inside stays inside;
* slider travel: a cable's length changes by at most the way of the nozzle;
* cable forces: f = f0(q) + B(q) a with |a| bounded over the leg, and f0 changes by at most
  ``force_slope`` for each metre; no place is further than half of SPACING from a sample.
"""

from collections.abc import Iterator

import numpy as np

from cdhr_host.mechanism import (
    Cables,
    Loads,
    affine_tensions,
    direction_change_bound,
    lengths,
    slider,
    tension_slopes,
)
from cdhr_host.motion.bounds import LegBounds, leg_bounds
from cdhr_host.motion.leg import Leg
from cdhr_host.motion.sampling import BLOCK, Stand, Timed
from cdhr_host.pipeline.audit import ROUNDING, on_bed
from cdhr_host.profile import Profile
from cdhr_host.values import Array, Flags, Ints, ToolTrack

SPACING = 2e-3
"""m along the path"""
GRID = (9, 7, 9)
"""places in radius, azimuth and height at which the slope of the forces is evaluated"""
STEEPER = 1.2
"""how much steeper than at any of these places the forces may be in between"""


class Survey:
    """Chooses the ticks that prove a stretch."""

    def __init__(self, profile: Profile) -> None:
        self._profile = profile
        self._cables = Cables.from_profile(profile)
        self._loads = Loads.from_profile(profile)
        self._bend = direction_change_bound(profile)
        forces, margin = profile.forces, force_slope(profile) * SPACING / 2
        self._least = np.repeat([forces.lower_min, forces.upper_min], 3) + margin
        self._greatest = np.repeat([forces.lower_max, forces.upper_max], 3) - margin

    def tracks(self, timed: Timed) -> Iterator[ToolTrack]:
        """Samples of a stretch that prove all of it, in blocks."""
        ticks = self._ticks(timed)
        for first in range(0, len(ticks), BLOCK):
            yield timed.track(ticks[first : first + BLOCK])

    def _ticks(self, timed: Timed) -> Ints:
        every = timed.ticks
        if len(every) <= 2:
            return np.arange(every.start, every.stop)
        if isinstance(timed.stretch, Stand):
            return np.unique([*timed.settling, every.start, every.stop - 1])
        found = leg_bounds(timed.stretch)
        if not self._within(timed.stretch, found):
            return np.arange(every.start, every.stop)
        stride = max(1, int(SPACING / (found.speed * timed.period)))
        coarse = np.append(np.arange(every.start, every.stop - 1, stride), every.stop - 1)
        certain = self._certain(timed.track(coarse), found)
        return _refined(coarse, certain[:-1] & certain[1:])

    def _within(self, leg: Leg, found: LegBounds) -> bool:
        """Whether bounds alone keep a leg on the bed and inside the limits of nozzle, sliders and air."""
        limits, sliders, extruder = self._profile.limits, self._profile.sliders, self._profile.extruder
        turning = self._bend * found.speed**2
        pressure = extruder.pressure_threshold + extruder.pressure_slope * found.flow
        slack = 1 + ROUNDING
        return (
            found.over_feed <= slack
            and found.speed <= min(limits.speed_max, sliders.speed_max) * slack
            and found.acceleration <= limits.acceleration_max * slack
            and found.acceleration + turning <= sliders.acceleration_max * slack
            and found.jerk <= limits.jerk_max * slack
            and max(pressure, found.air) <= extruder.pressure_max
            and bool(on_bed(leg.segments.points, self._profile).all())
        )

    def _certain(self, track: ToolTrack, found: LegBounds) -> Flags:
        """(N,) whether forces and travel are proven between here and a neighbour that is certain too."""
        q = track.position_G - self._cables.reference_G
        affine = affine_tensions(self._cables, self._loads, q, q)
        swing = np.concatenate((_row_norms(affine.lower), _row_norms(affine.upper)), axis=1)
        low, high = affine.rest - swing * found.acceleration, affine.rest + swing * found.acceleration
        travel, sliders = slider(self._cables, lengths(self._cables, q, q)), self._profile.sliders
        pulled = (low >= self._least) & (high <= self._greatest)
        held = (travel >= sliders.travel_min + SPACING) & (travel <= sliders.travel_max - SPACING)
        return np.asarray((pulled & held).all(axis=1), dtype=np.bool_)


def force_slope(profile: Profile) -> float:
    """N/m: the most a resting cable force changes for each metre of nozzle travel on the bed."""
    bed, cables = profile.bed, Cables.from_profile(profile)
    radius, azimuth, height = np.meshgrid(
        np.linspace(0.0, bed.radius, GRID[0]),
        np.linspace(0.0, 2 * np.pi / 3, GRID[1]),
        np.linspace(0.0, bed.height, GRID[2]),
    )
    places = np.stack((radius * np.cos(azimuth), radius * np.sin(azimuth), height), axis=-1).reshape(-1, 3)
    q = places - cables.reference_G
    by_lower, by_upper = tension_slopes(cables, Loads.from_profile(profile), q, q)
    return STEEPER * float(_row_norms(by_lower + by_upper).max())


def _row_norms(gain: Array) -> Array:
    """(N, K, 3) -> (N, K)."""
    norms: Array = np.sqrt(np.einsum("nij,nij->ni", gain, gain))
    return norms


def _refined(coarse: Ints, proven: Flags) -> Ints:
    """Coarse ticks (N,), with every tick in between where an interval (N-1,) is not proven."""
    if proven.all():
        return coarse
    count = np.where(proven, 1, np.diff(coarse))
    start = np.repeat(coarse[:-1], count)
    within = np.arange(len(start)) - np.repeat(np.cumsum(count) - count, count)
    return np.append(start + within, coarse[-1])
