"""The upper platform on its own: from one place to another while the nozzle stands.

A machine is at its reference pose with the reference offset; a policy may want another one. The
way is straight, with speed, acceleration and jerk zero at both ends (a polynomial of degree 7).
"""

from typing import Final

import numpy as np

from cdhr_host.mechanism.policy import UpperMotion
from cdhr_host.values import Array

SPEED, ACCELERATION, JERK = 2.1875, 84.0 * np.sqrt(5.0) / 25.0, 52.5
"""greatest derivatives of the unit way in unit time"""
WAY: Final = np.polynomial.Polynomial([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0])


def transition(start: Array, end: Array, limits: tuple[float, float, float], period: float) -> UpperMotion:
    """(3,), (3,) m -> UpperMotion at every period up to rest at ``end``; the start itself is left out.

    ``limits`` are the greatest speed, acceleration and jerk, m/s, m/s², m/s³: those of the sliders
    do, for a cable is not faster than its platform and turns little on so short a way.
    """
    way = end - start
    distance, (speed, acceleration, jerk) = float(np.linalg.norm(way)), limits
    duration = max(
        SPEED * distance / speed,
        np.sqrt(ACCELERATION * distance / acceleration),
        np.cbrt(JERK * distance / jerk),
    )
    count = int(np.ceil(duration / period))
    duration = count * period
    part = (np.arange(count) + 1.0) / max(count, 1)
    place, velocity, change = (
        np.outer(WAY.deriv(order)(part) / duration**order if order else WAY(part), way) for order in range(3)
    )
    return UpperMotion(start + place, velocity, change)
