"""The machine as the staircase sees it: nozzle motion in, both platforms, cables and forces out."""

from dataclasses import dataclass, replace

from cdhr_host.extrusion import AirModel
from cdhr_host.mechanism import (
    Cables,
    Give,
    Loads,
    Pairs,
    Policy,
    UpperBounds,
    UpperMotion,
    Windows,
    cable_state,
    direction_change_bound,
    forward,
    lengths,
    lengths_and_rates,
    nine_tensions,
    slider,
    stretched_forward,
    swings,
    tensions,
    upper_bounds,
)
from cdhr_host.motion.limits import MotionLimits, profile_shaper
from cdhr_host.motion.room import AccelerationRoom
from cdhr_host.pipeline.pushing import flow_limits
from cdhr_host.profile import Profile
from cdhr_host.values import Array, CableState, ToolTrack


@dataclass(frozen=True, slots=True)
class Rig:
    """A profile made ready for the formulas."""

    profile: Profile
    cables: Cables
    loads: Loads
    pairs: Pairs
    policy: Policy
    upper: UpperBounds
    bend: float
    """1/m, of ``direction_change_bound``"""
    give: Give | None
    """the cables' stretch, where setpoints allow for it"""
    air: AirModel
    room: AccelerationRoom
    """for the nozzle's acceleration, that the force windows leave"""

    @classmethod
    def from_profile(cls, profile: Profile) -> "Rig":
        """Fits the spring policy, which may take half a second the first time."""
        policy = Policy.from_profile(profile)
        parts = Cables.from_profile(profile), Loads.from_profile(profile), Pairs.from_profile(profile)
        upper = upper_bounds(profile, policy)
        return cls(
            profile,
            *parts,
            policy,
            upper,
            direction_change_bound(profile),
            Give.from_profile(profile) if profile.stretch.compensation == "on" else None,
            AirModel.from_profile(profile),
            _room(profile, parts, policy, upper),
        )

    def limits(self) -> MotionLimits:
        """Limits of the nozzle that keep those of the sliders; raises MotionError where there are none."""
        limits = self.profile.limits
        flow = flow_limits(self.air, limits.jerk_max / limits.acceleration_max)
        found = MotionLimits.from_profile(self.profile, self.bend, self.upper, flow)
        return replace(found, room=self.room)

    def follow(self, track: ToolTrack) -> tuple[Array, UpperMotion]:
        """(N, 3) m, the nozzle platform's displacement, and the upper platform's motion."""
        q = track.position_G - self.cables.reference_G
        return q, self.policy.follow(q, track.velocity, track.acceleration)

    def state(self, q: Array, track: ToolTrack, upper: UpperMotion) -> CableState:
        """Six equivalent cables at N samples; raises MotionError out of reach."""
        return cable_state(
            self.cables,
            self.loads,
            q,
            upper.place,
            track.velocity,
            track.acceleration,
            upper_velocity=upper.velocity,
            upper_acceleration=upper.acceleration,
        )

    def nine(self, q: Array, track: ToolTrack, upper: UpperMotion) -> Array:
        """(N, 9) N: left and right cables of the pairs, then the upper ones. Eq. (13), (14)."""
        motion = track.acceleration, upper.acceleration
        return nine_tensions(self.cables, self.loads, self.pairs, q, upper.place, *motion)

    def sliders(self, length: Array, tension: Array) -> Array:
        """(N, 6) m, (N, 6) N -> (N, 6) m: where the sliders stand."""
        rigid = slider(self.cables, length)
        return rigid if self.give is None else rigid + self.give.slider_correction(tension)

    def standing(self, slider: Array) -> tuple[Array, Array]:
        """(6,) m -> (3,) nozzle in G, (3,) displacement of the upper platform, m, at rest there.

        Raises MotionError where no pose has these cable lengths.
        """
        if self.give is None:
            lower, upper = forward(self.cables, (self.cables.reference_lengths + slider)[None])
        else:
            lower, upper = stretched_forward(self.cables, self.loads, self.give, slider[None])
        return self.cables.reference_G + lower[0], upper[0]

    def slider_places(self, track: ToolTrack) -> Array:
        """(N, 6) m: as ``sliders``, with no more worked out than that needs."""
        if self.give is not None:
            return self.shifted_sliders(track, self.follow(track)[1])
        q = track.position_G - self.cables.reference_G
        return slider(self.cables, lengths(self.cables, q, self.policy.upper(q)))

    def slider_motion(self, position_G: Array, velocity: Array) -> tuple[Array, Array]:
        """(N, 3) m, (N, 3) m/s of the nozzle -> (N, 6) m, (N, 6) m/s of sliders that allow for no stretch."""
        q = position_G - self.cables.reference_G
        length, rate = lengths_and_rates(self.cables, (q, velocity), self.policy.moving(q, velocity))
        return slider(self.cables, length), rate

    def shifted_sliders(self, track: ToolTrack, upper: UpperMotion) -> Array:
        """The same for an upper platform with a motion of its own."""
        q = track.position_G - self.cables.reference_G
        length = lengths(self.cables, q, upper.place)
        if self.give is None:
            return slider(self.cables, length)
        motion = track.acceleration, upper.acceleration
        return self.sliders(length, tensions(self.cables, self.loads, q, upper.place, *motion))


def _room(
    profile: Profile, parts: tuple[Cables, Loads, Pairs], policy: Policy, upper: UpperBounds
) -> AccelerationRoom:
    """For the nozzle's acceleration, anywhere on the bed."""
    (cables, loads, pairs), windows, speed = parts, Windows.from_profile(profile), profile.limits.speed_max

    def measure(places_G: Array) -> Array:
        q = places_G - cables.reference_G
        return swings(cables, loads, pairs, q, policy.upper(q)).room(windows, upper, speed)

    lag = speed * profile_shaper(profile).length / 2.0
    return AccelerationRoom(profile.bed.radius, profile.bed.height, lag, measure)
