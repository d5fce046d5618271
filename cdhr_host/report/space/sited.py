"""A program inside the machine's volume: its margins as it is, and where it would sit best."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cdhr_host.mechanism import Workspace
from cdhr_host.mechanism.margin_map import HEIGHT_STEP, MarginMap, limited_margin
from cdhr_host.mechanism.siting import Site, best_site
from cdhr_host.units import MM
from cdhr_host.values import Array, Ints

GAIN: Final = 0.005
"""of margin, below which a place is as good as another"""


@dataclass(frozen=True, slots=True)
class Sited:
    """Where a program is, and where it could be."""

    places_G: Array
    """(N, 3) m"""
    lines: Ints
    """(N,)"""
    margin: Array
    """(N,) as the program is"""
    edge: float
    """m: places are about this far apart"""
    plane: Site
    """the best shift in the plane, at the height it has"""
    space: Site
    """the best shift altogether"""

    @property
    def least(self) -> int:
        """Index of the place with the least margin."""
        return int(self.margin.argmin())

    @property
    def outside(self) -> float:
        """Share of the places outside a window or a limit."""
        return float((self.margin < 0.0).mean())


def sited(
    space: Workspace,
    chart: MarginMap,
    places: tuple[Array, Ints, float],
    acceleration: float,
    told: Callable[[float], None] = lambda _: None,
) -> Sited:
    """Places ``_G``, their lines and spacing -> Sited; ``told`` hears the share that is done."""
    places_G, lines, edge = places
    q = places_G - space.cables.reference_G
    margin = limited_margin(space, q, acceleration)
    low, high = _bounds(space, chart, q)
    level = np.array([1.0, 1.0, 0.0])
    plane = best_site(
        space, chart, q, (low * level, high * level), acceleration=acceleration, told=lambda x: told(0.3 * x)
    )
    free = best_site(
        space, chart, q, (low, high), acceleration=acceleration, told=lambda x: told(0.3 + 0.7 * x)
    )
    best = max(plane, free, key=lambda site: site.margin)
    return Sited(places_G, lines, margin, edge, plane, best)


def _bounds(space: Workspace, chart: MarginMap, q: Array) -> tuple[Array, Array]:
    """(3,), (3,) m: shifts that keep the middle near the axis, and bed and part between the pulleys."""
    middle = 0.5 * (q[:, :2].min(axis=0) + q[:, :2].max(axis=0))
    away = 0.5 * float(chart.reach().max())
    floor = float(space.cables.anchors[0, 2] + HEIGHT_STEP - space.cables.attachments[0, 2])
    bed = float(-space.cables.reference_G[2])
    top = float(chart.height[-1] - q[:, 2].max())
    low = np.array([*(-middle - away), min(floor - bed, 0.0)])
    return low, np.array([*(-middle + away), max(top, 0.0)])


def sited_lines(found: Sited, space: Workspace, name: str) -> list[str]:
    """What a person wants to know of it."""
    k = found.least
    x, y, z = found.places_G[k] / MM
    where = f"at x {x:.1f}, y {y:.1f}, z {z:.1f} mm (line {found.lines[k]})"
    head = (
        f"{name}: {100 * found.outside:.1f} % of its places are outside"
        if found.outside
        else f"{name}: inside"
    )
    return [
        f"{head}; least margin {found.margin[k]:.3f} {where}",
        f"  half of its {len(found.lines)} places, {found.edge / MM:g} mm apart, "
        f"have more than {np.median(found.margin):.3f}",
        *_site_lines("in the plane", found.plane, space, float(found.margin[k])),
        *_site_lines("with its height", found.space, space, max(found.plane.margin, float(found.margin[k]))),
    ]


def _site_lines(words: str, site: Site, space: Workspace, otherwise: float) -> list[str]:
    if site.margin < otherwise + GAIN:
        return [f"  best {words}: no place is better by more than {GAIN:g}"]
    bed, shift = space.profile.bed, site.shift / MM
    keys = [
        f"origin_{axis}_mm = {getattr(bed, f'origin_{axis}') / MM + move:.1f}"
        for axis, move in zip("xyz", shift, strict=True)
        if abs(move) >= 0.05
    ]
    moved = ", ".join(f"{axis} {move:+.1f}" for axis, move in zip("xyz", shift, strict=True))
    where = f"  best {words}: {moved} mm, least margin {site.margin:.3f}"
    level = "; or move it so in the slicer" if abs(shift[2]) < 0.05 else ""
    return [where, f"    [bed] {', '.join(keys)}{level}"]


def sited_record(found: Sited, space: Workspace, name: str) -> dict[str, Any]:
    """The same for machines, in millimetres."""
    k = found.least
    return {
        "name": name,
        "places": len(found.lines),
        "spacing_mm": found.edge / MM,
        "least_margin": float(found.margin[k]),
        "least_at_mm": (found.places_G[k] / MM).tolist(),
        "least_line": int(found.lines[k]),
        "median_margin": float(np.median(found.margin)),
        "outside": found.outside,
        "best_in_plane": _site_record(found.plane, space),
        "best": _site_record(found.space, space),
    }


def _site_record(site: Site, space: Workspace) -> dict[str, Any]:
    bed = space.profile.bed
    origin = np.array([bed.origin_x, bed.origin_y, bed.origin_z]) + site.shift
    return {
        "shift_mm": (site.shift / MM).tolist(),
        "bed_origin_mm": (origin / MM).tolist(),
        "least_margin": site.margin,
    }
