"""Pose to cable lengths: Eq. (1)-(5), (8)-(10), in blocks that stay in the cache.

Displacements q are of a platform from the reference pose, in m.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism.cables import LOWER, UPPER, Cables
from cdhr_host.mechanism.pulley import PointWrap, Vector, Wrap, dot
from cdhr_host.units import MM
from cdhr_host.values import Array

BLOCK = 4096
"""samples worked on at a time"""
Motion = tuple[Array, Array]
"""displacement, m, and velocity, m/s, of a platform, (N, 3) each"""


def lengths(cables: Cables, lower: Array, upper: Array) -> Array:
    """(N, 3), (N, 3) -> (N, 6): cable lengths, m. Eq. (4), (5), (8), (9).

    Raises MotionError where a platform is not between the pulleys.
    """
    found = np.empty((len(lower), 6))
    for rows, wraps in blocks(cables, lower, upper):
        for i, wrap in enumerate(wraps):
            found[rows, i] = wrap.length()
    return found


def lengths_and_rates(cables: Cables, lower: Motion, upper: Motion) -> tuple[Array, Array]:
    """Displacements and velocities (N, 3) of the platforms -> lengths, m, and their rates, m/s, (N, 6).

    l' = -e·v. Raises like ``lengths``.
    """
    length, rate = np.empty((2, len(lower[0]), 6))
    for rows, wraps in blocks(cables, lower[0], upper[0]):
        velocities = components(lower[1], rows), components(upper[1], rows)
        for i, wrap in enumerate(wraps):
            length[rows, i] = wrap.length()
            rate[rows, i] = -dot(wrap.direction(), velocities[0 if i in LOWER else 1])
    return length, rate


def uncompensated_lengths(cables: Cables, lower: Array, upper: Array) -> Array:
    """(N, 3), (N, 3) -> (N, 6): |BA|, m, as if the cables ended in points. Raises like ``lengths``."""
    return lengths(cables.with_pulley(PointWrap), lower, upper)


def jacobian(cables: Cables, lower: Array, upper: Array) -> Array:
    """(N, 3), (N, 3) -> (N, 6, 3): dl/dq of the platform each cable holds, -e. Raises like ``lengths``."""
    found = np.empty((len(lower), 6, 3))
    for rows, wraps in blocks(cables, lower, upper):
        for i, wrap in enumerate(wraps):
            for axis, part in enumerate(wrap.direction()):
                np.negative(part, out=found[rows, i, axis])
    return found


def slider(cables: Cables, length: Array) -> Array:
    """(N, 6) -> (N, 6): slider positions, m: length minus length at the reference; positive is paid out."""
    return length - cables.reference_lengths


def reachable(cables: Cables, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """(N, 3), (N, 3) -> (N,): both platforms between the pulley planes, clear of every swivel axis."""
    found = np.empty(len(lower), dtype=np.bool_)
    for rows in block_rows(len(lower)):
        wraps = six_wraps(cables, components(lower, rows), components(upper, rows))
        found[rows] = np.min([wrap.reach() for wrap in wraps], axis=0) > 0.0
    return found


def blocks(cables: Cables, lower: Array, upper: Array) -> Iterator[tuple[slice, list[Wrap]]]:
    """Slices of the samples with their six cables, all within reach; raises MotionError otherwise."""
    for rows in block_rows(len(lower)):
        wraps = six_wraps(cables, components(lower, rows), components(upper, rows))
        _require_reach(wraps, rows.start)
        yield rows, wraps


def platform_blocks(cables: Cables, which: Sequence[int], q: Array) -> Iterator[tuple[slice, list[Wrap]]]:
    """Slices of the samples with the cables ``which`` of one platform; raises MotionError out of reach."""
    for rows in block_rows(len(q)):
        wraps = wraps_of(cables, which, components(q, rows))
        _require_reach(wraps, rows.start, which[0])
        yield rows, wraps


def block_rows(count: int) -> Iterator[slice]:
    """Slices that cover ``count`` samples in turn."""
    return (slice(start, min(start + BLOCK, count)) for start in range(0, count, BLOCK))


def components(points: Array, rows: slice) -> Vector:
    """(N, 3) and a slice -> contiguous x, y, z of those rows."""
    x, y, z = np.ascontiguousarray(points[rows].T, dtype=np.float64)
    return x, y, z


def wraps_of(cables: Cables, which: Sequence[int], q: Vector) -> list[Wrap]:
    """The cables ``which`` of one platform displaced by q."""
    return [_wrap(cables, i, q) for i in which]


def six_wraps(cables: Cables, lower: Vector, upper: Vector) -> list[Wrap]:
    """All six cables with the platforms displaced by ``lower`` and ``upper``."""
    return wraps_of(cables, LOWER, lower) + wraps_of(cables, UPPER, upper)


def _require_reach(wraps: Sequence[Wrap], start: int, first: int = 0) -> None:
    """``start`` is the number of the first sample, ``first`` of the first cable, for the error's words."""
    for i, wrap in enumerate(wraps, first):
        reach = wrap.reach()
        if not reach.min() > 0.0:
            raise MotionError(_out_of_reach(i, reach, start))


def _wrap(cables: Cables, i: int, q: Vector) -> Wrap:
    x, y, z = cables.anchors[i] - cables.attachments[i]
    sign, azimuth = float(cables.signs[i]), float(cables.azimuths[i])
    with np.errstate(invalid="ignore"):
        return cables.pulley(x - q[0], y - q[1], z - q[2], sign, cables.pulley_radius, azimuth)


def _out_of_reach(i: int, reach: Array, start: int) -> Problem:
    worst = int(np.argmin(np.where(np.isnan(reach), -np.inf, reach)))
    value = float(reach[worst]) / MM
    platform = "lower" if i in LOWER else "upper"
    return Problem(
        "reach",
        f"cable {i + 1} cannot reach the {platform} platform at sample {start + worst}: "
        f"it would be {-value:.3f} mm beyond the plane or the axis of its pulley",
        value=value,
        limit=0.0,
        unit="mm",
        hint="keep both platforms between the lower and the upper pulleys and away from each pulley's axis",
    )
