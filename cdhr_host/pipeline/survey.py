"""Which ticks of a stretch a proof must look at.

Where bounds already prove every setpoint of a stretch, samples at most SPACING apart are
enough to find its extremes; where they do not, every tick is looked at:

* speed, acceleration, jerk and flow of the nozzle: bounds in continuous time (motion.bounds);
  the sliders' follow, as in ``MotionLimits.from_profile``;
* the bed: a cylinder is convex and the smoothed path a weighted mean of drawn points, but for corners that
  swing out, which stay between the control points of their pieces: a leg stays inside if all of these are;
* slider travel: a cable's length changes by at most the way of the nozzle;
* cable forces: f = f0(q) + B(q) a with |a| bounded over the leg, and f0 changes by at most
  ``force_slope`` for each metre; no place is further than half of SPACING from a sample.
"""

from collections.abc import Iterator

import numpy as np

from cdhr_host.mechanism import swings
from cdhr_host.motion.bounds import LegBounds, leg_bounds
from cdhr_host.motion.leg import Leg
from cdhr_host.motion.sampling import BLOCK, Stand, Timed
from cdhr_host.pipeline.audit import ROUNDING, on_bed
from cdhr_host.pipeline.rig import Rig
from cdhr_host.values import Array, Flags, Ints, ToolTrack

SPACING = 2e-3
"""m along the path"""
GRID = (9, 7, 9)
"""places in radius, azimuth and height at which the slope of the forces is evaluated"""
STEP = 1e-5
"""m, of the differences that give the slope"""
STEEPER = 1.2
"""how much steeper than at any of these places the forces may be in between"""


class Survey:
    """Chooses the ticks that prove a stretch."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._profile = rig.profile
        forces, margin = rig.profile.forces, force_slope(rig) * SPACING / 2
        least = [forces.lower_min] * 3 + [forces.single_min] * 6 + [forces.upper_min] * 3
        greatest = [forces.lower_max] * 3 + [forces.single_max] * 6 + [forces.upper_max] * 3
        self._least, self._greatest = np.array(least) + margin, np.array(greatest) - margin

    def tracks(self, timed: Timed) -> Iterator[ToolTrack]:
        """Samples of a stretch that prove all of it, in blocks."""
        looks = self._looks(timed)
        count = len(looks.tick) if isinstance(looks, ToolTrack) else len(looks)
        for rows in (slice(first, first + BLOCK) for first in range(0, count, BLOCK)):
            yield looks[rows] if isinstance(looks, ToolTrack) else timed.track(looks[rows])

    def _looks(self, timed: Timed) -> Ints | ToolTrack:
        """Ticks, or the samples at them where these are known already."""
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
        track = timed.track(coarse)
        certain = self._certain(track, found)
        return track if certain.all() else _refined(coarse, certain[:-1] & certain[1:])

    def _within(self, leg: Leg, found: LegBounds) -> bool:
        """Whether bounds alone keep a leg on the bed and inside the limits of nozzle, sliders and air."""
        limits, sliders, extruder = self._profile.limits, self._profile.sliders, self._profile.extruder
        upper, pressure = self._rig.upper, float(self._rig.air.law.pressure(np.array(found.flow)))
        fast = upper.slope * found.speed
        hard = upper.slope * found.acceleration + upper.bend * found.speed**2
        slack = 1 + ROUNDING
        return (
            found.over_feed <= slack
            and found.speed <= limits.speed_max * slack
            and fast <= sliders.speed_max * slack
            and found.acceleration <= limits.acceleration_max * slack
            and hard + self._rig.bend * fast**2 <= sliders.acceleration_max * slack
            and found.jerk <= limits.jerk_max * slack
            and max(pressure, found.air) <= extruder.pressure_max * slack
            and bool(on_bed(leg.segments.points, self._profile).all())
            and bool(on_bed(leg.path.swung(), self._profile).all())
        )

    def _certain(self, track: ToolTrack, found: LegBounds) -> Flags:
        """(N,) whether forces and travel are proven between here and a neighbour that is certain too."""
        rig = self._rig
        q = track.position_G - rig.cables.reference_G
        forces = swings(rig.cables, rig.loads, rig.pairs, q, rig.policy.upper(q))
        hard = rig.upper.slope * found.acceleration + rig.upper.bend * found.speed**2
        swing = forces.by(found.acceleration, hard)
        pulled = (forces.rest - swing >= self._least) & (forces.rest + swing <= self._greatest)
        travel, sliders = rig.slider_places(track), self._profile.sliders
        margin = rig.upper.slope * SPACING
        held = (travel >= sliders.travel_min + margin) & (travel <= sliders.travel_max - margin)
        return np.asarray(pulled.all(axis=1) & held.all(axis=1), dtype=np.bool_)


def force_slope(rig: Rig) -> float:
    """N/m: the most a resting cable force changes for each metre of nozzle travel on the bed."""
    bed = rig.profile.bed
    radius, azimuth, height = np.meshgrid(
        np.linspace(0.0, bed.radius, GRID[0]),
        np.linspace(0.0, 2 * np.pi / 3, GRID[1]),
        np.linspace(0.0, bed.height, GRID[2]),
    )
    places = np.stack((radius * np.cos(azimuth), radius * np.sin(azimuth), height), axis=-1).reshape(-1, 3)
    q = places - rig.cables.reference_G
    ways = STEP * np.eye(3)
    gradient = [(_resting(rig, q + way) - _resting(rig, q - way)) / (2 * STEP) for way in ways]
    return STEEPER * float(np.sqrt(sum(part**2 for part in gradient)).max())


def _resting(rig: Rig, q: Array) -> Array:
    """(N, 3) m -> (N, 12) N."""
    return swings(rig.cables, rig.loads, rig.pairs, q, rig.policy.upper(q)).rest


def _refined(coarse: Ints, proven: Flags) -> Ints:
    """Coarse ticks (N,), with every tick in between where an interval (N-1,) is not proven."""
    count = np.where(proven, 1, np.diff(coarse))
    start = np.repeat(coarse[:-1], count)
    within = np.arange(len(start)) - np.repeat(np.cumsum(count) - count, count)
    return np.append(start + within, coarse[-1])
