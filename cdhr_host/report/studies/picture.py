"""A calibration drawn: residuals by point, where the drawing was off, the parameters with their doubts."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdhr_host.mechanism.calibration_model import NAMES
from cdhr_host.report.studies.fit import GeometryFit, distance
from cdhr_host.units import MM

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(fit: GeometryFit, title: str, path: Path) -> None:
    """Residuals before and after, and by coordinate; raises ImportError without matplotlib."""
    from matplotlib.figure import Figure  # noqa: PLC0415 -- may be missing

    figure = Figure(figsize=(11, 7), layout="constrained")
    (left, right), (below, last) = figure.subplots(2, 2)
    _draw_distances(fit, left)
    _draw_coordinates(fit, right)
    _draw_arrows(fit, below)
    _draw_parameters(fit, last)
    figure.suptitle(title)
    figure.savefig(path, dpi=120)


def _draw_distances(fit: GeometryFit, axes: "Axes") -> None:
    first = distance(fit.first) / MM
    number = np.arange(1, len(first) + 1)
    axes.semilogy(number, first, "o", color="0.6", label="by the drawing")
    axes.semilogy(number, distance(fit.found.residual) / MM, "o", label="by the fit")
    axes.axhline(np.sqrt(3.0) * fit.found.noise / MM, color="k", lw=0.8, ls=":", label="noise")
    axes.set(xlabel="point", ylabel="distance, mm", title="measured to predicted")
    axes.legend(fontsize=8)


def _draw_coordinates(fit: GeometryFit, axes: "Axes") -> None:
    number, band = np.arange(1, len(fit.points) + 1), 3.0 * fit.found.noise / MM
    for name, part in zip("xyz", fit.found.residual.T / MM, strict=True):
        axes.plot(number, part, ".", label=name)
    axes.axhspan(-band, band, color="0.9", zorder=0, label="3 sigma")
    axes.set(xlabel="point", ylabel="residual, mm", title="after the fit")
    axes.legend(fontsize=8, ncols=4)


def _draw_arrows(fit: GeometryFit, axes: "Axes") -> None:
    """In the plane, from above: where points were, and by how much the drawing is off there."""
    place = fit.found.predicted(fit.points.slider) / MM
    off = -np.nan_to_num(fit.first) / MM
    arrows = axes.quiver(place[:, 0], place[:, 1], off[:, 0], off[:, 1], place[:, 2], angles="xy")
    size = float(max(np.hypot(off[:, 0], off[:, 1]).max(), 1e-3))
    axes.quiverkey(arrows, 0.85, 1.03, size, f"{size:.2g} mm", labelpos="E")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x, mm", ylabel="y, mm", title="drawing less measurement; colour: height")


def _draw_parameters(fit: GeometryFit, axes: "Axes") -> None:
    found, doubts = fit.found, fit.found.doubts.each()
    free = np.flatnonzero(doubts > 0.0)
    value, sigma = found.parameters[free] / doubts[free], found.deviation[free] / doubts[free]
    axes.errorbar(np.arange(len(free)), value, 3.0 * sigma, fmt="o", ms=3, lw=1)
    axes.axhline(0.0, color="k", lw=0.8)
    axes.set_xticks(np.arange(len(free)), [NAMES[k] for k in free], rotation=90, fontsize=6)
    axes.set(ylabel="found, in doubts", title="parameters, 3 sigma")
