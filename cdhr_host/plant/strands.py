"""One physical cable in plain numbers: from its attachment round the pulley to the fixed end D.

The room ``mechanism`` has the same geometry over many poses at once, for planning; these are
for one pose at a time and the nine cables of the simulated machine, each with its own pulley.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, cos, sin, sqrt
from typing import Final

import numpy as np

from cdhr_host.mechanism.cables import AZIMUTHS
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array

Pull = tuple[float, float, float, float]
"""length from D to B, m, and the unit vector of the straight part: the pull on the platform per newton"""
Wrapped = Callable[[float, float, float], Pull]
"""x, y, z of the attachment B in W, m -> Pull"""
Point = tuple[float, float, float]


def swivelling(anchor: Point, azimuth: float, sign: float, radius: float) -> Wrapped:  # noqa: ARG001
    """Pulley that swivels about the vertical through its centre ``anchor``. Eq. (3)-(10)."""
    ax, ay, az = anchor
    square = radius * radius

    def wrapped(bx: float, by: float, bz: float) -> Pull:
        x, y, w = ax - bx, ay - by, sign * (az - bz)
        flat = x * x + y * y
        away = flat + w * w
        rho, line = sqrt(flat), sqrt(away - square)
        sine, cosine = (radius * rho + w * line) / away, (rho * line - radius * w) / away
        out = cosine / rho
        return radius * atan2(sine, cosine) + line, out * x, out * y, sign * sine

    return wrapped


def fixed_plane(anchor: Point, azimuth: float, sign: float, radius: float) -> Wrapped:
    """Pulley that stands in the vertical plane of ``azimuth``; the cable leaves it sideways.

    It pulls along its straight part, which differs from the gradient of its length by up to
    2e-4: the rest is done by the edge of the groove.
    """
    ax, ay, az = anchor
    c, s, square = cos(azimuth), sin(azimuth), radius * radius

    def wrapped(bx: float, by: float, bz: float) -> Pull:
        x, y, w = ax - bx, ay - by, sign * (az - bz)
        u, t = c * x + s * y, c * y - s * x
        away = u * u + w * w
        plane = sqrt(away - square)
        line = sqrt(away - square + t * t)
        sine, cosine = (radius * u + w * plane) / away, (u * plane - radius * w) / away
        out, aside, rise = (u - radius * sine) / line, t / line, (w + radius * cosine) / line
        return radius * atan2(sine, cosine) + line, c * out - s * aside, s * out + c * aside, sign * rise

    return wrapped


def caster(anchor: Point, azimuth: float, sign: float, radius: float) -> Wrapped:
    """Pulley that swivels about the horizontal line on which the cable enters it."""
    ax, ay, az = anchor
    c, s, square = cos(azimuth), sin(azimuth), radius * radius

    def wrapped(bx: float, by: float, bz: float) -> Pull:
        x, y, drop = ax - bx, ay - by, sign * (az - bz) + radius
        u, t = c * x + s * y, c * y - s * x
        hang = sqrt(drop * drop + t * t)
        w = hang - radius
        away = u * u + w * w
        line = sqrt(away - square)
        sine, cosine = (radius * u + w * line) / away, (u * line - radius * w) / away
        down = sine / hang
        aside = down * t
        return (
            radius * atan2(sine, cosine) + line,
            c * cosine - s * aside,
            s * cosine + c * aside,
            sign * down * drop,
        )

    return wrapped


MODELS: Final = {"swivel": swivelling, "fixed-plane": fixed_plane, "caster": caster}
"""``[geometry] pulley_model`` -> model; the simulated machine always has pulleys"""
LEFT: Final = (0, 1, 2)
RIGHT: Final = (3, 4, 5)
TOP: Final = (6, 7, 8)
SLIDER: Final = (0, 1, 2, 0, 1, 2, 3, 4, 5)
"""which slider winds each of the nine cables: the two of a pair share one"""


@dataclass(frozen=True, slots=True)
class Strands:
    """Nine cables: left of the pairs 1-3, right of the pairs 1-3, upper 4-6."""

    wrapped: tuple[Wrapped, ...]
    """(9,)"""
    arms: tuple[Point, ...]
    """(6,) m: attachments on the lower platform from its centre, Table A1 corrected"""
    lower: Point
    """m in W: centre of the lower attachments at the reference pose"""
    upper: Point
    """m in W: where the upper cables meet at the reference pose"""

    @classmethod
    def from_profile(
        cls, profile: Profile, pulley: str | None = None, moved: Array | None = None
    ) -> "Strands":
        """``pulley`` instead of the profile's; ``moved`` (6, 3) m: by how much the pulleys are off.

        Raises KeyError for a machine without pulleys.
        """
        shape, known = profile.geometry, profile.calibration
        model = MODELS[pulley or shape.pulley_model]
        off = known.pulleys() + (np.zeros((6, 3)) if moved is None else moved)
        own = known.arms()
        half = 0.5 * shape.pair_spacing
        top = shape.reference_height + shape.reference_separation
        wrapped, arms = [], []
        for along in (half, -half):
            for i, beta in enumerate(AZIMUTHS):
                anchor = _ringed(shape.pulley_circle_radius, along, beta, shape.lower_pulley_height)
                wrapped.append(model(_shifted(anchor, off[i]), beta, -1.0, shape.pulley_radius))
                arms.append(_shifted(_ringed(shape.lower_attachment_radius, along, beta, 0.0), own[i]))
        for i, beta in enumerate(AZIMUTHS):
            # a round upper platform that does not turn is its cables' meeting point, moved outwards
            reach = shape.pulley_circle_radius - shape.upper_attachment_radius
            anchor = _ringed(reach, 0.0, beta, shape.upper_pulley_height)
            place = _shifted(anchor, off[3 + i] - own[3 + i])
            wrapped.append(model(place, beta, 1.0, shape.pulley_radius))
        level = _shifted((0.0, 0.0, shape.reference_height), known.reference())
        return cls(tuple(wrapped), tuple(arms), level, (0.0, 0.0, top))


def _ringed(radius: float, along: float, beta: float, height: float) -> Point:
    """Radius outwards and ``along`` the tangent at azimuth beta."""
    c, s = cos(beta), sin(beta)
    return radius * c - along * s, radius * s + along * c, height


def _shifted(point: Point, by: Array) -> Point:
    x, y, z = by.tolist()
    return point[0] + x, point[1] + y, point[2] + z
