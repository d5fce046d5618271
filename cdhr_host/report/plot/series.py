"""Panels over time, drawn: every interval from its least to its greatest, windows behind."""

from typing import TYPE_CHECKING, Final

import numpy as np

from cdhr_host.report.plot.panels import Panel, Rows
from cdhr_host.report.plot.passing import Drawn
from cdhr_host.report.plot.style import COLOURS, WINDOW, clock, clock_axis, number_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROOM: Final = 0.06
"""of the time shown, that the name of an event takes"""
SEEN: Final = 0.25
"""of a window's size that curves must reach for its ends to be drawn when they are far away"""


def draw_series(figure: "Figure", drawn: Drawn, rows: Rows) -> None:
    """Fill a figure with rows of panels above one time axis."""
    width = max(len(row) for row in rows)
    axes = figure.subplots(len(rows), width, sharex=True, squeeze=False)
    for row, places in zip(rows, axes, strict=True):
        for panel, place in zip(row, places, strict=True):
            _panel(place, drawn, panel)
    for place in axes[-1]:
        clock_axis(place, *drawn.times)
    for place in axes[0]:
        _events(place, drawn)


def _events(axes: "Axes", drawn: Drawn) -> None:
    """Name what happened on the way, the last thing of each moment, where the names have room."""
    begin, end = drawn.times
    free, unit = end, clock(begin, end)[0]
    for t, words in sorted({event.t: event.kind for event in drawn.events}.items(), reverse=True):
        if begin <= t <= free:
            place = (t / unit, 1.0)
            axes.text(
                *place, words, transform=axes.get_xaxis_transform(), ha="right", va="bottom", color="0.3"
            )
            free = t - ROOM * (end - begin)


def _panel(axes: "Axes", drawn: Drawn, panel: Panel) -> None:
    for k, curve in enumerate(panel.curves):
        colour = COLOURS[k // 2 if any(each.dashed for each in panel.curves) else k]
        _curve(axes, drawn, curve.column, colour, curve.dashed)
        axes.plot(
            [],
            [],
            color=colour,
            linestyle="--" if curve.dashed else "-",
            label=_label(drawn, curve.column, curve.label),
        )
    title = panel.title
    if panel.window is not None and not _window(axes, panel.window):
        title += f" (limit {_window_text(panel.window)} {panel.unit})"
    axes.set_title(title, loc="left")
    axes.set_ylabel(panel.unit)
    for t in sorted({event.t for event in drawn.events}):
        axes.axvline(t / clock(*drawn.times)[0], color="0.4", linestyle=":", linewidth=0.8, clip_on=False)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.04), handlelength=1.4)


def _curve(axes: "Axes", drawn: Drawn, column: str, colour: str, dashed: bool) -> None:
    low, high, t = drawn.low[column], drawn.high[column], drawn.low["t_s"] / clock(*drawn.times)[0]
    if drawn.span > 1:  # up and down in each interval
        t, low = np.repeat(t, 2), np.column_stack([low, high]).ravel()
    style = (0, (4, 2)) if dashed else "-"
    axes.plot(t, low, color=colour, linestyle=style, linewidth=0.9, alpha=0.8 if drawn.span > 1 else 1.0)


def _label(drawn: Drawn, column: str, label: str) -> str:
    low, _, _, high, _, _ = drawn.extremes[column]
    return f"{label}:  {number_text(low)} … {number_text(high)}"


def _window(axes: "Axes", window: tuple[float, float]) -> bool:
    """Draw a window where curves come near its ends; says whether it did."""
    low, high = window
    bottom, top = axes.get_ylim()
    if max(abs(bottom), abs(top)) < SEEN * max(abs(low), abs(high)):
        return False
    axes.axhspan(low, high, color=WINDOW, zorder=-2)
    for end in window:
        axes.axhline(end, color="0.35", linewidth=0.8, linestyle=(0, (6, 3)), zorder=-1)
    return True


def _window_text(window: tuple[float, float]) -> str:
    low, high = window
    return f"±{high:g}" if low == -high else f"{low:g} to {high:g}"
