"""Figures of the reproduction, by matplotlib: the extra ``plot``."""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cdhr_host.report.paper.items import Item, Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINTS: Final = 4000
"""of a curve that are drawn"""


def available() -> bool:
    """Whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def draw(item: Item, path: Path) -> None:
    """One picture with the panels of an item above each other; the suffix chooses the format."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415 -- may be missing
    from matplotlib.figure import Figure  # noqa: PLC0415 -- may be missing

    figure = Figure(figsize=(8.0, 2.6 * len(item.panels) + 0.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(item.panels), squeeze=False)[:, 0]
    for panel, place in zip(item.panels, axes, strict=True):
        _curves(panel, place)
    axes[-1].set_xlabel("t, s")
    figure.suptitle(item.title, fontsize=10)
    figure.savefig(path, dpi=110)


def _curves(panel: Panel, axes: "Axes") -> None:
    every = max(1, len(panel.t) // POINTS)
    for name, values in panel.curves.items():
        axes.plot(panel.t[::every], values[::every], label=name, linewidth=0.8)
    axes.set_title(panel.title, fontsize=8)
    axes.set_ylabel(panel.unit)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="upper left")
