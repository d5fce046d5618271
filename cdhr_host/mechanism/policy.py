"""Where the upper platform stands: three free numbers at every pose of the lower one.

``fixed``     at the offset of the reference pose, as in the paper
``preload``   straight above, where the spring pulls with a given force
``vertical``  straight above, where the smallest margin of the nine cables is largest
``free``      anywhere, by the same measure; the spring leans outward

The last two are smooth closed forms fitted to the machine (``spring_fit``). All are C² and more,
so that sliders 4-6 can follow within their limits.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.jet import Along
from cdhr_host.mechanism.kinematics import block_rows, components
from cdhr_host.mechanism.pairs import Pairs
from cdhr_host.mechanism.response import Windows
from cdhr_host.mechanism.spring_field import HEIGHT_ONLY, ROWS, SpringField
from cdhr_host.mechanism.spring_fit import best_field
from cdhr_host.profile import Profile
from cdhr_host.values import Array

PolicyName = Literal["fixed", "preload", "vertical", "free"]
POLICIES: tuple[PolicyName, ...] = ("fixed", "preload", "vertical", "free")


class UpperMotion(NamedTuple):
    """The upper platform at N samples."""

    place: Array
    """(N, 3) m, displacement from its reference"""
    velocity: Array
    """(N, 3) m/s"""
    acceleration: Array
    """(N, 3) m/s²"""


@dataclass(frozen=True, slots=True)
class Policy:
    """The upper platform's displacement as a function of the lower one's."""

    loads: Loads
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """m: constant, where there is no field"""
    field: SpringField | None = None

    @classmethod
    def from_profile(cls, profile: Profile, name: PolicyName | None = None) -> "Policy":
        """``[spring] policy`` of the profile, or ``name``. The fits are kept: the first takes a second."""
        loads, wanted = Loads.from_profile(profile), name or profile.spring.policy
        if wanted == "fixed":
            return cls(loads)
        if wanted == "preload":
            span = loads.rest_length + profile.spring.preload / loads.stiffness
            return cls(loads, (-loads.aside[0], -loads.aside[1], span - loads.separation))
        return cls(loads, field=_fitted(_Fitted(profile), wanted == "vertical"))

    def upper(self, lower: Array) -> Array:
        """(N, 3) m -> (N, 3) m: displacement of the upper platform."""
        if self.field is None:
            return np.asarray(lower + np.array(self.offset), dtype=np.float64)
        place = np.empty_like(lower)
        for rows in block_rows(len(lower)):
            q = components(lower, rows)
            for axis, part in enumerate(_offset(self.loads, self.field.at(q))):
                np.add(q[axis], part.value, out=place[rows, axis])
        return place

    def moving(self, lower: Array, velocity: Array) -> tuple[Array, Array]:
        """(N, 3) m, (N, 3) m/s of the lower platform -> the same of the upper one, velocity exact."""
        if self.field is None:
            return self.upper(lower), velocity
        moved = np.empty_like(lower), np.empty_like(lower)
        for rows in block_rows(len(lower)):
            motion = components(lower, rows), components(velocity, rows)
            for axis, slope in enumerate(_offset(self.loads, self.field.sloping(*motion))):
                for order, part in enumerate(slope):
                    np.add(motion[order][axis], part, out=moved[order][rows, axis])
        return moved

    def follow(self, lower: Array, velocity: Array, acceleration: Array) -> UpperMotion:
        """(N, 3) each of the lower platform, m, m/s, m/s² -> UpperMotion, with exact derivatives."""
        if self.field is None:
            return UpperMotion(lower + np.array(self.offset), velocity, acceleration)
        moved = UpperMotion(*(np.empty_like(lower) for _ in range(3)))
        for rows in block_rows(len(lower)):
            motion = [components(part, rows) for part in (lower, velocity, acceleration)]
            offsets = _offset(self.loads, self.field.along(motion[0], motion[1], motion[2]))
            for axis, jet in enumerate(offsets):
                for order, part in enumerate(jet):
                    np.add(motion[order][axis], part, out=moved[order][rows, axis])
        return moved

    def slope(self, lower: Array) -> Array:
        """(N, 3) -> (N, 3, 3): d(upper)/d(lower)."""
        still = np.zeros_like(lower)
        ways = [np.broadcast_to(way, lower.shape) for way in np.eye(3)]
        return np.stack([self.follow(lower, way, still).velocity for way in ways], axis=2)

    def curvature(self, lower: Array) -> Array:
        """(N, 3) -> (N, 3, 3, 3) 1/m: d²(upper) by two displacements of the lower platform."""
        found = np.empty((*lower.shape, 3, 3))
        still, ways = np.zeros_like(lower), np.eye(3)

        def bend(way: Array) -> Array:
            return self.follow(lower, np.broadcast_to(way, lower.shape), still).acceleration

        for j in range(3):
            found[:, :, j, j] = bend(ways[j])
        for j, k in ((0, 1), (0, 2), (1, 2)):
            mixed = 0.5 * (bend(ways[j] + ways[k]) - found[:, :, j, j] - found[:, :, k, k])
            found[:, :, j, k] = found[:, :, k, j] = mixed
        return found


def _offset(loads: Loads, spring: tuple[Along, Along, Along]) -> tuple[Along, Along, Along]:
    """Upper minus lower displacement: s / k + L0 s / |s| less what is between them at the reference."""
    (x, y, z), (across, beside) = spring, loads.aside
    square = x.times(x).plus(y.times(y)).plus(z.times(z))
    longer = square.inverse_root().scaled(loads.rest_length).shifted(1.0 / loads.stiffness)
    x, y, z = (part.times(longer) for part in (x, y, z))
    return x.shifted(-across), y.shifted(-beside), z.shifted(-loads.separation)


class _Fitted:
    """A profile that equals another where the fit does not depend on the difference."""

    def __init__(self, profile: Profile) -> None:
        self.profile = profile
        parts = profile.geometry, profile.calibration, profile.spring, profile.platforms, profile.forces
        self._parts = tuple(part.model_dump_json() for part in parts)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Fitted) and self._parts == other._parts

    def __hash__(self) -> int:
        return hash(self._parts)


@lru_cache(maxsize=16)
def _fitted(machine: _Fitted, upright: bool) -> SpringField:
    """At rest and with no moment from outside."""
    profile, rows = machine.profile, HEIGHT_ONLY if upright else np.ones(ROWS, dtype=np.bool_)
    return best_field(
        Cables.from_profile(profile),
        Loads.from_profile(profile),
        Pairs.from_profile(profile),
        Windows.from_profile(profile),
        rows,
    )
