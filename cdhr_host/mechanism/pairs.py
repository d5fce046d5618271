"""The nine cables: each lower one is a pair, and how it shares its force. Eq. (13), (14).

Attachments of pair i are the mid-point and half the spacing along the tangent on either side:
r_il = R rho_i + s t_i, r_ir = R rho_i - s t_i (Table A1 prints signs that make Eq. (14) singular).
Rest of moments about the platform's centre: D_l f_l + D_r f_r + m = 0 with D_l = [r_il x e_i].
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism.cables import AZIMUTHS, LOWER, Cables, Loads
from cdhr_host.mechanism.kinematics import blocks, components, platform_blocks
from cdhr_host.mechanism.pulley import Vector, Wrap, cross, dot, scaled
from cdhr_host.mechanism.statics import carried, cofactors
from cdhr_host.profile import Profile
from cdhr_host.values import Array

GREATEST_CONDITION = 1e3
"""of Eq. (14); beyond it a moment decides nothing about the shares (1.3 to 2.6 at the reference)"""
SURELY_REGULAR = 100.0
"""product of the columns over the determinant below which no condition number is computed"""


@dataclass(frozen=True, slots=True)
class Pairs:
    """The lower platform's six attachments and what one cable may carry."""

    left: Array
    """(3, 3) m: r_il of pair i in row i"""
    right: Array
    """(3, 3) m: r_ir"""
    least: float
    """N, of a single cable"""
    greatest: float
    """N, of a single cable"""

    @classmethod
    def from_profile(cls, profile: Profile) -> "Pairs":
        """[geometry] spacing and radius, [forces] bounds of single cables."""
        radius, half = profile.geometry.lower_attachment_radius, 0.5 * profile.geometry.pair_spacing
        out = np.array([[np.cos(beta), np.sin(beta), 0.0] for beta in AZIMUTHS])
        along = np.array([[-np.sin(beta), np.cos(beta), 0.0] for beta in AZIMUTHS])
        moved = profile.calibration.arms()[:3]
        return cls(
            left=radius * out + half * along + moved,
            right=radius * out - half * along + moved,
            least=profile.forces.single_min,
            greatest=profile.forces.single_max,
        )


@dataclass(frozen=True, slots=True)
class Shares:
    """Forces of the single cables that hold the lower platform level, N."""

    left: Array
    """(N, 3)"""
    right: Array
    """(N, 3)"""
    moment: Array
    """(N, 3) N m: what is left of the moments; zero unless the bounds bite"""


def shares(
    cables: Cables, pairs: Pairs, lower: Array, pair_force: Array, moment: Array | None = None
) -> Shares:
    """(N, 3) m, (N, 3) N of the pairs, (N, 3) N m -> Shares that add up and balance ``moment``.

    ``moment`` acts on the lower platform from outside (hose, centre of mass off the axis). Eq. (14)
    corrected: f_l = D⁻¹ (D_r f + m), f_r = f - f_l, D = D_r - D_l. Raises MotionError with the
    condition number where D is singular or nearly so, and out of reach.
    """
    left = np.empty_like(lower)
    for rows, wraps in platform_blocks(cables, LOWER, lower):
        force, outside = components(pair_force, rows), None if moment is None else components(moment, rows)
        for i, share in enumerate(left_shares(pairs, wraps, force, outside, rows.start)):
            left[rows, i] = share
    return Shares(left, pair_force - left, np.zeros_like(lower))


def bounded_shares(
    cables: Cables, pairs: Pairs, lower: Array, pair_force: Array, moment: Array | None = None
) -> Shares:
    """As ``shares``, with every single cable inside its bounds and the moment that costs.

    Each cable is moved to its bound and its partner takes the rest of the pair, so that the sums
    (the position of the platform) stay exact and only the tilt suffers. Raises MotionError also
    where a pair's force does not fit its two cables at all.
    """
    free = shares(cables, pairs, lower, pair_force, moment)
    low = np.maximum(pairs.least, pair_force - pairs.greatest)
    high = np.minimum(pairs.greatest, pair_force - pairs.least)
    _require_room(pairs, low, high, pair_force)
    left = np.minimum(np.maximum(free.left, low), high)
    residual = np.empty_like(lower)
    for rows, wraps in platform_blocks(cables, LOWER, lower):
        moved = components(left - free.left, rows)
        tilt = [scaled(arm, -more) for arm, more in zip(_spread(pairs, wraps), moved, strict=True)]
        for axis in range(3):
            residual[rows, axis] = tilt[0][axis] + tilt[1][axis] + tilt[2][axis]
    return Shares(left, pair_force - left, residual)


def nine_tensions(  # noqa: PLR0917 -- the order of Eq. (11)
    cables: Cables,
    loads: Loads,
    pairs: Pairs,
    lower: Array,
    upper: Array,
    lower_acceleration: Array | None = None,
    upper_acceleration: Array | None = None,
    moment: Array | None = None,
) -> Array:
    """(N, 3) each, m, m/s², N m -> (N, 9), N: left 1-3, right 1-3, upper 4-6. Eq. (10)-(14).

    Raises like ``tensions`` and ``shares``.
    """
    found = np.empty((len(lower), 9))
    lower_a = np.zeros_like(lower) if lower_acceleration is None else lower_acceleration
    upper_a = np.zeros_like(upper) if upper_acceleration is None else upper_acceleration
    for rows, wraps in blocks(cables, lower, upper):
        places = components(lower, rows), components(upper, rows)
        motion = components(lower_a, rows), components(upper_a, rows)
        six = carried(loads, wraps, places, motion, rows.start)
        outside = None if moment is None else components(moment, rows)
        left = left_shares(pairs, wraps[:3], (six[0], six[1], six[2]), outside, rows.start)
        for i in range(3):
            found[rows, i] = left[i]
            np.subtract(six[i], left[i], out=found[rows, 3 + i])
            found[rows, 6 + i] = six[3 + i]
    return found


def condition(cables: Cables, pairs: Pairs, lower: Array) -> Array:
    """(N, 3) -> (N,): condition number of D of Eq. (14). Raises MotionError out of reach."""
    return np.asarray(np.linalg.cond(moment_matrix(cables, pairs, lower)), dtype=np.float64)


def moment_matrix(cables: Cables, pairs: Pairs, lower: Array) -> Array:
    """(N, 3) -> (N, 3, 3), m: D = D_r - D_l of Eq. (14). Raises MotionError out of reach."""
    found = np.empty((len(lower), 3, 3))
    for rows, wraps in platform_blocks(cables, LOWER, lower):
        for i, column in enumerate(_spread(pairs, wraps)):
            found[rows, :, i] = np.transpose(column)
    return found


def left_shares(
    pairs: Pairs, wraps: Sequence[Wrap], force: Vector, moment: Vector | None, start: int
) -> tuple[Array, Array, Array]:
    """Three lower cables, the pairs' forces, an outside moment -> forces of the left ones.

    ``start`` is the number of the first sample, for the error's words.
    """
    first, second, third, det = _regular(pairs, wraps, start)
    needed = [scaled(arm, part) for arm, part in zip(_moments(pairs, wraps), force, strict=True)]
    if moment is not None:
        needed.append(moment)
    x, y, z = (sum(parts[1:], parts[0]) for parts in zip(*needed, strict=True))
    total = x / det, y / det, z / det
    return dot(first, total), dot(second, total), dot(third, total)


def sharing(pairs: Pairs, wraps: Sequence[Wrap], start: int) -> tuple[Array, Array]:
    """Three lower cables -> (3, 3, N) of the pairs' forces, (3, 3, N) 1/m of an outside moment.

    Their products with these add up to the forces of the left ones, as ``left_shares`` has them.
    """
    *vectors, det = _regular(pairs, wraps, start)
    by_moment = np.asarray(np.array(vectors) / det, dtype=np.float64)
    by_force = np.einsum("ijn,kjn->ikn", by_moment, np.array(_moments(pairs, wraps)))
    return np.asarray(by_force, dtype=np.float64), by_moment


def _regular(pairs: Pairs, wraps: Sequence[Wrap], start: int) -> tuple[Vector, Vector, Vector, Array]:
    """Cofactors and determinant of D; raises MotionError where it is nearly singular."""
    columns = _spread(pairs, wraps)
    first, second, third, det = cofactors(*columns)
    _require_regular(columns, det, start)
    return first, second, third, det


def _moments(pairs: Pairs, wraps: Sequence[Wrap]) -> list[Vector]:
    """The columns of D_r: r_ir x e_i, m."""
    return [cross(arm, wrap.direction()) for arm, wrap in zip(_rows(pairs.right), wraps, strict=True)]


def _spread(pairs: Pairs, wraps: Sequence[Wrap]) -> list[Vector]:
    """The columns of D: (r_ir - r_il) x e_i, m."""
    return [
        cross(arm, wrap.direction()) for arm, wrap in zip(_rows(pairs.right - pairs.left), wraps, strict=True)
    ]


def _rows(arms: Array) -> list[Vector]:
    return [(x, y, z) for x, y, z in arms]


def _require_regular(columns: Sequence[Vector], det: Array, start: int) -> None:
    """det against the columns' lengths first; the condition number only where that is small."""
    sizes = [dot(column, column) for column in columns]
    doubtful = np.flatnonzero(~(SURELY_REGULAR * np.abs(det) > np.sqrt(sizes[0] * sizes[1] * sizes[2])))
    if not len(doubtful):
        return
    matrix = np.transpose([[part[doubtful] for part in column] for column in columns], (2, 1, 0))
    conditions = np.where(np.isfinite(matrix).all(axis=(1, 2)), np.linalg.cond(matrix), np.inf)
    worst = int(np.argmax(conditions))
    if not conditions[worst] < GREATEST_CONDITION:
        raise MotionError(
            Problem(
                "singular",
                f"the pairs cannot balance a moment at sample {start + int(doubtful[worst])}: "
                f"condition number {conditions[worst]:.3g}",
                value=float(conditions[worst]),
                limit=GREATEST_CONDITION,
                hint="the two attachments of a pair must lie along the tangent, and the platform "
                "between the planes of the pulleys",
            )
        )


def _require_room(pairs: Pairs, low: Array, high: Array, force: Array) -> None:
    tight = low > high
    if tight.any():
        sample, pair = (int(place) for place in np.argwhere(tight)[0])
        value = float(force[sample, pair])
        limit = 2.0 * (pairs.least if value < 2.0 * pairs.least else pairs.greatest)
        raise MotionError(
            Problem(
                "force",
                f"pair {pair + 1} carries {value:.4g} N at sample {sample}: "
                f"no share keeps both cables within {pairs.least:g} to {pairs.greatest:g} N",
                value=value,
                limit=limit,
                unit="N",
                hint="another spring force, or other bounds in [forces]",
            )
        )
