"""The force margin over the whole machine, on a cylindrical grid of one sector: volume, slices, look-up."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from cdhr_host.mechanism.workspace import Workspace
from cdhr_host.units import DEG, MM
from cdhr_host.values import Array, Flags

RADIUS_STEP: Final = 10.0 * MM
AZIMUTH_STEP: Final = 2.5 * DEG
HEIGHT_STEP: Final = 20.0 * MM
SECTOR: Final = 60.0 * DEG
"""three cables and their mirror images: the rest of the circle follows by symmetry, as drawn"""
WORST: Final = -2.0
"""margin told where cables are out of reach or a limit of sliders or pulleys is broken"""


@dataclass(frozen=True, slots=True)
class MarginMap:
    """Margins of the lower platform's places about the machine's axis."""

    radius: Array
    """(R,) m from the axis"""
    azimuth: Array
    """(A,) rad, from 0 (cable 1) to 60 degrees; to 360 where the machine differs from its drawing"""
    height: Array
    """(H,) m: displacement along z from the reference pose"""
    margin: Array
    """(R, A, H): least of the nine cables in half-widths of their windows; WORST at least"""

    @property
    def feasible(self) -> Flags:
        """(R, A, H)"""
        return np.asarray(self.margin >= 0.0)

    def volume(self, every: int = 1) -> float:
        """m³ in which all cables are inside their windows, of every n-th node only."""
        good = self.feasible[::every, ::every, ::every]
        sizes = [_weights(axis[::every]) for axis in (self.radius, self.azimuth, self.height)]
        around = 2.0 * np.pi / float(self.azimuth[-1])
        rings = self.radius[::every] * sizes[0]
        return float(around * np.einsum("rah,r,a,h->", good, rings, sizes[1], sizes[2]))

    @property
    def doubt(self) -> float:
        """m³ by which the grid may be wrong: what half as many nodes along each axis would change."""
        return abs(self.volume() - self.volume(2))

    def reach(self) -> Array:
        """(A, H) m: greatest feasible radius without a gap from the axis on; 0 where there is none."""
        far = np.cumprod(self.feasible, axis=0).sum(axis=0) - 1
        return np.asarray(np.where(far >= 0, self.radius[np.maximum(far, 0)], 0.0))

    def at(self, places: Array) -> Array:
        """(N, 3) m from the reference pose -> (N,): the margin between the nodes, WORST beyond them."""
        x, y, z = places.T
        points = np.column_stack([np.hypot(x, y), self.folded(np.arctan2(y, x)), z])
        return np.asarray(self.look_up()(points))

    def folded(self, azimuth: Array) -> Array:
        """rad -> rad in the part that was mapped, where the margin is the same."""
        span = float(self.azimuth[-1])
        if span > SECTOR * 1.01:
            return np.asarray(np.mod(azimuth, span))
        turn = np.mod(azimuth, 2.0 * span)
        return np.asarray(np.minimum(turn, 2.0 * span - turn))

    def look_up(self) -> RegularGridInterpolator:
        """(N, 3) of radius, folded azimuth and height -> (N,) margins, linear between the nodes."""
        axes = self.radius, self.azimuth, self.height
        return RegularGridInterpolator(axes, self.margin, bounds_error=False, fill_value=WORST)


def margin_map(
    space: Workspace, acceleration: float = 0.0, told: Callable[[float], None] = lambda _: None
) -> MarginMap:
    """All places between the pulleys, with an acceleration (m/s²) to spare in the worst direction.

    ``told`` hears the share that is done.
    """
    anchors, attached = space.cables.anchors, space.cables.attachments
    reach = float(np.linalg.norm(anchors[0, :2]) - np.linalg.norm(attached[0, :2]))
    radius = np.arange(0.0, reach, RADIUS_STEP)
    span, step = (SECTOR, AZIMUTH_STEP) if space.symmetric else (2.0 * np.pi, 4.0 * AZIMUTH_STEP)
    azimuth = np.linspace(0.0, span, round(span / step) + 1)
    floor, ceiling = anchors[0, 2] - attached[0, 2], anchors[3, 2] - attached[3, 2]
    height = np.arange(floor + HEIGHT_STEP, ceiling, HEIGHT_STEP)
    margin = np.empty((len(radius), len(azimuth), len(height)))
    r, turn = (each.ravel() for each in np.meshgrid(radius, azimuth, indexing="ij"))
    for k, z in enumerate(height):
        places = np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(len(r), z)])
        margin[:, :, k] = limited_margin(space, places, acceleration).reshape(len(radius), len(azimuth))
        told((k + 1) / len(height))
    return MarginMap(radius, azimuth, height, margin)


def limited_margin(space: Workspace, places: Array, acceleration: float = 0.0) -> Array:
    """(N, 3) m -> (N,): the force margin, WORST where sliders, pulleys or reach forbid the place."""
    found = np.maximum(space.margin(places, acceleration), WORST)
    found[~space.within_limits(places)] = WORST
    return found


def _weights(axis: Array) -> Array:
    """(N,) ascending -> (N,): the length that each node stands for (trapezoids)."""
    return np.asarray(np.diff(np.concatenate([axis[:1], 0.5 * (axis[1:] + axis[:-1]), axis[-1:]])))
