"""Weighings -> the clay's flow curve: yield stress, consistency and index with their doubt.

A weighing is a flow at a pressure held until it was steady. The model is a Herschel–Bulkley
paste through the machine's own bores (rheology.py); what is fitted holds for these bores, with
the losses at their entries in it.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.errors import Problem, ProfileError
from cdhr_host.extrusion.rheology import Channel, ChannelFlow, Material
from cdhr_host.extrusion.robust import Fit, fitted
from cdhr_host.units import KPA, MM3
from cdhr_host.values import Array

FLOOR: Final = 0.02
"""of the greatest flow: below it the doubt of a weighing is of constant size, above it in proportion"""
LEAST_PRESSURES: Final = 4
"""different pressures with flow: three parameters and one to see whether they fit"""
FLOW_SPAN: Final = 5.0
"""greatest over least flow from which on the index can be told from the consistency"""
NEAR_YIELD: Final = 1.6
"""least pressure with flow over the threshold, up to which the yield stress is not extrapolated"""
INDEX_BOUNDS: Final = (0.05, 2.0)
_INDICES: Final = (0.15, 0.3, 0.5, 0.8, 1.2)
_YIELDS: Final = (0.2, 0.5, 0.8, 0.95)


@dataclass(frozen=True, slots=True)
class Weighings:
    """N steady flows."""

    pressure: Array
    """(N,) Pa"""
    flow: Array
    """(N,) m³/s; 0 where nothing came"""

    def __len__(self) -> int:
        return len(self.flow)


@dataclass(frozen=True, slots=True)
class FlowCurve:
    """The clay that N weighings show, and how well."""

    fit: Fit
    """yield stress Pa, consistency Pa sⁿ, index; residuals as asinh(flow / floor)"""
    law: ChannelFlow
    weighings: Weighings

    @property
    def material(self) -> Material:
        """The paste."""
        return self.law.material

    @property
    def relative_error(self) -> Array:
        """(N,) model over measured flow, minus 1; nan where next to nothing came."""
        flow = self.weighings.flow
        measured = np.where(flow > FLOOR * flow.max(), flow, np.nan)
        return self.law.flow(self.weighings.pressure) / measured - 1.0


def bead_section(width: Array, height: Array) -> Array:
    """(N,) m, m -> m² of a bead laid flat: a rectangle with round flanks, as slicers reckon it.

    A bead no wider than high is taken for an ellipse of that width and height.
    """
    flanked = (width - height) * height + np.pi * height**2 / 4.0
    section: Array = np.where(width > height, flanked, np.pi * width * height / 4.0)
    return section


def identify_flow(weighings: Weighings, bores: tuple[Channel, ...]) -> FlowCurve:
    """Fit the paste. Raises ProfileError when too few pressures were weighed to tell it."""
    _check(weighings)
    floor, rate = FLOOR * weighings.flow.max(), _typical_rate(weighings, bores[0])

    def law(parameters: Array) -> ChannelFlow:
        yield_stress, log_stress, index = parameters
        return ChannelFlow(Material(yield_stress, np.exp(log_stress) / rate**index, index), bores)

    def residual(parameters: Array) -> Array:
        flow = law(parameters).flow(weighings.pressure)
        return np.asarray(np.arcsinh(flow / floor) - np.arcsinh(weighings.flow / floor))

    most = weighings.pressure.max() / ChannelFlow(Material(1.0, 1.0, 1.0), bores).threshold
    bounds = np.array([0.0, -20.0, INDEX_BOUNDS[0]]), np.array([most, 20.0, INDEX_BOUNDS[1]])
    starts = _starts(weighings, bores, rate)
    start = min(starts, key=lambda each: float(np.sum(residual(each) ** 2)))
    fit = fitted(residual, start, bounds, np.array([0.1 * most, 0.5, 0.2]))
    found = law(fit.value)
    return FlowCurve(_in_paste(fit, found.material, rate), found, weighings)


def _check(weighings: Weighings) -> None:
    flowing = np.unique(weighings.pressure[weighings.flow > 0.0])
    if len(flowing) < LEAST_PRESSURES or len(weighings) <= 3:
        raise ProfileError(
            Problem(
                "range",
                f"clay flowed at {len(flowing)} different pressures: a flow curve needs {LEAST_PRESSURES}",
                value=len(flowing),
                limit=LEAST_PRESSURES,
                hint="weigh at six to ten pressures, from the first drop to the greatest you print with",
            )
        )


def _typical_rate(weighings: Weighings, nozzle: Channel) -> float:
    """1/s: the shear rate at the nozzle's wall that lies in the middle of the weighings.

    The shear stress there is fitted in place of the consistency, whose size follows the index.
    """
    flow = weighings.flow[weighings.flow > 0.0]
    return float(np.exp(np.mean(np.log(32.0 * flow / (np.pi * nozzle.diameter**3)))))


def _starts(weighings: Weighings, bores: tuple[Channel, ...], rate: float) -> list[Array]:
    """Pastes that pass through the middle weighing, for some yields and indices."""
    flowing = np.flatnonzero(weighings.flow > 0.0)
    flowing = flowing[np.argsort(weighings.flow[flowing])]
    middle = flowing[len(flowing) // 2]
    per_stress = ChannelFlow(Material(1.0, 1.0, 1.0), bores).threshold
    starts = []
    for share in _YIELDS:
        yield_stress = share * weighings.pressure[flowing].min() / per_stress
        excess = weighings.pressure[middle] - yield_stress * per_stress
        for index in _INDICES:
            unit = ChannelFlow(Material(0.0, 1.0, index), bores).pressure(weighings.flow[middle : middle + 1])
            consistency = 0.7 * excess / unit[0]
            starts.append(np.array([yield_stress, np.log(consistency * rate**index), index]))
    return starts


def _in_paste(fit: Fit, paste: Material, rate: float) -> Fit:
    """From (yield stress, ln stress at the typical rate, index) to the paste's own parameters."""
    value = np.array([paste.yield_stress, paste.consistency, paste.index])
    by_index = -paste.consistency * np.log(rate)
    jacobian = np.array([[1.0, 0.0, 0.0], [0.0, paste.consistency, by_index], [0.0, 0.0, 1.0]])
    return fit.transformed(value, jacobian)


def doubts(curve: FlowCurve) -> list[Problem]:
    """What the weighings do not tell well, with what to weigh next."""
    return [*_yield_doubt(curve), *_index_doubt(curve), *_outliers(curve)]


def _yield_doubt(curve: FlowCurve) -> list[Problem]:
    weighings = curve.weighings
    least = weighings.pressure[weighings.flow > 0.0].min()
    value, spread = curve.fit.value[0], curve.fit.quantile * curve.fit.sigma[0]
    if value > spread and least <= NEAR_YIELD * curve.law.threshold:
        return []
    return [
        Problem(
            "doubt",
            f"yield stress {value:.0f} ± {spread:.0f} Pa is extrapolated: the least pressure with flow was "
            f"{least / KPA:.0f} kPa, clay begins to move at {curve.law.threshold / KPA:.0f} kPa",
            key="clay.yield_stress_pa",
            hint=f"weigh at {1.1 * curve.law.threshold / KPA:.0f} kPa as well, for a minute or more",
        )
    ]


def _index_doubt(curve: FlowCurve) -> list[Problem]:
    flow = curve.weighings.flow[curve.weighings.flow > 0.0]
    spread = curve.fit.quantile * curve.fit.sigma[2]
    if flow.max() >= FLOW_SPAN * flow.min() and spread < 0.5 * curve.fit.value[2]:
        return []
    return [
        Problem(
            "doubt",
            f"index {curve.fit.value[2]:.2f} ± {spread:.2f}: flows from {flow.min() / MM3:.0f} to "
            f"{flow.max() / MM3:.0f} mm³/s hardly tell it from the consistency",
            key="clay.index",
            hint="weigh more often, over a wider range of pressures",
        )
    ]


def _outliers(curve: FlowCurve) -> list[Problem]:
    pressure, flow, fit = curve.weighings.pressure / KPA, curve.weighings.flow / MM3, curve.fit
    return [
        Problem(
            "outlier",
            f"weighing {row + 1}: {flow[row]:.1f} mm³/s at {pressure[row]:.0f} kPa is "
            f"{abs(fit.residual[row]) / fit.deviation:.0f} standard deviations off the curve",
            hint="look for an air bubble or a slip of the pen, and weigh it again",
        )
        for row in np.flatnonzero(fit.outlier)
    ]
