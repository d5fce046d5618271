"""What measurements say of a clay: words, a record and a picture."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdhr_host.errors import Problem
from cdhr_host.extrusion import PressureFlow
from cdhr_host.extrusion.identify import FlowCurve, doubts
from cdhr_host.extrusion.identify_delays import Delays, delay_doubts
from cdhr_host.profile import Clay, Profile
from cdhr_host.units import KPA, MM3, MS
from cdhr_host.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEAD = 250 * MM3
"""m³/s of the paper's 5 mm bead at 20 mm/s"""
GRAM = 1e-3
FLOW_KEYS = ("yield_stress_pa", "consistency_pa_s_n", "index")
DELAY_KEYS = ("open_dead_ms", "close_dead_ms", "line_lag_ms")


@dataclass(frozen=True, slots=True)
class ClayFit:
    """What was found: a flow curve, delays, or both."""

    machine: Profile
    """with the clay that was fitted"""
    law: PressureFlow
    curve: FlowCurve | None = None
    delays: Delays | None = None

    @property
    def doubts(self) -> list[Problem]:
        """What the measurements do not tell well."""
        found = doubts(self.curve) if self.curve else []
        return found + (delay_doubts(self.delays) if self.delays else [])

    def estimates(self) -> Iterator[tuple[str, float, float, float]]:
        """(key, value, standard deviation, half of the 95 % interval), as the profile's file has them."""
        if self.curve:
            fit = self.curve.fit
            for key, value, sigma in zip(FLOW_KEYS, fit.value, fit.sigma, strict=True):
                yield key, float(value), float(sigma), float(fit.quantile * sigma)
        if self.delays:
            fit = self.delays.fit
            for key, value, sigma in zip(DELAY_KEYS, fit.value / MS, fit.sigma / MS, strict=False):
                yield key, float(value), float(sigma), float(fit.quantile * sigma)


def fitted_clay(clay: Clay, curve: FlowCurve | None, delays: Delays | None) -> Clay:
    """The clay with what was found, to five digits, in place of what was believed."""
    found: dict[str, Any] = {}
    if curve:
        paste = curve.material
        found |= {"model": "herschel-bulkley", "yield_stress": paste.yield_stress}
        found |= {"consistency": paste.consistency, "index": paste.index}
    if delays:
        found |= dict(
            zip(("open_dead", "close_dead", "line_lag"), map(float, delays.fit.value), strict=False)
        )
    digits = {name: float(f"{value:.5g}") for name, value in found.items() if name != "model"}
    return clay.model_copy(update=found | digits)


def fit_record(found: ClayFit) -> dict[str, Any]:
    """The fit as JSON."""
    rows = found.estimates()
    record: dict[str, Any] = {
        "estimates": {
            key: {"value": value, "sigma": sigma, "interval_95": [value - half, value + half]}
            for key, value, sigma, half in rows
        },
        "threshold_kpa": found.law.threshold / KPA,
        "doubts": [{"key": each.key, "message": each.message, "hint": each.hint} for each in found.doubts],
    }
    if found.curve:
        weighings, fit = found.curve.weighings, found.curve.fit
        record["weighings"] = {
            "pressure_kpa": (weighings.pressure / KPA).tolist(),
            "flow_mm3_s": (weighings.flow / MM3).tolist(),
            "model_mm3_s": (found.law.flow(weighings.pressure) / MM3).tolist(),
            "outlier": fit.outlier.tolist(),
            "correlation": fit.correlation.tolist(),
        }
    if found.delays:
        residual = found.delays.fit.residual / GRAM
        record["steps"] = {
            "readings": len(residual),
            "rms_g": float(np.sqrt(np.mean(residual**2))),
            "gain": found.delays.gain.tolist(),
            "outliers": int(found.delays.fit.outlier.sum()),
        }
    return record


def fit_lines(found: ClayFit) -> Iterator[str]:
    """The fit in words: value and 95 % interval, how well it fits, what it means for printing."""
    for key, value, _, half in found.estimates():
        places = max(0, 1 - int(np.floor(np.log10(half)))) if half > 0.0 else 3
        yield f"  {key:<20} {value:9.{places}f} ± {half:.{places}f}"
    yield f"  {'clay moves above':<20} {found.law.threshold / KPA:9.1f} kPa"
    if found.curve:
        error = found.curve.relative_error
        worst = int(np.nanargmax(np.abs(error)))
        at = found.curve.weighings.pressure[worst] / KPA
        yield (
            f"  {f'{len(error)} flows':<20} within {100 * np.sqrt(np.nanmean(error**2)):.1f} % rms; "
            f"farthest {100 * error[worst]:+.1f} % at {at:.4g} kPa"
        )
    if found.delays:
        record, fit = found.delays.record, found.delays.fit
        rms = float(np.sqrt(np.mean(fit.residual**2))) / GRAM
        yield f"  {f'{len(record.steps[0])} steps':<20} scale followed within {rms:.2g} g rms"
    needed, most = float(found.law.pressure(np.array(BEAD))) / KPA, found.machine.extruder.pressure_max / KPA
    verdict = "" if needed < most else ": more than the air gives; soften the clay"
    yield f"  a 5 mm bead at 20 mm/s, 250 mm³/s, needs {needed:.0f} of {most:.0f} kPa{verdict}"


def draw(found: ClayFit, title: str, path: Path) -> None:
    """Fit and residuals as a picture; raises ImportError without matplotlib (the extra ``plot``)."""
    from matplotlib.figure import Figure  # noqa: PLC0415 -- may be missing

    rows = sum(each is not None for each in (found.curve, found.delays))
    figure = Figure(figsize=(10, 4.2 * rows), layout="constrained")
    axes = iter(figure.subplots(rows, 2, squeeze=False, width_ratios=(3, 2)))
    if found.curve:
        _draw_curve(found.curve, *next(axes))
    if found.delays:
        _draw_delays(found.delays, *next(axes))
    figure.suptitle(title)
    figure.savefig(path, dpi=120)


def _draw_curve(curve: FlowCurve, left: "Axes", right: "Axes") -> None:
    weighings, outlier = curve.weighings, curve.fit.outlier
    most = weighings.pressure.max()
    pressure = np.linspace(0.9 * min(curve.law.threshold, most), 1.02 * most, 300)
    flow, doubt = curve.law.flow(pressure), curve.fit.quantile * _spread(curve, pressure)
    left.fill_between(pressure / KPA, np.maximum(flow - doubt, 0) / MM3, (flow + doubt) / MM3, alpha=0.25)
    left.plot(pressure / KPA, flow / MM3, label="Herschel–Bulkley, 95 %")
    for rows, mark in ((~outlier, "o"), (outlier, "x")):
        left.plot(weighings.pressure[rows] / KPA, weighings.flow[rows] / MM3, f"k{mark}")
    left.axvline(
        curve.law.threshold / KPA, ls=":", c="k", label=f"yields at {curve.law.threshold / KPA:.1f} kPa"
    )
    left.set(xlabel="pressure, kPa", ylabel="flow, mm³/s")
    left.legend()
    right.axhline(0.0, c="k", lw=0.8)
    right.plot(weighings.pressure / KPA, 100 * curve.relative_error, "ko")
    right.set(xlabel="pressure, kPa", ylabel="model over weighing, %", title="residuals")


def _spread(curve: FlowCurve, pressure: Array) -> Array:
    """(N,) Pa -> (N,) m³/s: standard deviation of the fitted flow, by its slopes."""
    value, step = curve.fit.value, 1e-4 * np.maximum(curve.fit.sigma, 1e-9)
    slopes = []
    for row in np.diag(step):
        nearby = (
            type(curve.law)(type(curve.material)(*(value + s * row)), curve.law.channels) for s in (1, -1)
        )
        more, less = (law.flow(pressure) for law in nearby)
        slopes.append((more - less) / (2.0 * row.max()))
    by = np.array(slopes)
    variance: Array = np.einsum("in,ij,jn->n", by, curve.fit.covariance, by)
    return np.sqrt(np.maximum(variance, 0.0))


def _draw_delays(delays: Delays, left: "Axes", right: "Axes") -> None:
    record = delays.record
    left.plot(record.t, record.mass / GRAM, "k.", ms=2, label="scale")
    left.plot(record.t, delays.mass / GRAM, label="model")
    left.set(xlabel="t, s", ylabel="clay, g")
    air = left.twinx()
    air.step(record.t, record.pressure / KPA, where="post", c="C1", lw=0.8)
    air.set_ylabel("pressure, kPa", color="C1")
    left.legend()
    right.axhline(0.0, c="k", lw=0.8)
    right.plot(record.t, delays.fit.residual / GRAM, "k.", ms=2)
    right.set(xlabel="t, s", ylabel="model minus scale, g", title="residuals")
