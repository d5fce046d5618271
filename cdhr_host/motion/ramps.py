"""Ramps of the playback rate that keep the machine's limits, measured on the rows they make.

A ramp by dr of a plan that cruises at v keeps A and J when it lasts
    D >= 15/8 dr v / A   and   D >= sqrt(10/sqrt(3) dr v / J).
Where the plan itself uses A and J there is less room, so durations about this bound and
moments to begin are tried, soonest settled first; each is measured by finite differences of
the rows it would make, together with those before it. A plan at J or A all the time may have room
for none of them; a smaller change then makes room for the rest of it, since r³ j and r² a
shrink with r.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline

from cdhr_host.motion.flow import UNBOUNDED, FlowLimits
from cdhr_host.motion.hold import RATE_CURVATURE, RATE_SLOPE
from cdhr_host.motion.playback import Pace, played
from cdhr_host.motion.vectors import norms
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Setpoints, ToolTrack

STRETCHES: Final = (0.35, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.45, 1.7, 2.0, 2.5, 3.2, 4.5, 7.0)
"""durations tried, of the bound for cruising"""
WAITS: Final = (0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0)
"""moments tried, of the longest time a plan takes to turn its acceleration round"""
SHORTEST: Final = 4
"""ticks of a ramp"""
LEAST: Final = 0.15
"""change of the rate that every ramp has room for: what landing on a whole tick needs"""
SLACK: Final = 1.001
"""of the jerk, measured over three ticks, that counts as keeping its limit"""
EASED: Final = 1.4
"""times the shortest ramp the air can follow where the plan's own flow is constant"""
ROUNDING: Final = 1e-9
HISTORY: Final = 3
"""rows before a change that its jerk still sees"""
SETTLING: Final = 4
"""rows after a ramp that are measured with it"""

Nozzle = Callable[[Array], ToolTrack]
"""(N,) ticks of the plan -> the nozzle at them, as planned"""
Make = Callable[[int, int], Pace]
"""ticks to wait, ticks to last -> the pace from then on"""


def turning_time(profile: Profile) -> float:
    """s in which a plan can turn its greatest acceleration round."""
    return 2.0 * profile.limits.acceleration_max / profile.limits.jerk_max


def longest(profile: Profile) -> float:
    """s from the wish to the end of the slowest ramp that is tried."""
    return WAITS[-1] * turning_time(profile) + STRETCHES[-1] * bound(
        profile, profile.limits.speed_max, profile.sliders.speed_max, 1.0
    )


def bound(profile: Profile, nozzle: float, slider: float, change: float) -> float:
    """s: the shortest ramp by ``change`` at these cruising speeds, m/s."""
    limits, sliders = profile.limits, profile.sliders
    return max(
        RATE_SLOPE * change * nozzle / limits.acceleration_max,
        math.sqrt(RATE_CURVATURE * change * nozzle / limits.jerk_max),
        RATE_SLOPE * change * slider / sliders.acceleration_max,
        math.sqrt(RATE_CURVATURE * change * slider / sliders.jerk_max),
    )


class Ahead:
    """The plan that lies ahead, and the rows before it, ready to be played in many ways."""

    def __init__(
        self,
        plan: Setpoints,
        before: Setpoints,
        nozzle: Nozzle,
        profile: Profile,
        flow: FlowLimits = UNBOUNDED,
    ) -> None:
        """``plan``: rows of consecutive plan ticks; ``before``: the last rows already fed."""
        self.profile = profile
        self._nozzle = nozzle
        self._first, self._last = int(plan.tick[0]), int(plan.tick[-1])
        self._sliders = CubicSpline(plan.tick, plan.slider) if len(plan) > 1 else None
        self._only = plan.slider[:1]
        self._before = np.hstack([before.nozzle_G, before.slider])[-HISTORY:]
        values, period = np.hstack([plan.nozzle_G, plan.slider]), profile.drives.period
        demands = _demands(values, period)
        self._limits = np.maximum(_limits(profile), demands)
        self.speeds = float(demands[0]), float(demands[3])
        """m/s: the greatest of the nozzle and of a slider"""
        self.pushing = flow.slowest(float(plan.flow.max(initial=0.0)))
        """s: the shortest time in which the air makes the greatest flow from nothing"""

    def excess(self, pace: Pace, first: int) -> float:
        """The greatest share of a limit used by the rows from tick ``first`` on; infinite going backwards."""
        tick = np.arange(first, math.ceil(pace.settled) + SETTLING, dtype=np.float64)
        beat = pace.at(tick)
        if beat.rate.min() < -ROUNDING or beat.rate.max() > 1.0 + ROUNDING:
            return math.inf
        u, period = np.minimum(beat.u, self._last), self.profile.drives.period
        track = played(self._nozzle(u), beat, period)
        sliders = self._only.repeat(len(u), axis=0) if self._sliders is None else self._sliders(u)
        values = np.concatenate((self._before, np.hstack([track.position_G, sliders])))
        demands = _demands(values, period)
        demands[2] /= SLACK
        # The audit looks at speed and acceleration of the moment, not at their mean over a tick.
        demands[0] = max(demands[0], norms(track.velocity).max())
        demands[1] = max(demands[1], norms(track.acceleration).max())
        return float((demands / self._limits).max())


def choices(
    ahead: Ahead, make: Make, first: int, change: float, *, waits: Sequence[float] = WAITS
) -> Iterator[Pace]:
    """Paces from tick ``first`` on that keep the limits, soonest settled first."""
    period, profile = ahead.profile.drives.period, ahead.profile
    least = bound(profile, *ahead.speeds, max(change, LEAST)) / period
    soonest = EASED * RATE_SLOPE * change * ahead.pushing / period
    begins = sorted({round(share * turning_time(profile) / period) for share in waits})
    lasting = sorted({max(SHORTEST, math.ceil(max(stretch * least, soonest))) for stretch in STRETCHES})
    pairs = sorted(((wait, last) for wait in begins for last in lasting), key=lambda pair: (sum(pair), pair))
    for wait, last in pairs:
        pace = make(wait, last)
        if ahead.excess(pace, first) <= 1.0 + ROUNDING:
            yield pace


def _limits(profile: Profile) -> Array:
    """(6,) greatest speed, acceleration and jerk of the nozzle and of a slider."""
    limits, sliders = profile.limits, profile.sliders
    return np.array(
        [
            limits.speed_max,
            limits.acceleration_max,
            limits.jerk_max,
            sliders.speed_max,
            sliders.acceleration_max,
            sliders.jerk_max,
        ]
    )


def _demands(values: Array, period: float) -> Array:
    """(N, 9) m -> (6,) greatest speed, acceleration and jerk of the nozzle and of a slider."""
    found = np.zeros(6)
    for order in range(min(3, len(values) - 1)):
        values = np.diff(values, axis=0) / period
        found[order] = np.sqrt(np.einsum("nk,nk->n", values[:, :3], values[:, :3]).max())
        found[3 + order] = np.abs(values[:, 3:]).max()
    return found
