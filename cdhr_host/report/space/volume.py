"""The wrench-feasible volume in words and as a record."""

from typing import Any

import numpy as np

from cdhr_host.mechanism import Workspace
from cdhr_host.mechanism.margin_map import MarginMap
from cdhr_host.units import DEG, MM

LITRE = 1e-3
"""m³"""


def volume_lines(chart: MarginMap, space: Workspace) -> list[str]:
    """What a person wants to know of it."""
    policy = space.profile.spring.policy
    head = f"wrench-feasible under its policy {policy}: {chart.volume() / LITRE:.1f} l"
    if not chart.feasible.any():
        return [f"{head}; no place keeps all its limits"]
    low, high = _heights(chart, space)
    r, turn, h = _middle(chart)
    where = (
        f"radius {r / MM:.0f} mm, azimuth {turn / DEG:.0f} degrees, height {(h + _offset(space)) / MM:.0f} mm"
    )
    return [
        f"{head}, give or take {chart.doubt / LITRE:.1f} l",
        "  all nine cables, slider travel, wrap and fleet angles",
        f"  heights {low / MM:.0f} to {high / MM:.0f} mm above the lower pulleys, "
        f"radius up to {chart.reach().max() / MM:.0f} mm",
        f"  most margin {chart.margin.max():.3f} at {where}",
    ]


def volume_record(chart: MarginMap, space: Workspace) -> dict[str, Any]:
    """The same for machines."""
    heights = None if not chart.feasible.any() else [each / MM for each in _heights(chart, space)]
    return {
        "policy": space.profile.spring.policy,
        "litres": chart.volume() / LITRE,
        "doubt_litres": chart.doubt / LITRE,
        "heights_mm": heights,
        "radius_max_mm": float(chart.reach().max()) / MM,
        "margin_max": float(chart.margin.max()),
    }


def _offset(space: Workspace) -> float:
    """m: height of the lower platform above the lower pulleys at the reference pose."""
    return float(space.cables.attachments[0, 2] - space.cables.anchors[0, 2])


def _heights(chart: MarginMap, space: Workspace) -> tuple[float, float]:
    there = chart.height[chart.feasible.any(axis=(0, 1))]
    return float(there[0]) + _offset(space), float(there[-1]) + _offset(space)


def _middle(chart: MarginMap) -> tuple[float, float, float]:
    r, turn, h = np.unravel_index(chart.margin.argmax(), chart.margin.shape)
    return float(chart.radius[r]), float(chart.azimuth[turn]), float(chart.height[h])
