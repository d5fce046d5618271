"""What bounds the speed: the profile's limits, applied to stretches of the path.

With the path q(s) and the time law s(t), the nozzle has

    velocity      q' s'
    acceleration  q'' s'² + q' s''
    jerk          q''' s'³ + 3 q'' s' s'' + q' s'''

and |q'| <= 1. A cell is a stretch of path with one set of bounds on s', s'' and s''' such
that the nozzle's limits hold whatever the time law does inside them: a straight cell gives
the whole budget to s'' and s'''; a bent one keeps most of it for the bend.
"""

from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism import UpperBounds
from cdhr_host.motion.flow import UNBOUNDED, FlowLimits
from cdhr_host.motion.shaping import Shaper, shaper
from cdhr_host.motion.smooth_path import SmoothPath
from cdhr_host.profile import Profile
from cdhr_host.units import MM
from cdhr_host.values import Array, Flags, Ints

SHARES = (0.9, 0.75, 0.5, 0.25, 0.1)
"""Shares of the budget a bent cell may spend on changing speed, tried in this order."""
NEARLY = 0.97
"""A share is good enough when it keeps this part of the speed the cell would otherwise allow."""
LONG_RUN = 4.0
"""A bend longer than this many half-widths must let the speed change inside it."""
CELL = 2.0
"""Length of the cells of a long bend, in half-widths."""
NEWTON_STEPS = 6
"""From the nearer of two bounds, less than 1.5 times the root, these reach it to rounding."""
MERGE = 0.1
"""m, cells are merged up to this length, so that a long path has borders to stop at."""
TOUCHING = 1e-12
"""m, less is rounding."""
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

    def within(self, tolerance: float) -> "MotionLimits":
        """The same limits with the smoothing that a tolerance (m) allows."""
        return replace(self, half_width=half_width(max(tolerance - self.shaped, tolerance / 2)))


def half_width(tolerance: float) -> float:
    """m -> m: the kernel deviates by a third of its half-width; CHORD_ERROR is left for curves' chords."""
    return 3.0 * (tolerance - CHORD_ERROR)


@dataclass(frozen=True, slots=True)
class Cells:
    """K stretches of path in order, each with bounds on ds/dt and its derivatives."""

    start: Array
    """(K,) m in s"""
    length: Array
    """(K,) m in s"""
    speed: Array
    """(K,) m/s, greatest s'"""
    acceleration: Array
    """(K,) m/s², greatest |s''|; 0 where the speed must stay constant"""
    jerk: Array
    """(K,) m/s³, greatest |s'''|; 0 where the speed must stay constant"""
    settled: float
    """m in s: cells before it keep their bounds whatever path follows"""
    bent: Flags
    """(K,) whether the cell lies in a long bend"""

    def first(self, count: int) -> "Cells":
        """The first cells only."""
        return Cells(
            self.start[:count],
            self.length[:count],
            self.speed[:count],
            self.acceleration[:count],
            self.jerk[:count],
            self.settled,
            self.bent[:count],
        )


@dataclass(frozen=True, slots=True)
class _Pieces:
    """Path pieces between two places, with what bounds the speed on them."""

    start: Array
    length: Array
    feed: Array
    share: Array
    bend: Array
    change: Array
    bent: Flags


def cells(
    path: SmoothPath,
    feed: Array,
    span: tuple[float, float],
    limits: MotionLimits,
    *,
    share: Array,
    passed: float,
    inside: bool,
) -> Cells:
    """Cells of a path over a span of s.

    ``feed`` (K,) m/s is the programmed speed on each piece, ``share`` (K,) of acceleration and
    jerk what the air leaves for changing it; ``inside`` says that the span
    begins inside a long bend begun earlier. A leg is divided where its length, of which
    ``passed`` (m) lies before s = 0, is a multiple of a cell's; so it is divided alike
    whenever it is planned again, and what could be braked from a border still can.
    """
    pieces = _between(path, feed, share, span)
    group, roomy = _groups(pieces, limits.half_width, passed, inside=inside)
    heads = np.flatnonzero(np.diff(group, prepend=group[0] - 1))
    cap = np.minimum(np.minimum.reduceat(pieces.feed, heads), limits.speed)
    bend = np.maximum.reduceat(pieces.bend, heads)
    change = np.maximum.reduceat(pieces.change, heads)
    left = np.minimum.reduceat(pieces.share, heads)
    cap = np.minimum(cap, _pushed_speed(bend, left, limits))
    speed, spent = _budget(cap, bend, change, roomy[heads], limits)
    share = np.minimum(spent, left)
    settled = pieces.start[heads[-1]] if pieces.bent[-1] else span[1]
    merged = _merge_heads(pieces.start[heads] + passed, speed, share)
    length = np.add.reduceat(np.add.reduceat(pieces.length, heads), merged)
    heads, share = heads[merged], share[merged]
    a, j = share * limits.acceleration, share * limits.jerk
    return Cells(pieces.start[heads], length, speed[merged], a, j, float(settled), roomy[heads])


def _between(path: SmoothPath, feed: Array, share: Array, span: tuple[float, float]) -> _Pieces:
    """The pieces of a path that lie in a span of s, cut at its ends."""
    ends = np.append(path.start[1:], path.end)
    first = span[0] + min(TOUCHING, (span[1] - span[0]) / 2)
    used = np.flatnonzero((ends > first) & (path.start < span[1]))
    start = np.maximum(path.start[used], span[0])
    bend, change = (bound[used] for bound in path.bounds())
    length = np.minimum(ends[used], span[1]) - start
    return _Pieces(start, length, feed[used], share[used], bend, change, path.bending[used] > 0)


def _groups(pieces: _Pieces, h: float, passed: float, *, inside: bool) -> tuple[Ints, Flags]:
    """(K,) cell number of each piece, and whether its bend is long.

    A short bend is one cell, a long one many; straights split where the feed changes, and
    every MERGE.
    """
    bent, start = pieces.bent, pieces.start
    run = np.cumsum(np.diff(bent, prepend=bent[0]) != 0)
    heads = np.flatnonzero(np.diff(run, prepend=-1))
    run_length = np.add.reduceat(pieces.length, heads)[run]
    roomy = bent & (run_length > LONG_RUN * h)
    if inside:
        roomy |= bent & (run == 0)
    part = np.where(roomy, _multiples(start + passed, CELL * h), 0.0)
    part = np.where(bent, part, np.cumsum(np.diff(pieces.feed, prepend=pieces.feed[0]) != 0))
    stretch = np.where(bent, 0.0, _multiples(start + passed, MERGE))
    columns = np.stack((run, part, stretch))
    change = (np.diff(columns, prepend=columns[:, :1]) != 0).any(axis=0)
    return np.cumsum(change), roomy


def _budget(
    cap: Array, bend: Array, change: Array, roomy: Flags, limits: MotionLimits
) -> tuple[Array, Array]:
    """(K,) speed and share of the acceleration and jerk budget each cell may spend on s'' and s'''."""
    straight = bend == 0
    steady = np.minimum(cap, _bend_speed(bend, change, 0.0, limits))
    speed, share = steady, np.where(straight, 1.0, 0.0)
    undecided = ~straight
    for candidate in SHARES:
        reached = np.minimum(cap, _bend_speed(bend, change, candidate, limits))
        last = roomy if candidate == SHARES[-1] else np.zeros_like(roomy)
        good = undecided & ((reached >= NEARLY * steady) | last)
        speed, share = np.where(good, reached, speed), np.where(good, candidate, share)
        undecided &= ~good
    return speed, share


def _pushed_speed(bend: Array, share: Array, limits: MotionLimits) -> Array:
    """(K,) m/s: greatest s' in a bend whose slowing down the air can follow with its ``share``.

    A corner turned by theta is cut, so that |q'| falls to cos(theta/2) in its middle: along the path
    q'' is up to |q''| sin(theta/2). A corner with the usual kernel has sin(theta/2) = |q''| h/2, a
    wider kernel of its own (h = 2 h0/theta) about the root of |q''| h0/2, which is the greater one.
    """
    with np.errstate(divide="ignore"):
        sine = np.sqrt(np.minimum(1.0, bend * limits.half_width / 2.0))
        return np.asarray(np.sqrt(share * limits.acceleration / (bend * sine)))


def _bend_speed(bend: Array, change: Array, share: float, limits: MotionLimits) -> Array:
    """(K,) m/s: greatest s' in a bend when ``share`` of the budgets goes to s'' and s'''.

    |q''| v² + share A <= A, and |q'''| v³ + 3 |q''| v share A + share J <= J, whose rising
    convex cubic Newton's method solves from above.
    """
    linear, rest = 3 * bend * share * limits.acceleration, (1 - share) * limits.jerk
    with np.errstate(divide="ignore", invalid="ignore"):
        by_acceleration = np.sqrt((1 - share) * limits.acceleration / bend)
        root = np.minimum(np.cbrt(rest / change), rest / linear)
        for _ in range(NEWTON_STEPS if share else 0):
            root -= (change * root**3 + linear * root - rest) / (3 * change * root**2 + linear)
    return np.fmin(by_acceleration, root)


def _merge_heads(start: Array, speed: Array, share: Array) -> Ints:
    """First of each row of neighbouring cells with the same bounds, none longer than MERGE."""
    differs = (np.diff(speed, prepend=-1.0) != 0) | (np.diff(share, prepend=-1.0) != 0)
    stretch = _multiples(start, MERGE)
    return np.flatnonzero(differs | (np.diff(stretch, prepend=stretch[0] - 1.0) != 0))


def _multiples(length: Array, cell: float) -> Array:
    """(K,) m, m -> (K,): whole cells before each length; what rounding has put before a border is on it."""
    cells: Array = np.floor((length + TOUCHING) / cell)
    return cells
