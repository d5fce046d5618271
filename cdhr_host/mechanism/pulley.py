"""One cable on its way from platform to pulley: the pulley models behind one interface.

A model is made from BA, the vector from the attachment B to the pulley centre A, as three
(N,) arrays in m, the ``sign`` of the side the pulley is on (+1 above, -1 below the platform)
and the groove ``radius``. Its three answers are all the rest of the room asks for.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from cdhr_host.values import Array

Vector = tuple[Array, Array, Array]
"""x, y and z as (N,) arrays each"""


class Wrap(Protocol):
    """A cable at N poses."""

    def reach(self) -> Array:
        """(N,) m: how far B is inside the pulley's range; positive is within reach."""
        ...

    def length(self) -> Array:
        """(N,) m: from the fixed point D on the pulley to B."""
        ...

    def direction(self) -> Vector:
        """The gradient of the length along BA: the cable's pull on the platform per newton."""
        ...

    def bending(self, velocity: Vector) -> Array:
        """(N,) m/s²: the part of l'' that is quadratic in the platform's velocity."""
        ...


Pulley = Callable[[Array, Array, Array, "Array | float", float], Wrap]
"""x, y, z, sign, radius -> the cable"""


class PointWrap:
    """No pulley: the straight line BA, what an uncompensated machine commands."""

    def __init__(self, x: Array, y: Array, z: Array, sign: Array | float, radius: float) -> None:  # noqa: ARG002
        self._line = (x, y, z)
        self._rise = sign * z
        self._length = np.sqrt(x * x + y * y + z * z)

    def reach(self) -> Array:
        """(N,) m: height between B and the plane of the pulleys."""
        return self._rise

    def length(self) -> Array:
        """(N,) m: |BA|."""
        return self._length

    def direction(self) -> Vector:
        """BA / |BA|."""
        x, y, z = self._line
        return x / self._length, y / self._length, z / self._length

    def bending(self, velocity: Vector) -> Array:
        """(N,) m/s²: what the speed across the line adds to l''."""
        along = dot(self.direction(), velocity)
        return (dot(velocity, velocity) - along * along) / self._length


class SwivelWrap:
    """Pulley swivelling about the vertical line through its centre (Eq. 1-5, 7-10).

    With rho = |(x, y)|, rise w = |z|, d² = rho² + w² and L² = d² - r², Eq. (3) gives
    sin(theta) = (r rho + w L) / d² and cos(theta) = (rho L - r w) / d².
    """

    def __init__(self, x: Array, y: Array, z: Array, sign: Array | float, radius: float) -> None:
        rise = sign * z
        square = x * x + y * y
        distance = square + rise * rise
        rho = np.sqrt(square)
        line = np.sqrt(distance - radius * radius)
        self._x, self._y, self._sign, self._radius = x, y, sign, radius
        self._rise, self._rho, self._line = rise, rho, line
        self._sin = (radius * rho + rise * line) / distance
        self._cos = (rho * line - radius * rise) / distance

    def reach(self) -> Array:
        """(N,) m: B is between the planes of the pulleys and away from the swivel axis."""
        return np.minimum(self._rise, self._rho - self._radius)

    def angle(self) -> Array:
        """(N,) rad: theta, the wrap and the elevation of the cable. Eq. (4)."""
        return np.arctan2(self._sin, self._cos)

    def length(self) -> Array:
        """(N,) m: arc and straight part. Eq. (5), (8), (9)."""
        return self._radius * self.angle() + self._line

    def direction(self) -> Vector:
        """The unit vector along the straight part. Eq. (10)."""
        flat = self._cos / self._rho
        return flat * self._x, flat * self._y, self._sign * self._sin

    def bending(self, velocity: Vector) -> Array:
        """(N,) m/s²: (n·v)²/L + cos(theta)/rho (h·v)²."""
        vx, vy, vz = velocity
        inward = (self._x * vx + self._y * vy) / self._rho
        sideways = (self._x * vy - self._y * vx) / self._rho
        normal = self._sign * self._cos * vz - self._sin * inward
        return normal * normal / self._line + self._cos / self._rho * (sideways * sideways)


def dot(a: Vector, b: Vector) -> Array:
    """Scalar product, (N,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
