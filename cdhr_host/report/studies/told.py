"""What measured points say of the machine, in words and as a record."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from cdhr_host.mechanism.calibration_model import NAMES
from cdhr_host.mechanism.observability import learned
from cdhr_host.report.studies.fit import GeometryFit, rms
from cdhr_host.units import DEG, MM


def fit_lines(fit: GeometryFit) -> Iterator[str]:
    """The fit in words."""
    yield from _summary(fit)
    yield f"  {'parameter':<16} {'found':>9}   {'sigma':>7}   {'before':>7}   learned"
    for name, value, sigma, doubt, part in _rows(fit):
        unit = "°" if "turn" in name else "mm"
        yield f"  {name:<16} {value:+9.3f} ± {sigma:7.3f}   {doubt:7.3f} {unit}  {part:4.0%}"
    if fit.open_:
        yield "  not observable with these poses (the drawing decides):"
        yield from (f"    {each.words()}" for each in fit.open_)
        yield "    pulleys, attachments and offsets 4-6: the nozzle does not feel them"
    yield "  poses to add, X Y Z in mm:"
    yield from (f"    {x:.1f} {y:.1f} {z:.1f}" for x, y, z in fit.add.position_G / MM)


def _summary(fit: GeometryFit) -> Iterator[str]:
    found, judged = fit.found, fit.judged
    first, last = rms(fit.first) / MM, rms(found.residual) / MM
    yield f"  {len(fit.points)} points, noise {found.noise / MM:.3f} mm a coordinate"
    yield f"  distance, rms: {first:.3f} mm by the drawing, {last:.3f} mm by the fit"
    if judged:
        first, last = judged.before / MM, judged.after / MM
        told = f"{first:.3f} mm by the drawing, {last:.3f} mm by fits of the others"
        yield f"  {judged.points} points held out, a fifth at a time: {told}"
    first, last = (size / MM for size in fit.doubt)
    yield f"  nozzle, worst place of the workspace, one sigma: {first:.2f} mm before, {last:.3f} mm now"
    if wild := np.flatnonzero(found.outliers).tolist():
        yield f"  points that no such noise explains: {', '.join(str(row + 1) for row in wild)}"


def _rows(fit: GeometryFit) -> Iterator[tuple[str, float, float, float, float]]:
    """Name, value, sigma, doubt before in mm or degrees, and the share learned, of what was in doubt."""
    found = fit.found
    sizes = np.array([DEG if "turn" in name else MM for name in NAMES])
    columns = [(part / sizes).tolist() for part in (found.parameters, found.deviation, found.doubts.each())]
    share = learned(found.information, found.doubts).tolist()
    for row in zip(NAMES, *columns, share, strict=True):
        if row[3] > 0.0:
            yield row


def fit_record(fit: GeometryFit) -> dict[str, Any]:
    """The fit as JSON; turns in degrees, the rest in mm."""
    found, judged = fit.found, fit.judged
    keys = ("value", "sigma", "before", "learned")
    residuals = (found.residual / MM).tolist()
    return {
        "points": len(fit.points),
        "noise_mm": found.noise / MM,
        "rms_before_mm": rms(fit.first) / MM,
        "rms_after_mm": rms(found.residual) / MM,
        "held_out": judged
        and {
            "points": judged.points,
            "rms_before_mm": judged.before / MM,
            "rms_after_mm": judged.after / MM,
        },
        "nozzle_doubt_before_mm": fit.doubt[0] / MM,
        "nozzle_doubt_after_mm": fit.doubt[1] / MM,
        "parameters": {name: dict(zip(keys, row, strict=True)) for name, *row in _rows(fit)},
        "not_observable": [{"parts": dict(each.parts), "strength": each.strength} for each in fit.open_],
        "outliers": np.flatnonzero(found.outliers).tolist(),
        "residuals_mm": [[None if np.isnan(part) else part for part in row] for row in residuals],
        "poses_to_add_mm": (fit.add.position_G / MM).tolist(),
    }
