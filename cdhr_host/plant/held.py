"""Platforms held by rigid cables: where the sliders put them, by Newton's method, one pose at a time."""

from collections.abc import Callable
from math import sqrt
from typing import Final

from cdhr_host.errors import MotionError, Problem
from cdhr_host.plant.strands import LEFT, RIGHT, TOP, Point, Pull, Strands
from cdhr_host.units import MM

MAX_STEPS: Final = 30
SETTLED: Final = 1e-12
"""m of a step that ends the search"""
STEP_LIMIT: Final = 0.2
"""m"""


class Held:
    """Both platforms as points on three cables each: a pair holds its platform level."""

    def __init__(self, strands: Strands) -> None:
        self._strands = strands
        self._rest = (*self._lower_lengths((0.0, 0.0, 0.0)), *self._upper_lengths((0.0, 0.0, 0.0)))

    def lower(self, slider: tuple[float, ...], near: Point) -> Point:
        """(3,) m of sliders 1-3 -> displacement of the lower platform; raises MotionError without one."""
        goal = tuple(rest[0] + moved for rest, moved in zip(self._rest[:3], slider, strict=True))
        return _solved(self._lower_lengths, goal, near)

    def upper(self, slider: tuple[float, ...], near: Point) -> Point:
        """(3,) m of sliders 4-6 -> displacement of the upper platform; raises like ``lower``."""
        goal = tuple(rest[0] + moved for rest, moved in zip(self._rest[3:], slider, strict=True))
        return _solved(self._upper_lengths, goal, near)

    def lengths(self, lower: Point, upper: Point) -> tuple[float, ...]:
        """(6,) m from the lengths at the reference pose: what the sliders pay out."""
        now = (*self._lower_lengths(lower), *self._upper_lengths(upper))
        return tuple(length[0] - rest[0] for length, rest in zip(now, self._rest, strict=True))

    def _lower_lengths(self, q: Point) -> tuple[Pull, ...]:
        """The mean of each pair: its slider winds both, and the platform's tilt makes up the rest."""
        (x, y, z), wrapped, arms = self._strands.lower, self._strands.wrapped, self._strands.arms
        x, y, z = x + q[0], y + q[1], z + q[2]
        found: list[Pull] = []
        for left, right in zip(LEFT, RIGHT, strict=True):
            (a, b, c), (d, e, f) = arms[left], arms[right]
            one = wrapped[left](x + a, y + b, z + c)
            two = wrapped[right](x + d, y + e, z + f)
            found.append(
                (
                    0.5 * (one[0] + two[0]),
                    0.5 * (one[1] + two[1]),
                    0.5 * (one[2] + two[2]),
                    0.5 * (one[3] + two[3]),
                )
            )
        return tuple(found)

    def _upper_lengths(self, q: Point) -> tuple[Pull, ...]:
        x, y, z = self._strands.upper
        return tuple(self._strands.wrapped[i](x + q[0], y + q[1], z + q[2]) for i in TOP)


def _solved(lengths: Callable[[Point], tuple[Pull, ...]], goal: tuple[float, ...], near: Point) -> Point:
    """The displacement with these three lengths, from ``near`` on: e_i·step = l_i(q) - goal_i."""
    q = near
    for _ in range(MAX_STEPS):
        a, b, c = lengths(q)
        (p, ax, ay, az), (r, bx, by, bz), (t, cx, cy, cz) = a, b, c
        p, r, t = p - goal[0], r - goal[1], t - goal[2]
        ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        vx, vy, vz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
        wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        det = ax * ux + ay * uy + az * uz
        x = (p * ux + r * vx + t * wx) / det
        y = (p * uy + r * vy + t * wy) / det
        z = (p * uz + r * vz + t * wz) / det
        size = sqrt(x * x + y * y + z * z)
        part = min(1.0, STEP_LIMIT / size) if size else 1.0
        q = q[0] + part * x, q[1] + part * y, q[2] + part * z
        if size < SETTLED:
            return q
    raise MotionError(
        Problem(
            "reach",
            f"no pose has these cable lengths: after {MAX_STEPS} steps still {size / MM:.3g} mm away",
            value=size / MM,
            limit=0.0,
            unit="mm",
            hint="the sliders left the machine's workspace",
        )
    )
