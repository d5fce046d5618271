"""Motion from forces, forces as affine in motion, and how tensions change with the pose. Eq. (10)-(12).

All of it treats the platforms as two points, each with three cables, and the spring between them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdhr_host.mechanism.cables import GRAVITY, LOWER, UPPER, Cables, Loads
from cdhr_host.mechanism.kinematics import blocks, components, jacobian
from cdhr_host.mechanism.pairs import Pairs, sharing
from cdhr_host.mechanism.pulley import Vector, Wrap
from cdhr_host.mechanism.statics import answers, carried, spring_force, tensions
from cdhr_host.values import Array

UNITS = np.eye(3)


@dataclass(frozen=True, slots=True)
class AffineTensions:
    """Tensions at N poses as ``rest + gain · acceleration``: K lower cables, three upper ones."""

    rest: Array
    """(N, K + 3) N: at rest"""
    lower: Array
    """(N, K, 3) kg: per acceleration of the lower platform"""
    upper: Array
    """(N, 3, 3) kg: per acceleration of the upper platform"""

    def at(self, lower_acceleration: Array, upper_acceleration: Array) -> Array:
        """(N, 3), (N, 3) m/s² -> (N, K + 3) N."""
        below = np.einsum("nij,nj->ni", self.lower, lower_acceleration)
        above = np.einsum("nij,nj->ni", self.upper, upper_acceleration)
        return np.asarray(self.rest + np.hstack([below, above]), dtype=np.float64)


def accelerations(
    cables: Cables, loads: Loads, lower: Array, upper: Array, tension: Array
) -> tuple[Array, Array]:
    """(N, 3), (N, 3), (N, 6) N -> (N, 3), (N, 3): q'' of both platforms, m/s², from Eq. (11), (12).

    Raises MotionError out of reach or where the platforms meet.
    """
    pulls = -jacobian(cables, lower, upper)
    forces = np.einsum("nij,ni->nij", pulls, tension)
    everywhere = slice(0, len(lower))
    spring = np.transpose(spring_force(loads, components(lower, everywhere), components(upper, everywhere)))
    weight = GRAVITY * UNITS[2]
    below = (forces[:, :3].sum(axis=1) + spring) / loads.lower_mass - weight
    above = (forces[:, 3:].sum(axis=1) - spring) / loads.upper_mass - weight
    return below, above


def affine_tensions(cables: Cables, loads: Loads, lower: Array, upper: Array) -> AffineTensions:
    """(N, 3), (N, 3) -> AffineTensions of the six equivalent cables. Raises like ``tensions``."""
    rest, below, above = (np.empty((*shape, len(lower))) for shape in ((6,), (3, 3), (3, 3)))
    for rows, wraps in blocks(cables, lower, upper):
        rest[:, rows] = _resting(loads, wraps, lower, upper, rows)
        below[:, :, rows], above[:, :, rows] = _gains(loads, wraps, rows.start)
    return AffineTensions(rest.T, below.transpose(2, 0, 1), above.transpose(2, 0, 1))


def affine_nine_tensions(  # noqa: PLR0917 -- the order of nine_tensions
    cables: Cables, loads: Loads, pairs: Pairs, lower: Array, upper: Array, moment: Array | None = None
) -> AffineTensions:
    """As ``affine_tensions`` for left 1-3, right 1-3, upper 4-6. Raises like ``nine_tensions``."""
    rest, below, above = (np.empty((*shape, len(lower))) for shape in ((9,), (6, 3), (3, 3)))
    for rows, wraps in blocks(cables, lower, upper):
        six = _resting(loads, wraps, lower, upper, rows)
        by_force, by_moment = sharing(pairs, wraps[:3], rows.start)
        left = np.einsum("ijn,jn->in", by_force, six[:3])
        if moment is not None:
            left += np.einsum("ijn,nj->in", by_moment, moment[rows])
        rest[:, rows] = np.concatenate((left, six[:3] - left, six[3:]))
        whole, above[:, :, rows] = _gains(loads, wraps, rows.start)
        part = np.einsum("ijn,jkn->ikn", by_force, whole)
        below[:3, :, rows], below[3:, :, rows] = part, whole - part
    return AffineTensions(rest.T, below.transpose(2, 0, 1), above.transpose(2, 0, 1))


def _resting(loads: Loads, wraps: Sequence[Wrap], lower: Array, upper: Array, rows: slice) -> Array:
    """(6, N) N at rest, in some rows of the samples."""
    places = components(lower, rows), components(upper, rows)
    still = np.zeros_like(places[0])
    x, y, z = still
    return np.array(carried(loads, wraps, places, ((x, y, z), (x, y, z)), rows.start))


def _gains(loads: Loads, wraps: Sequence[Wrap], start: int) -> tuple[Array, Array]:
    """(3, 3, N) kg each: of the lower and the upper cables, by their platform's acceleration."""
    return loads.lower_mass * answers(wraps[:3], start), loads.upper_mass * answers(wraps[3:], start)


def tension_slopes(  # noqa: PLR0917 -- the order of Eq. (11)
    cables: Cables,
    loads: Loads,
    lower: Array,
    upper: Array,
    lower_acceleration: Array | None = None,
    upper_acceleration: Array | None = None,
) -> tuple[Array, Array]:
    """(N, 3) each -> (N, 6, 3), (N, 6, 3): df/dq of the lower and of the upper platform, N/m.

    At constant accelerations: from J f = b follows J df = db - dJ f, and de/dq = -d²l/dq².
    Raises like ``tensions``.
    """
    force = tensions(cables, loads, lower, upper, lower_acceleration, upper_acceleration)
    stiff = tension_stiffness(cables, loads, lower, upper, force)
    pulls = -jacobian(cables, lower, upper).transpose(0, 2, 1)
    below, above = _inverse(pulls[:, :, :3]), _inverse(pulls[:, :, 3:])
    by_lower = np.concatenate([below @ stiff[:, :3, :3], above @ stiff[:, 3:, :3]], axis=1)
    by_upper = np.concatenate([below @ stiff[:, :3, 3:], above @ stiff[:, 3:, 3:]], axis=1)
    return by_lower, by_upper


def tension_stiffness(cables: Cables, loads: Loads, lower: Array, upper: Array, force: Array) -> Array:
    """(N, 3), (N, 3), (N, 6) N -> (N, 6, 6) N/m: -dF/dq with the tensions held, lower platform first.

    Tension against the bending of the cables' directions, and the spring. Raises like ``tensions``.
    """
    found = np.zeros((len(lower), 6, 6))
    for rows, wraps in blocks(cables, lower, upper):
        bent = curvatures(wraps)
        for platform, which in enumerate((LOWER, UPPER)):
            part = slice(3 * platform, 3 * platform + 3)
            found[rows, part, part] = np.einsum("ni,nijk->njk", force[rows][:, list(which)], bent[:, part])
    spring = spring_stiffness(loads, upper - lower)
    found[:, :3, :3] += spring
    found[:, 3:, 3:] += spring
    found[:, :3, 3:] -= spring
    found[:, 3:, :3] -= spring
    return found


def spring_stiffness(loads: Loads, offset: Array) -> Array:
    """(N, 3) m between the platforms' displacements -> (N, 3, 3) N/m: of the force on either platform."""
    span = offset + np.array([*loads.aside, loads.separation])
    size = np.linalg.norm(span, axis=1)[:, None, None]
    along = span[:, :, None] * span[:, None, :] / size**2
    slack = loads.rest_length / size
    return np.asarray(loads.stiffness * ((1.0 - slack) * UNITS + slack * along), dtype=np.float64)


def curvatures(wraps: list[Wrap]) -> Array:
    """K cables at N poses -> (N, K, 3, 3) 1/m: d²l/dq², from their bending along six directions."""
    return np.stack([_curvature(wrap) for wrap in wraps], axis=1)


def _inverse(matrix: Array) -> Array:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def _curvature(wrap: Wrap) -> Array:
    size = len(wrap.length())
    found = np.empty((size, 3, 3))
    for j in range(3):
        found[:, j, j] = wrap.bending(_constant(UNITS[j], size))
    for j, k in ((0, 1), (0, 2), (1, 2)):
        both = wrap.bending(_constant(UNITS[j] + UNITS[k], size))
        found[:, j, k] = found[:, k, j] = 0.5 * (both - found[:, j, j] - found[:, k, k])
    return found


def _constant(vector: Array, size: int) -> Vector:
    x, y, z = (np.full(size, part) for part in vector)
    return x, y, z
