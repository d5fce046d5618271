"""Everything a planned sample asks of the cables, in one pass: lengths, rates, tensions."""

import numpy as np

from cdhr_host.mechanism.cables import LOWER, Cables, Loads
from cdhr_host.mechanism.kinematics import blocks, components
from cdhr_host.mechanism.pulley import dot
from cdhr_host.mechanism.statics import carried
from cdhr_host.values import Array, CableState


def cable_state(  # noqa: PLR0917 -- loads, then q, q', q''
    cables: Cables,
    loads: Loads,
    lower: Array,
    upper: Array,
    velocity: Array,
    acceleration: Array,
    *,
    upper_velocity: Array | None = None,
    upper_acceleration: Array | None = None,
) -> CableState:
    """Displacements, velocities, accelerations (N, 3) of the platforms -> CableState of (N, 6).

    l' = -e·v; l'' = -e·a + (n·v)²/L + cos(theta)/rho (h·v)²; tensions by Eq. (10)-(12). The
    upper platform moves like the lower one unless its own motion is given. Raises MotionError
    out of reach, at a singular pose, or where the platforms meet; ``reachable`` tells which
    samples are out of reach.
    """
    velocities = velocity, velocity if upper_velocity is None else upper_velocity
    accelerations = acceleration, acceleration if upper_acceleration is None else upper_acceleration
    length, rate, second, tension = (np.empty((len(lower), 6)) for _ in range(4))
    for rows, wraps in blocks(cables, lower, upper):
        places = components(lower, rows), components(upper, rows)
        v = components(velocities[0], rows), components(velocities[1], rows)
        a = components(accelerations[0], rows), components(accelerations[1], rows)
        for i, wrap in enumerate(wraps):
            platform = 0 if i in LOWER else 1
            along = wrap.direction()
            length[rows, i] = wrap.length()
            rate[rows, i] = -dot(along, v[platform])
            second[rows, i] = wrap.bending(v[platform]) - dot(along, a[platform])
        for i, force in enumerate(carried(loads, wraps, places, a, rows.start)):
            tension[rows, i] = force
    return CableState(length=length, rate=rate, acceleration=second, tension=tension)
