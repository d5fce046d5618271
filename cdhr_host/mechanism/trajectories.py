"""The paper's three test trajectories: displacement in m over time in s, and its derivatives."""

import numpy as np

from cdhr_host.units import MM
from cdhr_host.values import Array


def eq15(t: Array, order: int = 0) -> Array:
    """(N,) -> (N, 3): Eq. (15), 0 <= t <= 200 s; ``order`` 1 or 2 for velocity or acceleration.

    x + iy = ln(1 + t/2)³ exp(0.03 pi i t), z = ln(1 + t)³, in mm.
    """
    turned = _turned(_cubed_log(t, 0.5), 0.03 * np.pi, t)[order]
    return np.column_stack([turned.real, turned.imag, _cubed_log(t, 1.0)[order]]) * MM


def eq35(t: Array, order: int = 0) -> Array:
    """(N,) -> (N, 3): Eq. (35): a circle of 20 mm diameter in 10 s; ``order`` as in ``eq15``."""
    radius = np.full_like(t, 10.0), np.zeros_like(t), np.zeros_like(t)
    turned = _turned(radius, 0.2 * np.pi, t)[order]
    return np.column_stack([turned.real, turned.imag, np.zeros_like(t)]) * MM


def eq36(t: Array, order: int = 0) -> Array:
    """(N,) -> (N, 3): Eq. (36), 0 <= t <= 150 s; ``order`` as in ``eq15``.

    x + iy = ln(1 + 2t)³ exp(pi i t / 75), z = 0, in mm.
    """
    turned = _turned(_cubed_log(t, 2.0), np.pi / 75.0, t)[order]
    return np.column_stack([turned.real, turned.imag, np.zeros_like(t)]) * MM


def _cubed_log(t: Array, rate: float) -> tuple[Array, Array, Array]:
    """ln(1 + rate t)³ and its first two derivatives."""
    log, slope = np.log1p(rate * t), rate / (1.0 + rate * t)
    return log**3, 3.0 * log**2 * slope, 3.0 * log * slope**2 * (2.0 - log)


def _turned(
    radius: tuple[Array, Array, Array], speed: float, t: Array
) -> tuple[np.typing.NDArray[np.complex128], ...]:
    """f exp(i speed t) and its first two derivatives."""
    turn, w = np.exp(1j * speed * t), 1j * speed
    f, f1, f2 = radius
    return f * turn, (f1 + w * f) * turn, (f2 + 2.0 * w * f1 + w * w * f) * turn
