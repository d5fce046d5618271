"""The profile's limits on nozzle, sliders and air as limits on the nozzle alone."""

from dataclasses import dataclass, replace

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism import UpperBounds
from cdhr_host.motion.flow import UNBOUNDED, FlowLimits
from cdhr_host.motion.room import ALL, AccelerationRoom
from cdhr_host.motion.shaping import Shaper, shaper
from cdhr_host.profile import Profile
from cdhr_host.units import MM

CHORD_ERROR = 1e-6
"""m, how far the chords that stand for a curve may be from it."""


FOLLOWING = UpperBounds(1.0, 0.0, 0.0)
"""An upper platform at a constant offset."""


def _too_slow_sliders(speed: float) -> Problem:
    return Problem(
        "unplannable",
        f"at {speed / MM:g} mm/s the cables' turning alone exceeds the sliders' acceleration or jerk limit",
        key="limits.speed_max_mm_s",
        value=speed / MM,
        hint="lower limits.speed_max_mm_s, or raise the sliders' acceleration_max and jerk_max",
    )


def _too_slow_mode(deviation: float, profile: Profile) -> Problem:
    rules = profile.path
    return Problem(
        "unplannable",
        f"shaping a mode of {rules.shaper_frequency:g} Hz leaves the path by up to {deviation / MM:.3f} mm, "
        f"more than half of the tolerance of {rules.tolerance / MM:g} mm",
        key="path.shaper_frequency_hz",
        value=rules.shaper_frequency,
        hint="widen path.tolerance_mm, lower limits.acceleration_max_mm_s2, or use a shorter shaper (zv)",
    )


def profile_shaper(profile: Profile) -> Shaper:
    """The input shaper of a profile's [path]."""
    rules = profile.path
    return shaper(rules.shaper, rules.shaper_frequency, rules.shaper_damping)


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Bounds on the nozzle, with the sliders' folded in, and the smoothing that goes with them."""

    speed: float
    """m/s"""
    acceleration: float
    """m/s²"""
    jerk: float
    """m/s³"""
    half_width: float
    """m, of the smoothing kernel"""
    stop_angle: float
    """rad, a corner turning more than this is an exact stop"""
    shaped: float = 0.0
    """m, the part of every tolerance that input shaping needs"""
    flow: FlowLimits = UNBOUNDED
    """of the air"""
    room: AccelerationRoom = ALL
    """what the cables' forces leave of the acceleration"""

    @classmethod
    def from_profile(
        cls,
        profile: Profile,
        bend: float,
        upper: UpperBounds = FOLLOWING,
        flow: FlowLimits = UNBOUNDED,
    ) -> "MotionLimits":
        """Nozzle limits under which the sliders' limits hold too.

        ``bend`` (1/m) bounds, over the bed, how much a cable's direction turns for each metre
        its platform moves, g = 1/L + cos(theta)/rho; ``upper`` bounds the upper platform's motion
        by the nozzle's. With l' = -e·v and |e| = 1, for the motion of the cable's platform,
        |l'| <= v, |l''| <= a + g v², |l'''| <= j + 3 g a v + 6 g² v³.
        Raises MotionError where that leaves nothing for the nozzle.
        """
        limits, sliders = profile.limits, profile.sliders
        v = min(limits.speed_max, sliders.speed_max / upper.slope)
        turning = upper.bend * v**2
        a = (sliders.acceleration_max - turning - bend * (upper.slope * v) ** 2) / upper.slope
        a = min(limits.acceleration_max, a)
        fast, hard = upper.slope * v, upper.slope * a + turning
        turned = 3 * bend * hard * fast + 6 * bend**2 * fast**3
        j = (sliders.jerk_max - 3 * upper.bend * v * a - upper.twist * v**3 - turned) / upper.slope
        j = min(limits.jerk_max, j)
        if a <= 0.0 or j <= 0.0:
            raise MotionError(_too_slow_sliders(v))
        shaped = profile_shaper(profile).deviation(a)
        if shaped > profile.path.tolerance / 2:
            raise MotionError(_too_slow_mode(shaped, profile))
        smoothed = half_width(profile.path.tolerance - shaped)
        return cls(v, a, j, smoothed, profile.path.stop_angle, shaped, flow)

    @property
    def deviation(self) -> float:
        """m, the most by which smoothing and input shaping leave the drawn path."""
        return self.half_width / 3.0 + self.shaped

    def within(self, tolerance: float) -> "MotionLimits":
        """The same limits with the smoothing that a tolerance (m) allows."""
        return replace(self, half_width=half_width(max(tolerance - self.shaped, tolerance / 2)))


def half_width(tolerance: float) -> float:
    """m -> m: the kernel deviates by a third of its half-width; CHORD_ERROR is left for curves' chords."""
    return 3.0 * (tolerance - CHORD_ERROR)
