"""A field of spring forces over the workspace: smooth, and with the machine's symmetry.

Turning the machine by 120° or mirroring it at a pulley's azimuth changes nothing, so the force
field must turn and mirror with the pose. With X + iY the horizontal position, every such
polynomial field is

    s_x + i s_y = (X + iY) A + (X - iY)² B,     s_z = C,

where A, B and C depend on X² + Y², X³ - 3XY² and Z only. Here they are polynomials of these, with
Chebyshev polynomials in Z: closed forms, with all derivatives.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.mechanism.jet import Along, Jet, Plain, Slope, constant
from cdhr_host.mechanism.pulley import Vector
from cdhr_host.values import Array

DEGREE = 6
"""of s_z in X and Y"""
RISE = 6
"""degree in Z"""


def _monomials(degree: int) -> list[tuple[int, int]]:
    """Powers of X² + Y² and of X³ - 3XY² up to ``degree`` in X and Y."""
    return [(i, j) for j in range(degree // 3 + 1) for i in range((degree - 3 * j) // 2 + 1)]


PARTS = (_monomials(DEGREE - 1), _monomials(DEGREE - 2), _monomials(DEGREE))
"""of A, B and C"""
SPLITS = (len(PARTS[0]), len(PARTS[0]) + len(PARTS[1]))
ROWS = SPLITS[1] + len(PARTS[2])
HEIGHT_ONLY = np.arange(ROWS) >= SPLITS[1]
"""(ROWS,): those that a vertical spring has"""


@dataclass(frozen=True, slots=True)
class Domain:
    """The cylinder the field is scaled to, about the machine's axis, in displacements."""

    radius: float
    """m"""
    low: float
    """m, of z"""
    high: float
    """m, of z"""


@dataclass(frozen=True, slots=True)
class SpringField:
    """Spring force on the lower platform as a function of its displacement."""

    domain: Domain
    coefficients: Array
    """(ROWS, RISE + 1) N: A, B, C by rows, powers of Z by columns"""

    def along(self, place: Vector, speed: Vector, change: Vector) -> tuple[Jet, Jet, Jet]:
        """Position, velocity and acceleration of the lower platform -> force, N, with its derivatives."""
        x, y, z = (Jet(*parts) for parts in zip(place, speed, change, strict=True))
        return self._force(x, y, z)

    def sloping(self, place: Vector, speed: Vector) -> tuple[Slope, Slope, Slope]:
        """Position and velocity of the lower platform -> force, N, with its rate."""
        x, y, z = (Slope(*parts) for parts in zip(place, speed, strict=True))
        return self._force(x, y, z)

    def at(self, place: Vector) -> tuple[Plain, Plain, Plain]:
        """The force alone, N, where the lower platform is."""
        x, y, z = (Plain(part) for part in place)
        return self._force(x, y, z)

    def _force(self, x: Along, y: Along, z: Along) -> tuple[Along, Along, Along]:
        """Of the position, scaled to the domain here."""
        x, y, z = self.scaled(x, y, z)
        radial, turning, vertical = self._sums(x, y, z)
        xx, yy, xy = x.times(x), y.times(y), x.times(y)
        return (
            x.times(radial).plus(xx.plus(yy.scaled(-1.0)).times(turning)),
            y.times(radial).plus(xy.scaled(-2.0).times(turning)),
            vertical,
        )

    def scaled(self, x: Along, y: Along, z: Along) -> tuple[Along, Along, Along]:
        """X, Y and Z, each about -1 to 1 in the domain."""
        wide, low, high = self.domain.radius, self.domain.low, self.domain.high
        upright = z.shifted(-0.5 * (high + low)).scaled(2.0 / (high - low))
        return x.scaled(1.0 / wide), y.scaled(1.0 / wide), upright

    def _sums(self, x: Along, y: Along, z: Along) -> tuple[Along, Along, Along]:
        """A, B and C."""
        weights = self.coefficients @ np.array(_chebyshev(z)).transpose(1, 0, 2)
        powers = _powers(x, y)
        parts, row = [], 0
        for monomials in PARTS:
            total = constant(0.0, x)
            for power in monomials:
                total = total.plus(powers[power].times(type(x)(*weights[:, row])))
                row += 1
            parts.append(total)
        return parts[0], parts[1], parts[2]


def basis(domain: Domain, place: Vector) -> Array:
    """(N, 3, ROWS * (RISE + 1)): the force for a unit of each coefficient."""
    still = np.zeros_like(place[0])
    x, y, z = SpringField(domain, np.zeros((ROWS, RISE + 1))).scaled(*(Plain(part) for part in place))
    powers, heights = _powers(x, y), np.array([part.value for part in _chebyshev(z)])
    X, Y = x.value, y.value
    frames = ((X, Y, still), (X * X - Y * Y, -2.0 * X * Y, still), (still, still, still + 1.0))
    found = [
        np.array(frame) * powers[power].value * heights[:, None]
        for frame, monomials in zip(frames, PARTS, strict=True)
        for power in monomials
    ]
    return np.ascontiguousarray(np.concatenate(found).transpose(2, 1, 0))


def _powers(x: Along, y: Along) -> dict[tuple[int, int], Along]:
    """All monomials of PARTS."""
    xx, yy = x.times(x), y.times(y)
    square, cube = xx.plus(yy), x.times(xx.plus(yy.scaled(-3.0)))
    found = {(0, 0): constant(1.0, x)}
    for i, j in sorted(set().union(*PARTS) - {(0, 0)}, key=lambda power: (power[1], power[0])):
        found[i, j] = found[i - 1, j].times(square) if i else found[0, j - 1].times(cube)
    return found


def _chebyshev(z: Along) -> list[Along]:
    """T_0 to T_RISE."""
    found = [constant(1.0, z), z]
    for _ in range(RISE - 1):
        found.append(z.scaled(2.0).times(found[-1]).plus(found[-2].scaled(-1.0)))
    return found
