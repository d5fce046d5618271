"""How fast the cables wind about swivelling pulleys: Eq. (20) corrected, free of tangents."""

import numpy as np

from cdhr_host.mechanism.cables import LOWER, Cables
from cdhr_host.mechanism.jet import Jet
from cdhr_host.mechanism.kinematics import block_rows, components
from cdhr_host.mechanism.pulley import Groove
from cdhr_host.values import Array

Motion = tuple[Array, Array, Array]
"""(N, 3) each: displacement, m, velocity, m/s, and acceleration, m/s², of a platform"""


def wrap_rates(cables: Cables, lower: Motion, upper: Motion) -> Jet:
    """Motion of both platforms -> theta, theta', theta'' of six cables, (N, 6) rad, rad/s, rad/s².

    The pulleys swivel about the vertical, whatever ``cables.pulley``; poses must be ``reachable``.
    With rho and w of BA: theta' = (w' cos - rho' sin) / L and theta'' = (w'' cos - rho'' sin
    - 2 theta' (w' sin + rho' cos) + theta'² (rho sin - w cos)) / L.
    """
    found = Jet(*(np.empty((len(lower[0]), 6)) for _ in range(3)))
    for rows in block_rows(len(lower[0])):
        for i in range(6):
            moved = [components(part, rows) for part in (lower if i in LOWER else upper)]
            axes = [Jet(*parts).scaled(-1.0) for parts in zip(*moved, strict=True)]
            for whole, part in zip(found, _wound(cables, i, axes), strict=True):
                whole[rows, i] = part
    return found


def _wound(cables: Cables, i: int, back: list[Jet]) -> Jet:
    """``back``: x, y, z of -q."""
    x, y, z = (
        jet.shifted(float(arm))
        for jet, arm in zip(back, cables.anchors[i] - cables.attachments[i], strict=True)
    )
    square = x.times(x).plus(y.times(y))
    rho, w = square.times(square.inverse_root()), z.scaled(float(cables.signs[i]))
    groove = Groove(rho.value, w.value, cables.pulley_radius)
    sin, cos = groove.sin, groove.cos
    rate = (w.rate * cos - rho.rate * sin) / groove.line
    turned = rate * (rho.value * sin - w.value * cos) - 2.0 * (w.rate * sin + rho.rate * cos)
    return Jet(groove.angle(), rate, (w.bend * cos - rho.bend * sin + rate * turned) / groove.line)
