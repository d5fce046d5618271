"""Natural frequencies of the two platforms at a pose.

Force-controlled: tensions stay what they are, the cables swing. Position-held: sliders stand
still, each cable is a spring of EA over its whole length, those of a pair side by side.
"""

import numpy as np

from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.dynamics import tension_stiffness
from cdhr_host.mechanism.kinematics import jacobian
from cdhr_host.mechanism.statics import tensions
from cdhr_host.mechanism.stretch import Give
from cdhr_host.values import Array


def swinging_frequencies(cables: Cables, loads: Loads, lower: Array, upper: Array) -> Array:
    """(N, 3), (N, 3) -> (N, 6) Hz, ascending: at rest with constant tensions; NaN where unstable.

    Raises like ``tensions``.
    """
    force = tensions(cables, loads, lower, upper)
    return _frequencies(loads, tension_stiffness(cables, loads, lower, upper, force))


def elastic_frequencies(cables: Cables, loads: Loads, give: Give, lower: Array, upper: Array) -> Array:
    """(N, 3), (N, 3) -> (N, 6) Hz, ascending: at rest with the sliders held. Raises like ``tensions``."""
    force = tensions(cables, loads, lower, upper)
    stiff = tension_stiffness(cables, loads, lower, upper, force)
    pull = jacobian(cables, lower, upper)
    held = np.einsum("i,nij,nik->nijk", 1.0 / give.compliance, pull, pull)
    stiff[:, :3, :3] += held[:, :3].sum(axis=1)
    stiff[:, 3:, 3:] += held[:, 3:].sum(axis=1)
    return _frequencies(loads, stiff)


def _frequencies(loads: Loads, stiff: Array) -> Array:
    root = np.sqrt(np.repeat([loads.lower_mass, loads.upper_mass], 3))
    square = np.linalg.eigvalsh(stiff / root[:, None] / root[None, :])
    with np.errstate(invalid="ignore"):
        return np.sqrt(square) / (2.0 * np.pi)
