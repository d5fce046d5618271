"""The path in three dimensions, from above, and its height over time, with a colour that tells something."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cdhr_host.report.plot.passing import Drawn
from cdhr_host.report.plot.style import clock, clock_axis, number_text
from cdhr_host.values import Array, Flags

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MANY: Final = 4000
"""segments from which vector pictures keep them as pixels"""
TRAVEL: Final = "0.65"


@dataclass(frozen=True, slots=True)
class Colouring:
    """A quantity as colours."""

    column: str
    words: str
    map: str


COLOURINGS: Final = {
    "speed": Colouring("speed_mm_s", "speed, mm/s", "viridis"),
    "tension": Colouring("tension", "greatest cable force, N", "cividis"),
    "pressure": Colouring("pressure_kpa", "pressure, kPa", "viridis"),
    "layer": Colouring("z_mm", "height, mm", "viridis"),
}
MARGIN: Final = Colouring("margin", "least force margin: 1 mid-window, 0 at its end", "cividis")
"""in place of the greatest force, where the windows are known"""


def colouring(drawn: Drawn, name: str) -> Colouring | None:
    """What ``--colour`` asks for; None where the log does not tell it."""
    if name == "tension" and "tension1_n" not in drawn:
        return None
    return MARGIN if name == "tension" and drawn.profile is not None else COLOURINGS[name]


@dataclass(frozen=True, slots=True)
class _Dye:
    """Numbers of the M - 1 segments between M vertices, and how they become colours."""

    values: Array
    laid: Flags
    map: str
    limits: tuple[float, float]


def draw_path(figure: "Figure", drawn: Drawn, chosen: Colouring) -> None:
    """Three views and one scale of colours."""
    grid = figure.add_gridspec(2, 2, width_ratios=[1.35, 1.0], height_ratios=[1.6, 1.0])
    places = drawn.vertices.columns(["x_mm", "y_mm", "z_mm"])
    laid = drawn.vertices["flow"][1:] > 0.0
    values = 0.5 * (drawn.vertices[chosen.column][1:] + drawn.vertices[chosen.column][:-1])
    shown = values[laid] if laid.any() else values
    dye = _Dye(values, laid, chosen.map, _limits(shown))
    space = figure.add_subplot(grid[:, 0], projection="3d")
    scale = _coloured(space, places, dye)
    _boxed(space, places)
    space.set_title(_reach(drawn), loc="left", y=0.98)
    above = figure.add_subplot(grid[0, 1])
    _coloured(above, places[:, :2], dye)
    above.set(aspect="equal", xlabel="x, mm", ylabel="y, mm")
    above.set_title("from above", loc="left")
    above.autoscale_view()
    _height(figure.add_subplot(grid[1, 1]), drawn)
    figure.colorbar(scale, ax=space, label=chosen.words, location="bottom", shrink=0.7, pad=0.0, aspect=36)


def _limits(values: Array) -> tuple[float, float]:
    if not len(values):
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    return low, high if high > low else low + 1.0


def _coloured(axes: Any, places: Array, dye: "_Dye") -> Any:
    """Travel thin and grey, laid clay in colours; returns what the scale is made from."""
    from matplotlib.collections import LineCollection  # noqa: PLC0415 -- may be missing
    from mpl_toolkits.mplot3d.art3d import Line3DCollection  # noqa: PLC0415

    kind = LineCollection if places.shape[1] == 2 else Line3DCollection
    segments = np.stack([places[:-1], places[1:]], axis=1)

    def pieces(which: Flags) -> list[Array]:
        return list(segments[which])

    many = len(segments) > MANY
    laid = dye.laid if dye.laid.any() else ~dye.laid
    if not laid.all():
        axes.add_collection(kind(pieces(~laid), colors=TRAVEL, linewidths=0.5, rasterized=many))
    lines = kind(pieces(laid), cmap=dye.map, linewidths=1.4 if places.shape[1] == 2 else 1.0, rasterized=many)
    lines.set_array(dye.values[laid])
    lines.set_clim(*dye.limits)
    axes.add_collection(lines)
    return lines


def _reach(drawn: Drawn) -> str:
    """How far the path goes, and how fast."""
    found = [f"{axis} {_span(drawn, f'{axis}_mm')}" for axis in "xyz"]
    fastest = drawn.extremes["speed_mm_s"]
    return f"{',  '.join(found)} mm;  up to {number_text(fastest[3])} mm/s at line {fastest[5]}"


def _span(drawn: Drawn, column: str) -> str:
    low, _, _, high, _, _ = drawn.extremes[column]
    return f"{number_text(low)} … {number_text(high)}"


def _boxed(axes: Any, places: Array) -> None:
    """The same scale along all three axes."""
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 -- may be missing

    low, high = places.min(axis=0), places.max(axis=0)
    size = np.maximum(high - low, 0.12 * max(float((high - low).max()), 1.0))
    middle = 0.5 * (low + high)
    for axis, name in enumerate("xyz"):
        getattr(axes, f"set_{name}lim")(middle[axis] - 0.5 * size[axis], middle[axis] + 0.5 * size[axis])
        getattr(axes, f"set_{name}label")(f"{name}, mm")
        getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(max(2, int(7 * size[axis] / size.max()))))
    axes.set_box_aspect(size, zoom=0.92)
    axes.view_init(elev=28, azim=-58)


def _height(axes: "Axes", drawn: Drawn) -> None:
    t, low, high = drawn.low["t_s"] / clock(*drawn.times)[0], drawn.low["z_mm"], drawn.high["z_mm"]
    axes.fill_between(t, low, high, color="#0072B2", alpha=0.25, linewidth=0)
    axes.plot(t, 0.5 * (low + high), color="#0072B2", linewidth=1.0)
    axes.set_ylabel("z, mm")
    axes.set_title("height", loc="left")
    clock_axis(axes, *drawn.times)
