"""The feasible volume drawn: in three dimensions, cut upright, and in level slices, with a part inside."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cdhr_host.mechanism import Workspace
from cdhr_host.mechanism.margin_map import MarginMap
from cdhr_host.report.files import put
from cdhr_host.report.plot.style import SETTINGS
from cdhr_host.report.space.sited import Sited
from cdhr_host.units import DEG, MM
from cdhr_host.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SLICES: Final = 4
SHADES: Final = 33
ROUND: Final = np.linspace(0.0, 360.0, 145) * DEG
"""azimuths drawn, 2.5 degrees apart as those of the map"""
PART: Final = "#D55E00"
BED: Final = "0.25"
DOTS: Final = 4000
"""places of a part that are drawn"""


def draw_map(chart: MarginMap, space: Workspace, part: Sited | None, title: str, path: Path) -> None:
    """Write the picture; PNG, SVG or PDF by suffix. Raises OSError when the disk refuses."""
    import matplotlib as mpl  # noqa: PLC0415 -- may be missing

    with mpl.rc_context(SETTINGS), put(path) as target:
        _figure(chart, space, part, title).savefig(target, dpi=120)


def _figure(chart: MarginMap, space: Workspace, part: Sited | None, title: str) -> "Figure":
    from matplotlib.figure import Figure  # noqa: PLC0415 -- may be missing

    figure = Figure(figsize=(14.0, 9.5), layout="constrained")
    levels = _levels(chart, part, float(space.cables.reference_G[2]))
    grid = figure.add_gridspec(2, 1, height_ratios=[1.6, 1.0])
    above, below = grid[0].subgridspec(1, 2, width_ratios=[1.2, 1.0]), grid[1].subgridspec(1, SLICES)
    _solid(figure.add_subplot(above[0], projection="3d"), chart, space, part)
    upright = figure.add_subplot(above[1])
    scale = _upright(upright, chart, space, part)
    slices = [figure.add_subplot(below[k]) for k in range(len(levels))]
    slices[0].set_ylabel("y, mm")
    for axes, k in zip(slices, levels, strict=True):
        _slice(axes, chart, space, part, k)
    words = "least force margin: 1 mid-window, 0 at its end"
    figure.colorbar(scale, ax=upright, label=words, aspect=40, format="%.2f")
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def _shade(axes: "Axes", x: Array, y: Array, margin: Array, most: float) -> Any:
    """A field of margins, white where not feasible, its rim drawn."""
    field = axes.contourf(x, y, margin, levels=np.linspace(0.0, most, SHADES), cmap="cividis")
    axes.contour(x, y, margin, levels=[0.0], colors="0.2", linewidths=0.8)
    axes.set_aspect("equal")
    return field


def _most(chart: MarginMap) -> float:
    return max(float(chart.margin.max()), 0.01)


def _above(space: Workspace, z: Array) -> Array:
    """m from the reference pose -> mm above the lower pulleys."""
    offset = space.cables.attachments[0, 2] - space.cables.anchors[0, 2]
    return np.asarray((z + offset) / MM)


def _upright(axes: "Axes", chart: MarginMap, space: Workspace, part: Sited | None) -> Any:
    """A cut through the axis: towards cable 1 to the right, away from it to the left."""
    margin = np.concatenate([chart.margin[:0:-1, -1], chart.margin[:, 0]])
    x = np.concatenate([-chart.radius[:0:-1], chart.radius]) / MM
    mesh = _shade(axes, *np.meshgrid(x, _above(space, chart.height)), margin.T, _most(chart))
    bed = space.profile.bed
    centre, ends = bed.origin_x / MM, np.array([-1.0, 1.0]) * bed.radius / MM
    level = _above(space, np.array([-space.cables.reference_G[2]]))[0]
    corners = [*(centre + ends), *(centre + ends[::-1]), centre + ends[0]]
    heights = [level, level, level + bed.height / MM, level + bed.height / MM, level]
    axes.plot(corners, heights, color=BED, linewidth=1.0, linestyle="--", label="bed's volume")
    if part is not None:
        q = _dots(part) - space.cables.reference_G
        axes.plot(
            q[:, 0] / MM,
            _above(space, q[:, 2]),
            ".",
            color=PART,
            markersize=1.2,
            label="the part",
            rasterized=True,
        )
    rim = 1.05 * max(float(chart.reach().max()), bed.radius) / MM
    axes.set(
        xlim=(-rim, rim),
        xlabel="x of the lower platform from the axis, mm",
        ylabel="height above the lower pulleys, mm",
    )
    axes.set_title("cut through the axis: cable 1 to the right", loc="left")
    axes.legend(loc="upper right", markerscale=8)
    return mesh


def _levels(chart: MarginMap, part: Sited | None, reference: float) -> list[int]:
    """Heights of the slices: through the part, or the feasible volume."""
    there = np.flatnonzero(chart.feasible.any(axis=(0, 1)))
    if not there.size:
        there = np.arange(len(chart.height))
    low, high = chart.height[there[0]], chart.height[there[-1]]
    if part is not None:
        z = part.places_G[:, 2] - reference
        low, high = float(z.min()), float(z.max())
        return sorted({int(np.abs(chart.height - h).argmin()) for h in np.linspace(low, high, SLICES)})
    return [int(np.abs(chart.height - h).argmin()) for h in np.linspace(low, high, SLICES + 2)[1:-1]]


def _slice(axes: "Axes", chart: MarginMap, space: Workspace, part: Sited | None, k: int) -> None:
    reach = min(1.1 * max(float(chart.reach()[:, k].max()), 0.05), float(chart.radius[-1]))
    near = chart.radius <= 1.4 * reach
    columns = np.searchsorted(chart.azimuth, chart.folded(ROUND) - 1e-9).clip(0, len(chart.azimuth) - 1)
    r, turn = np.meshgrid(chart.radius[near], ROUND, indexing="ij")
    _shade(
        axes, r * np.cos(turn) / MM, r * np.sin(turn) / MM, chart.margin[near][:, columns, k], _most(chart)
    )
    bed = space.profile.bed
    circle = bed.radius * np.column_stack([np.cos(ROUND), np.sin(ROUND)]) + [bed.origin_x, bed.origin_y]
    axes.plot(*(circle.T / MM), color=BED, linewidth=0.8, linestyle="--")
    if part is not None:
        q = part.places_G - space.cables.reference_G
        level = np.abs(q[:, 2] - chart.height[k]) < 6.0 * MM
        axes.plot(*(q[level, :2].T / MM), ".", color=PART, markersize=1.5, rasterized=True)
    axes.set(xlabel="x, mm", title=f"height {_above(space, chart.height[k : k + 1])[0]:.0f} mm")
    rim = 1.15 * max(reach, bed.radius) / MM
    axes.set(xlim=(-rim, rim), ylim=(-rim, rim))


def _solid(axes: Any, chart: MarginMap, space: Workspace, part: Sited | None) -> None:
    """The outer surface by the reach in every direction."""
    reach = chart.reach()
    there = np.flatnonzero(reach.max(axis=0) > 0.0)
    columns = np.searchsorted(chart.azimuth, chart.folded(ROUND) - 1e-9).clip(0, len(chart.azimuth) - 1)
    if there.size:
        radius = reach[columns][:, there]
        turn, z = np.meshgrid(ROUND, _above(space, chart.height[there]), indexing="ij")
        x, y = radius * np.cos(turn) / MM, radius * np.sin(turn) / MM
        axes.plot_surface(
            x, y, z, cmap="viridis", alpha=0.35, linewidth=0.0, rcount=90, ccount=90, rasterized=True
        )
    for k in range(3):
        foot, head = space.cables.anchors[k], space.cables.anchors[3 + k]
        axes.plot(*(np.column_stack([foot, head]) - [[0], [0], [foot[2]]]) / MM, color="0.5", linewidth=1.5)
    bed = space.profile.bed
    level = _above(space, np.array([-space.cables.reference_G[2]]))[0]
    rim = (bed.radius * np.array([np.cos(ROUND), np.sin(ROUND)]) + [[bed.origin_x], [bed.origin_y]]) / MM
    axes.plot(*rim, level, color=BED, linewidth=1.0, linestyle="--")
    if part is not None:
        q = _dots(part) - space.cables.reference_G
        axes.plot(
            q[:, 0] / MM,
            q[:, 1] / MM,
            _above(space, q[:, 2]),
            ".",
            color=PART,
            markersize=1.0,
            rasterized=True,
        )
    axes.set(xlabel="x, mm", ylabel="y, mm", zlabel="height above the lower pulleys, mm")
    axes.set_aspect("equal")
    axes.view_init(elev=18, azim=-50)
    axes.set_title("places of the lower platform, between the pulleys", loc="left")


def _dots(part: Sited) -> Array:
    """(M, 3) m ``_G``: places to draw."""
    return part.places_G[:: max(1, len(part.places_G) // DOTS)]
