"""One slider moved alone, the others held: where both platforms go meanwhile.

Six sliders settle the pose, so that a slider's way is a curve of poses. It is found by forward
kinematics at a few of its places (Chebyshev's, both ends among them) and is the polynomial
through them, which has velocities and accelerations too. Over a millimetre that is exact to
rounding.
"""

from typing import Final

import numpy as np
from numpy.polynomial import chebyshev

from cdhr_host.mechanism import UpperMotion, transition
from cdhr_host.pipeline.rig import Rig
from cdhr_host.units import MM
from cdhr_host.values import Array

SPEED: Final = 5 * MM
"""m/s at most"""
DEGREE: Final = 6
"""of the polynomial"""


def slide(rig: Rig, slider: Array, way: Array, period: float) -> tuple[UpperMotion, UpperMotion]:
    """(6,) m where the sliders stand, (6,) m how far each goes -> nozzle in G, displacement of the upper.

    Both one for each period, from rest to rest. Raises MotionError where no pose has such cables.
    """
    sliders = rig.profile.sliders
    limits = min(SPEED, sliders.speed_max / 2), sliders.acceleration_max / 2, sliders.jerk_max / 2
    length = float(np.linalg.norm(way))
    part = transition(np.zeros(1), np.array([length]), limits, period)
    still = np.zeros((1, 1))
    x, v, a = (
        np.concatenate((still, each)) / length for each in (part.place, part.velocity, part.acceleration)
    )
    nodes = chebyshev.chebpts2(DEGREE + 1)
    poses = np.array([np.concatenate(rig.standing(slider + (node + 1) / 2 * way)) for node in nodes])
    curve = chebyshev.chebfit(nodes, poses, DEGREE)
    place, slope, bend = (
        2**order * chebyshev.chebval(2 * x[:, 0] - 1, chebyshev.chebder(curve, order)).T for order in range(3)
    )
    velocity, acceleration = slope * v, bend * v**2 + slope * a
    lower, upper = (
        UpperMotion(place[:, which], velocity[:, which], acceleration[:, which])
        for which in (slice(3), slice(3, 6))
    )
    return lower, upper
