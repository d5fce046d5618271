"""One cable on its way from platform to pulley: the pulley models behind one interface.

A model is made from BA, the vector from the attachment B to the pulley centre A, as three
(N,) arrays in m, the ``sign`` of the side the pulley is on (+1 above, -1 below the platform),
the groove ``radius`` and the ``azimuth`` in which the cable leaves for its slider. Its answers
are all the rest of the room asks for.
"""

from collections.abc import Callable
from typing import Final, Protocol

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

    def angle(self) -> Array:
        """(N,) rad: theta, how far the cable wraps the pulley. Eq. (4)."""
        ...

    def straight(self) -> Vector:
        """BC, m: from the attachment to where the cable meets the pulley. Eq. (7)."""
        ...

    def per_radius(self) -> Array:
        """(N,): dl/dr, by how much a wider groove makes the cable longer."""
        ...


Pulley = Callable[[Array, Array, Array, "Array | float", float, "Array | float"], Wrap]
"""x, y, z, sign, radius, azimuth -> the cable"""


class PointWrap:
    """No pulley: the straight line BA, what an uncompensated machine commands."""

    def __init__(  # noqa: PLR0917 -- the order of Pulley
        self,
        x: Array,
        y: Array,
        z: Array,
        sign: Array | float,
        radius: float,  # noqa: ARG002
        azimuth: Array | float,  # noqa: ARG002
    ) -> None:
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

    def angle(self) -> Array:
        """(N,) rad: nothing is wrapped."""
        return np.zeros_like(self._length)

    def straight(self) -> Vector:
        """BA, m."""
        return self._line

    def per_radius(self) -> Array:
        """(N,): 0, there is no groove."""
        return np.zeros_like(self._length)


class Groove:
    """A pulley and the point ``out`` before and ``rise`` beyond its centre, in the pulley's plane.

    With d² = out² + rise² and L² = d² - r², Eq. (3) gives sin(theta) = (r out + rise L) / d² and
    cos(theta) = (out L - r rise) / d².
    """

    __slots__ = ("cos", "line", "radius", "sin")

    def __init__(self, out: Array, rise: Array, radius: float) -> None:
        distance = out * out + rise * rise
        self.radius = radius
        self.line = np.sqrt(distance - radius * radius)
        self.sin = (radius * out + rise * self.line) / distance
        self.cos = (out * self.line - radius * rise) / distance

    def angle(self) -> Array:
        """(N,) rad: theta, the wrap and the elevation of the cable. Eq. (4)."""
        return np.arctan2(self.sin, self.cos)

    def length(self) -> Array:
        """(N,) m: arc and straight part. Eq. (5), (8), (9)."""
        return self.radius * self.angle() + self.line

    def bending(self, out: Array, rise: Array) -> Array:
        """(N,) m/s²: (n·v)²/L of a point moving at ``out`` and ``rise`` in the plane."""
        normal = self.cos * rise - self.sin * out
        return normal * normal / self.line


class SwivelWrap:
    """Pulley swivelling about the vertical line through its centre (Eq. 1-5, 7-10).

    The plane of the groove holds B: out is rho = |(x, y)|, rise w = |z|.
    """

    def __init__(  # noqa: PLR0917 -- the order of Pulley
        self,
        x: Array,
        y: Array,
        z: Array,
        sign: Array | float,
        radius: float,
        azimuth: Array | float,  # noqa: ARG002
    ) -> None:
        self._x, self._y, self._sign = x, y, sign
        self._rise = sign * z
        self._rho = np.sqrt(x * x + y * y)
        self._groove = Groove(self._rho, self._rise, radius)

    def reach(self) -> Array:
        """(N,) m: B is between the planes of the pulleys and away from the swivel axis."""
        return np.minimum(self._rise, self._rho - self._groove.radius)

    def angle(self) -> Array:
        """(N,) rad: theta. Eq. (4)."""
        return self._groove.angle()

    def length(self) -> Array:
        """(N,) m: arc and straight part. Eq. (5), (8), (9)."""
        return self._groove.length()

    def direction(self) -> Vector:
        """The unit vector along the straight part. Eq. (10)."""
        flat = self._groove.cos / self._rho
        return flat * self._x, flat * self._y, self._sign * self._groove.sin

    def bending(self, velocity: Vector) -> Array:
        """(N,) m/s²: (n·v)²/L + cos(theta)/rho (h·v)²."""
        vx, vy, vz = velocity
        inward = (self._x * vx + self._y * vy) / self._rho
        sideways = (self._x * vy - self._y * vx) / self._rho
        turning = self._groove.cos / self._rho * (sideways * sideways)
        return self._groove.bending(inward, self._sign * vz) + turning

    def straight(self) -> Vector:
        """BC, m: along the direction."""
        return scaled(self.direction(), self._groove.line)

    def per_radius(self) -> Array:
        """(N,): theta; what the tangent point does to arc and straight part cancels."""
        return self._groove.angle()


class _Hung:
    """A pulley whose entry is tied to an azimuth: BA in that frame."""

    def __init__(  # noqa: PLR0917 -- the order of Pulley
        self, x: Array, y: Array, z: Array, sign: Array | float, radius: float, azimuth: Array | float
    ) -> None:
        self._sign, self._radius = sign, radius
        self._turn = np.cos(azimuth), np.sin(azimuth)
        self._out, self._aside, self._rise = self._local((x, y, z))

    def _local(self, vector: Vector) -> Vector:
        """World -> out, aside, towards the pulley's plane."""
        cos, sin = self._turn
        x, y, z = vector
        return cos * x + sin * y, cos * y - sin * x, self._sign * z

    def _world(self, out: Array, aside: Array, rise: Array) -> Vector:
        cos, sin = self._turn
        return cos * out - sin * aside, sin * out + cos * aside, self._sign * rise

    def reach(self) -> Array:
        """(N,) m: B is between the planes of the pulleys and further in than the groove."""
        return np.minimum(self._rise, self._out - self._radius)


class FixedPlaneWrap(_Hung):
    """Pulley that does not swivel; the cable leaves its groove sideways (Eq. 6, 17-21; Table A1).

    l = r theta + L with theta of the projection on the pulley's plane, L² = Lp² + aside². The
    groove's edge reacts, so that the gradient differs from the straight part by up to 2e-4.
    """

    def __init__(  # noqa: PLR0917 -- the order of Pulley
        self, x: Array, y: Array, z: Array, sign: Array | float, radius: float, azimuth: Array | float
    ) -> None:
        super().__init__(x, y, z, sign, radius, azimuth)
        self._groove = Groove(self._out, self._rise, radius)
        self._line = np.sqrt(self._groove.line**2 + self._aside**2)

    def angle(self) -> Array:
        """(N,) rad: theta of the projection."""
        return self._groove.angle()

    def length(self) -> Array:
        """(N,) m: arc and straight part."""
        return self._radius * self._groove.angle() + self._line

    def direction(self) -> Vector:
        """Gradient of the length."""
        groove, skew = self._groove, 1.0 / self._line - 1.0 / self._groove.line
        return self._world(
            groove.cos + skew * self._out, self._aside / self._line, groove.sin + skew * self._rise
        )

    def bending(self, velocity: Vector) -> Array:
        """(N,) m/s²: of the length in the plane, and of L - Lp."""
        out, aside, rise = self._local(velocity)
        flat = out * out + rise * rise
        stretch = self._out * out + self._rise * rise
        projected, line = self._groove.line, self._line
        whole = (flat + aside * aside - ((stretch + self._aside * aside) / line) ** 2) / line
        return self._groove.bending(out, rise) + whole - (flat - (stretch / projected) ** 2) / projected

    def straight(self) -> Vector:
        """BC, m: Eq. (7) with AC in the fixed plane."""
        groove, r = self._groove, self._radius
        return self._world(self._out - r * groove.sin, self._aside, self._rise + r * groove.cos)

    def per_radius(self) -> Array:
        """(N,): theta, and r (1/Lp - 1/L) of the sideways part."""
        return self._groove.angle() + self._radius * (1.0 / self._groove.line - 1.0 / self._line)


class CasterWrap(_Hung):
    """Pulley swivelling about the horizontal line on which the cable enters it.

    With h² = (w + r)² + aside², the plane through that line and B holds the cable: out, and h - r
    in place of the rise.
    """

    def __init__(  # noqa: PLR0917 -- the order of Pulley
        self, x: Array, y: Array, z: Array, sign: Array | float, radius: float, azimuth: Array | float
    ) -> None:
        super().__init__(x, y, z, sign, radius, azimuth)
        self._drop = self._rise + radius
        self._hang = np.sqrt(self._drop**2 + self._aside**2)
        self._groove = Groove(self._out, self._hang - radius, radius)

    def angle(self) -> Array:
        """(N,) rad: theta in the pulley's plane."""
        return self._groove.angle()

    def length(self) -> Array:
        """(N,) m: arc and straight part."""
        return self._groove.length()

    def direction(self) -> Vector:
        """The unit vector along the straight part."""
        down = self._groove.sin / self._hang
        return self._world(self._groove.cos, down * self._aside, down * self._drop)

    def bending(self, velocity: Vector) -> Array:
        """(N,) m/s²: in the plane, and sin(theta) h''."""
        out, aside, rise = self._local(velocity)
        hang = (self._drop * rise + self._aside * aside) / self._hang
        swinging = (rise * rise + aside * aside - hang * hang) / self._hang
        return self._groove.bending(out, hang) + self._groove.sin * swinging

    def straight(self) -> Vector:
        """BC, m: along the direction."""
        return scaled(self.direction(), self._groove.line)

    def per_radius(self) -> Array:
        """(N,): theta, and sin(theta) d(h - r)/dr of the line that moves with the groove."""
        return self._groove.angle() + self._groove.sin * (self._drop / self._hang - 1.0)


PULLEYS: Final[dict[str, Pulley]] = {
    "swivel": SwivelWrap,
    "fixed-plane": FixedPlaneWrap,
    "caster": CasterWrap,
    "point": PointWrap,
}
"""``[geometry] pulley_model`` -> model"""


def scaled(a: Vector, factor: Array | float) -> Vector:
    """A vector times a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


def dot(a: Vector, b: Vector) -> Array:
    """Scalar product, (N,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
