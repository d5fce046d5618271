"""Clay in pipes: flow for a pressure and its exact inverse.

A Herschel–Bulkley paste, ``stress = yield_stress + consistency * rate ** index``, laminar and
without slip at the wall, through cylinders in series (feed hose, nozzle). The Rabinowitsch
integral of the profile over the bore, with R the radius and w = dp R / (2 L) the wall stress,

    Q = pi R³ / w³ · integral of stress² · rate(stress) from yield_stress to w,

has a closed form: with a = w - yield_stress and m = 1 / index,

    Q = pi R³ / w³ · (a / consistency)^m · a · (a² / (m + 3) + 2 a yield_stress / (m + 2)
                                               + yield_stress² / (m + 1)).

Nothing flows below dp = 4 L yield_stress / D. Its limits are the Buckingham–Reiner law
(index 1), the power law (no yield stress) and Hagen–Poiseuille (both). Losses at the entry of
a bore are not in it: identification puts them into the fitted numbers.

Sources: Herschel and Bulkley, Kolloid-Z. 39 (1926) 291; Rabinowitsch, Z. phys. Chem. A 145
(1929) 1; Buckingham, Proc. ASTM 21 (1921) 1154; Chhabra and Richardson, Non-Newtonian Flow and
Applied Rheology, 2nd ed. (2008), chapter 3.

The inverse is Newton's method in logarithms. ln Q is concave in ln a, its slope falling from
m + 1 (just above yield) to m (far above it), and stays below both of those asymptotes; started
on the greater of their two roots the iteration rises to the solution without passing it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cdhr_host.values import Array

_SMALL_STEP = 1e-8
"""A Newton step this small in a logarithm leaves an error of its square."""
_MAX_STEPS = 60


@dataclass(frozen=True, slots=True)
class Material:
    """A paste: shear stress = yield_stress + consistency · (shear rate) ** index."""

    yield_stress: float
    """Pa, at least 0"""
    consistency: float
    """Pa sⁿ, positive"""
    index: float
    """n, positive; below 1 the paste thins as it is sheared"""


@dataclass(frozen=True, slots=True)
class Channel:
    """A straight round bore."""

    diameter: float
    """m"""
    length: float
    """m"""

    @property
    def pressure_per_stress(self) -> float:
        """4 L / D: the pressure drop that makes a wall stress of 1 Pa."""
        return 4.0 * self.length / self.diameter


class PressureFlow(Protocol):
    """Steady flow of clay against gauge pressure. Arrays go elementwise, any shape."""

    @property
    def threshold(self) -> float:
        """Pa: nothing flows up to it."""
        ...

    def flow(self, pressure: Array) -> Array:
        """Pa -> m³/s; 0 up to the threshold."""
        ...

    def pressure(self, flow: Array) -> Array:
        """m³/s, at least 0 -> Pa; the threshold where the flow is 0.

        Raises ValueError for a flow that is negative or not finite.
        """
        ...

    def resistance(self, flow: Array) -> Array:
        """m³/s -> dp/dQ, Pa s/m³; infinite at rest for a paste that yields."""
        ...


@dataclass(frozen=True, slots=True)
class LinearFlow:
    """p = threshold + slope · Q."""

    threshold: float
    """Pa"""
    slope: float
    """Pa s/m³"""

    def flow(self, pressure: Array) -> Array:
        """Pa -> m³/s; 0 up to the threshold."""
        return np.maximum(np.asarray(pressure) - self.threshold, 0.0) / self.slope

    def pressure(self, flow: Array) -> Array:
        """m³/s -> Pa; raises ValueError for a negative flow."""
        return self.threshold + self.slope * _sound(flow)

    def resistance(self, flow: Array) -> Array:
        """m³/s -> Pa s/m³, the slope."""
        return np.full_like(_sound(flow), self.slope)


@dataclass(frozen=True, slots=True)
class ChannelFlow:
    """A Herschel–Bulkley paste through round bores in series, at least one."""

    material: Material
    channels: tuple[Channel, ...]

    @property
    def threshold(self) -> float:
        """Pa: the sum of 4 L yield_stress / D."""
        return self.material.yield_stress * sum(each.pressure_per_stress for each in self.channels)

    def flow(self, pressure: Array) -> Array:
        """Pa -> m³/s; 0 up to the threshold. One bore is the closed form, more are iterated."""
        excess = np.asarray(pressure, dtype=float) - self.threshold
        flow = np.zeros_like(excess)
        flowing = excess > 0.0
        flow[flowing] = self._flow_of_excess(excess[flowing])
        return flow

    def pressure(self, flow: Array) -> Array:
        """m³/s -> Pa: the exact inverse of ``flow``; raises ValueError for a negative flow."""
        flow = _sound(flow)
        pressure = np.full_like(flow, self.threshold)
        flowing = flow > 0.0
        pressure[flowing] += self._excess(flow[flowing])[0]
        return pressure

    def resistance(self, flow: Array) -> Array:
        """m³/s -> dp/dQ, Pa s/m³; its limit at rest: infinite unless nothing yields or thins."""
        flow = _sound(flow)
        resistance = np.full_like(flow, self._resistance_at_rest())
        flowing = flow > 0.0
        resistance[flowing] = self._excess(flow[flowing])[1]
        return resistance

    def _excess(self, flow: Array) -> tuple[Array, Array]:
        """Positive flows -> (pressure above the threshold, its derivative by the flow)."""
        excess, slope = np.zeros_like(flow), np.zeros_like(flow)
        for bore in self.channels:
            stress, log_slope = _excess_stress(self.material, bore, flow)
            excess += bore.pressure_per_stress * stress
            slope += bore.pressure_per_stress * stress / (flow * log_slope)
        return excess, slope

    def _flow_of_excess(self, excess: Array) -> Array:
        """Positive pressures above the threshold -> flow.

        If one bore took all of the pressure its flow would be too large: the least of those
        bounds is the start. ln excess is convex in ln Q, so the iteration falls to the solution.
        """
        bounds = [
            _bore_flow(self.material, bore, excess / bore.pressure_per_stress)[0] for bore in self.channels
        ]
        if len(bounds) == 1:
            return bounds[0]

        def step(log_flow: Array) -> Array:
            flow = np.exp(log_flow)
            found, slope = self._excess(flow)
            return np.log(excess / found) * found / (slope * flow)

        return np.exp(_newton(step, np.log(np.minimum.reduce(bounds))))

    def _resistance_at_rest(self) -> float:
        index = self.material.index
        if self.material.yield_stress > 0.0 or index < 1.0:
            return float("inf")
        if index > 1.0:
            return 0.0
        return sum(
            128.0 * self.material.consistency * bore.length / (np.pi * bore.diameter**4)
            for bore in self.channels
        )


def _bore_flow(material: Material, bore: Channel, stress: Array) -> tuple[Array, Array]:
    """Wall stress a above the yield stress, positive -> flow, d ln Q / d ln a: this module's head.

    The slope lies between 1 / index and 1 / index + 1.
    """
    power = 1.0 / material.index
    far, between, near = 1.0 / (power + 3.0), 2.0 / (power + 2.0), 1.0 / (power + 1.0)
    sheared = stress / (stress + material.yield_stress)
    plug = 1.0 - sheared
    form = sheared * (far * sheared + between * plug) + near * plug * plug
    rate = (stress / material.consistency) ** power
    flow = (np.pi * (bore.diameter / 2.0) ** 3) * rate * sheared * form
    slope = power + 1.0 - 3.0 * sheared + sheared * (2.0 * far * sheared + between * plug) / form
    return flow, slope


def _excess_stress(material: Material, bore: Channel, flow: Array) -> tuple[Array, Array]:
    """Positive flow -> wall stress above the yield stress, the slope there: ``_bore_flow`` inverted."""
    power, log_consistency = 1.0 / material.index, np.log(material.consistency)
    log_rate = np.log(flow / (np.pi * (bore.diameter / 2.0) ** 3))
    start = log_consistency + (log_rate + np.log(power + 3.0)) / power
    if material.yield_stress > 0.0:
        plugged = log_rate + np.log((power + 1.0) * material.yield_stress) + power * log_consistency
        start = np.maximum(start, plugged / (power + 1.0))

    def step(log_stress: Array) -> Array:
        found, slope = _bore_flow(material, bore, np.exp(log_stress))
        return np.asarray(np.log(flow / found) / slope)

    stress = np.exp(_newton(step, start))
    return stress, _bore_flow(material, bore, stress)[1]


def _newton(step: Callable[[Array], Array], start: Array) -> Array:
    """Add steps until they are small everywhere; raises ArithmeticError if they never are."""
    found = start
    for _ in range(_MAX_STEPS):
        change = step(found)
        found = found + change
        if np.all(np.abs(change) < _SMALL_STEP):
            return found
    raise ArithmeticError(f"the flow law did not converge; last step {np.nanmax(np.abs(change)):g}")


def _sound(flow: Array) -> Array:
    flow = np.asarray(flow, dtype=float)
    bad = flow[~((flow >= 0.0) & (flow < np.inf))]
    if bad.size:
        raise ValueError(
            f"no pressure gives a flow of {bad.flat[0]:g} m³/s: it must be finite and at least 0"
        )
    return flow
