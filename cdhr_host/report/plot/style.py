"""How pictures look: colours every eye can tell apart, units on every axis, clocks on long ones."""

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Okabe and Ito, Color universal design, 2008"""
WINDOW: Final = "#eef3f0"
SETTINGS: Final[Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.fonttype": "none",
    "figure.dpi": 120,
}
MINUTES, HOURS = 300.0, 3 * 3600.0
"""s from which a time axis counts in minutes, in hours"""


def clock(begin: float, end: float) -> tuple[float, str]:
    """s in the unit in which a time axis counts, and the unit's name."""
    span = end - begin
    return (3600.0, "h") if span > HOURS else (60.0, "min") if span > MINUTES else (1.0, "s")


def clock_axis(axes: "Axes", begin: float, end: float) -> None:
    """Label a time axis over which curves are drawn in the unit of ``clock``."""
    unit, name = clock(begin, end)
    axes.set_xlim(begin / unit, end / unit)
    axes.set_xlabel(f"time since the program's start, {name}")


def number_text(value: float) -> str:
    """Four digits at most, never an exponent for what people read."""
    if abs(value) >= 1000.0:
        return f"{value:.0f}"
    return f"{value:.4g}" if abs(value) >= 1e-3 or value == 0.0 else f"{value:.1e}"
