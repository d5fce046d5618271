"""A stop that stays on the path: playback time is ramped to rest.

With the plan x(u) and playback time u(t), rate r = du/dt, the machine does
    x'  = r v
    x'' = r² a + r' v
    x''' = r³ j + 3 r r' a + r'' v.
The ramp r = 1 - (10 z³ - 15 z⁴ + 6 z⁵), z = t / D, is C2 at both ends, has
|r'| <= 15/8 / D and |r''| <= 10/sqrt(3) / D², and plays D/2 of the plan. Where the plan
cruises (a = j = 0) the limits A and J therefore hold for
    D >= 15/8 v / A   and   D >= sqrt(10/sqrt(3) v / J).
Where the plan itself brakes there is less room: at r = 1 none at all, whatever D. So a few
starts and durations around this bound are tried, soonest rest first, each is measured by
finite differences of its own rows, and the first that keeps the limits is taken; if none
does, the gentlest. Plans that leave a tenth of A and J unused are always stopped within A
and J; one that runs at J all the time (short moves, tight circles) may see some 15 % more
jerk while it stops.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline

from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Ints, Setpoints

RATE_SLOPE: Final = 15.0 / 8.0
"""greatest |dr/dz| of the ramp"""
RATE_CURVATURE: Final = 10.0 / math.sqrt(3.0)
"""greatest |d²r/dz²| of the ramp"""
STRETCHES: Final = (0.35, 0.5, 0.7, 0.85, 1.0, 1.15, 1.35, 1.6, 2.0, 2.5, 3.0)
"""durations tried, of the bound for cruising"""
STARTS: Final = 8
"""moments tried at which the ramp begins"""
SLACK: Final = 1.01
"""excess over a limit that counts as keeping it"""
STANDSTILL: Final = 1e-4
"""m/s below which a slider stands"""


def rows_needed(profile: Profile) -> int:
    """Rows ahead with which ``path_true_stop`` can stop any plan of this profile's speeds."""
    longest = STRETCHES[-1] * _duration(profile, profile.limits.speed_max, profile.sliders.speed_max)
    return math.ceil((longest_wait(profile) + longest / 2.0) / profile.drives.period) + 2


def ends_at_rest(slider: Array, profile: Profile) -> bool:
    """(N, 6) m, N >= 2: whether the last row stands: slower than STANDSTILL, or than jerk T²/6.

    The second is what the last tick of a jerk-limited stop may still have.
    """
    period = profile.drives.period
    slow = max(STANDSTILL, profile.sliders.jerk_max * period**2 / 6.0)
    return bool(np.abs(slider[-1] - slider[-2]).max() <= slow * period)


def path_true_stop(ahead: Setpoints, profile: Profile) -> Setpoints:
    """Planned rows from the next tick on -> the rows to play instead: on the path, to rest.

    The air is off and the flow 0 from the first row. Needs ``rows_needed`` rows, or all up to
    rest; with fewer the stop is as gentle as they allow. Rows beyond are not looked at, so that
    both ends of a link find the same stop.
    """
    ahead = ahead[: rows_needed(profile)]
    if len(ahead) < 2:
        return _silent(ahead, np.arange(len(ahead), dtype=np.float64), profile)
    plan = _Plan.of(ahead, profile)
    best, least = np.zeros(1), math.inf
    for start, ramp in _candidates(plan, profile):
        played = np.minimum(_playback(start, ramp), len(ahead) - 1.0)
        excess = plan.excess(played)
        if excess < least:
            best, least = played, excess
        if excess <= SLACK:
            break
    return _silent(ahead, _until_end(best, len(ahead) - 1.0), profile)


def _duration(profile: Profile, nozzle_speed: float, slider_speed: float) -> float:
    """S: the bound for cruising at these speeds."""
    return max(
        RATE_SLOPE * nozzle_speed / profile.limits.acceleration_max,
        math.sqrt(RATE_CURVATURE * nozzle_speed / profile.limits.jerk_max),
        RATE_SLOPE * slider_speed / profile.sliders.acceleration_max,
    )


def longest_wait(profile: Profile) -> float:
    """S for which a stop's ramp may wait: for the plan's own change of acceleration to be over."""
    return 2.0 * profile.limits.acceleration_max / profile.limits.jerk_max


@dataclass(frozen=True, slots=True)
class _Plan:
    """Nozzle (columns 0-2) and sliders (3-8) over playback time in rows, and what they may do."""

    curve: CubicSpline
    rests: bool
    rows: int
    speeds: tuple[float, float]
    period: float
    limits: Array

    @classmethod
    def of(cls, ahead: Setpoints, profile: Profile) -> "_Plan":
        values = np.hstack([ahead.nozzle_G, ahead.slider])
        period = profile.drives.period
        limits = np.array(
            [profile.limits.acceleration_max, profile.limits.jerk_max, profile.sliders.acceleration_max]
        )
        step = np.diff(values, axis=0) / period
        return cls(
            CubicSpline(np.arange(len(ahead)), values),
            ends_at_rest(ahead.slider, profile),
            len(ahead),
            (float(np.linalg.norm(step[:, :3], axis=1).max()), float(np.abs(step[:, 3:]).max())),
            period,
            np.maximum(limits, _demands(values, period)),
        )

    def excess(self, played: Array) -> float:
        """Greatest demand of this playback as a share of what is allowed."""
        return float((_demands(self.curve(played), self.period) / self.limits).max())


def _demands(values: Array, period: float) -> Array:
    """(N, 9) -> (3,) greatest nozzle acceleration, nozzle jerk and slider acceleration."""
    if len(values) < 4:
        return np.zeros(3)
    second = np.diff(values, n=2, axis=0) / period**2
    third = np.diff(second[:, :3], axis=0) / period
    return np.array(
        [
            np.linalg.norm(second[:, :3], axis=1).max(),
            np.linalg.norm(third, axis=1).max(),
            np.abs(second[:, 3:]).max(),
        ]
    )


def _candidates(plan: _Plan, profile: Profile) -> list[tuple[int, int]]:
    """(rows played before the ramp, rows of the ramp), soonest rest first, within the plan."""
    bound = _duration(profile, *plan.speeds) / plan.period
    waits = np.linspace(0.0, longest_wait(profile) / plan.period, STARTS)
    starts = {int(wait) for wait in waits}
    ramps = {max(2, math.ceil(stretch * bound)) for stretch in STRETCHES}
    pairs = {(start, ramp) for start in starts for ramp in ramps}
    if not plan.rests:
        last = plan.rows - 1
        pairs = {pair for pair in pairs if pair[0] + pair[1] / 2.0 <= last} | {(0, 2 * last)}
    return sorted(pairs, key=lambda pair: (sum(pair), pair))


def _playback(start: int, ramp: int) -> Array:
    """(start + ramp + 2,) playback time in rows; the last two are equal: at rest."""
    n = np.arange(start + ramp + 2, dtype=np.float64)
    z = np.clip((n - start) / ramp, 0.0, 1.0)
    ramped = ramp * (z - z**4 * (2.5 - 3.0 * z + z * z))
    return np.asarray(np.minimum(n, start) + ramped, dtype=np.float64)


def _until_end(played: Array, end: float) -> Array:
    """Without the rows after the second one that is at the plan's end."""
    return played[: int(np.searchsorted(played, end)) + 2]


def _silent(ahead: Setpoints, played: Array, profile: Profile) -> Setpoints:
    """The plan at the playback times ``played``, in rows, with the air off."""
    tick: Ints = ahead.tick[:1] + np.arange(len(played), dtype=np.int64)
    columns = ahead.nozzle_G, ahead.upper, ahead.slider, ahead.tension
    borders = np.cumsum([each.shape[1] for each in columns])[:-1]
    nozzle_G, upper, slider, tension = np.split(_at(np.hstack(columns), played), borders, axis=1)
    return Setpoints(
        tick=tick,
        t=np.asarray(tick * profile.drives.period, dtype=np.float64),
        line=ahead.line[played.astype(np.int64)],
        nozzle_G=nozzle_G,
        upper=upper,
        slider=slider,
        tension=tension,
        flow=np.zeros(len(played)),
        pressure=np.zeros(len(played)),
    )


def _at(values: Array, played: Array) -> Array:
    """(N, k) plan, (M,) playback times -> (M, k): a C2 cubic spline, exact on the plan's rows."""
    if len(values) < 2:
        return values[played.astype(np.int64)]
    return np.asarray(CubicSpline(np.arange(len(values)), values)(played), dtype=np.float64)
