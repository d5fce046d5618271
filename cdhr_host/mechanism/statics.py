"""Forces: the tensions that hold and accelerate both platforms, Eq. (10)-(12)."""

from collections.abc import Sequence

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism.cables import GRAVITY, Cables, Loads
from cdhr_host.mechanism.kinematics import blocks, components
from cdhr_host.mechanism.pulley import Vector, Wrap, cross, dot
from cdhr_host.values import Array

LEAST_DETERMINANT = 1e-12
"""of three cable directions; below it no tensions follow from the load"""


def tensions(  # noqa: PLR0917 -- the order of Eq. (11)
    cables: Cables,
    loads: Loads,
    lower: Array,
    upper: Array,
    lower_acceleration: Array | None = None,
    upper_acceleration: Array | None = None,
) -> Array:
    """(N, 3) each, m and m/s² -> (N, 6): tensions, N, from J F + Fk + G = M q''. Eq. (11), (12).

    Without accelerations the platforms rest. Raises MotionError out of reach, at a singular
    pose, or where the platforms meet.
    """
    found = np.empty((len(lower), 6))
    lower_a = np.zeros_like(lower) if lower_acceleration is None else lower_acceleration
    upper_a = np.zeros_like(upper) if upper_acceleration is None else upper_acceleration
    for rows, wraps in blocks(cables, lower, upper):
        places = components(lower, rows), components(upper, rows)
        motion = components(lower_a, rows), components(upper_a, rows)
        for i, tension in enumerate(carried(loads, wraps, places, motion, rows.start)):
            found[rows, i] = tension
    return found


def carried(
    loads: Loads,
    wraps: Sequence[Wrap],
    places: tuple[Vector, Vector],
    accelerations: tuple[Vector, Vector],
    start: int,
) -> tuple[Array, ...]:
    """Six wraps, displacements and accelerations of both platforms -> six (N,) tensions, N.

    ``start`` is the number of the first sample, for the error's words.
    """
    spring = spring_force(loads, *places, start)
    lower, upper = accelerations
    below = [part * loads.lower_mass - pulled for part, pulled in zip(lower, spring, strict=True)]
    above = [part * loads.upper_mass + pulled for part, pulled in zip(upper, spring, strict=True)]
    below[2] += loads.lower_mass * GRAVITY
    above[2] += loads.upper_mass * GRAVITY
    return (
        *_pull(wraps[:3], (below[0], below[1], below[2]), start),
        *_pull(wraps[3:], (above[0], above[1], above[2]), start),
    )


def spring_force(loads: Loads, lower: Vector, upper: Vector, start: int = 0) -> Vector:
    """Force on the lower platform, N: k (|v| - L0) v/|v|, the opposite on the upper one.

    v is the vector between the attachment points. Raises MotionError where it vanishes.
    """
    x, y, z = (above - below for above, below in zip(upper, lower, strict=True))
    x, y, z = x + loads.aside[0], y + loads.aside[1], z + loads.separation
    span = np.sqrt(x * x + y * y + z * z)
    if not span.min() > 0.0:
        raise MotionError(
            Problem("singular", f"the platforms meet at sample {start + int(span.argmin())}: no spring force")
        )
    factor = loads.stiffness * (1.0 - loads.rest_length / span)
    return factor * x, factor * y, factor * z


def cofactors(a: Vector, b: Vector, c: Vector) -> tuple[Vector, Vector, Vector, Array]:
    """b x c, c x a, a x b and the determinant of three vectors at N samples.

    f = F1 a + F2 b + F3 c is solved by F1 = (b x c)·f / det, ...; a·x = r1, b·x = r2,
    c·x = r3 by x = (r1 (b x c) + r2 (c x a) + r3 (a x b)) / det.
    """
    first = cross(b, c)
    return first, cross(c, a), cross(a, b), dot(a, first)


def answers(wraps: Sequence[Wrap], start: int) -> Array:
    """Three cables -> (3, 3, N): three vectors, whose products with a force are the tensions that give it.

    ``start`` as for ``carried``; raises MotionError where the cables lie in one plane.
    """
    *vectors, det = _regular(wraps, start)
    return np.asarray(np.array(vectors) / det, dtype=np.float64)


def _pull(wraps: Sequence[Wrap], force: Vector, start: int) -> tuple[Array, Array, Array]:
    """Three cables and the force they give together -> their tensions."""
    first, second, third, det = _regular(wraps, start)
    return dot(first, force) / det, dot(second, force) / det, dot(third, force) / det


def _regular(wraps: Sequence[Wrap], start: int) -> tuple[Vector, Vector, Vector, Array]:
    """Cofactors and determinant of three cables' directions."""
    first, second, third, det = cofactors(*(wrap.direction() for wrap in wraps))
    if not np.abs(det).min() > LEAST_DETERMINANT:
        sample = start + int(np.abs(det).argmin())
        raise MotionError(
            Problem(
                "singular",
                f"three cables lie in one plane at sample {sample}: they cannot hold the platform",
                value=float(det[sample - start]),
                limit=LEAST_DETERMINANT,
                hint="keep away from the plane of the pulleys",
            )
        )
    return first, second, third, det
