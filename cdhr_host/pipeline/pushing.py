"""Clay and air as bounds on the motion: no flow and no change of flow that the pressure cannot make.

A flow Q(t) needs of the regulator's input p + (lag1 + lag2) p' + lag1 lag2 p'' with p = p(Q), and
that must stay between 0 and the greatest pressure. So for a ladder of flows the hardest start
from rest, and stop to rest, is sought that does: ramps of the flow with the machine's ratio of
jerk to acceleration, of which all others are scaled.
"""

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.extrusion import AirModel
from cdhr_host.motion.arc import arc_length
from cdhr_host.motion.curves import spline_length
from cdhr_host.motion.flow import FlowLimits
from cdhr_host.motion.vectors import norms
from cdhr_host.units import KPA, MM, MM3
from cdhr_host.values import Arc, Array, Command, Ints, Moves, Notice, Prime, Spline

GRID: Final = 24
"""flows at which the hardest start is sought"""
HALVINGS: Final = 16
"""of the search, from HARDEST on"""
HARDEST: Final = 1e3
"""1/s: change of flow, of the flow, that nothing needs more than"""
SAMPLES: Final = 400
"""of a ramp"""
SMOOTHED: Final = 0.02
"""s over which the pressure of a ramp is averaged: what is shorter the clay does not show"""
MARGIN: Final = 0.95
"""of the pressure that is used"""
SLACK: Final = 1.0 + 1e-9
"""a flow beyond its limit by less is rounding"""


def flow_limits(air: AirModel, steepness: float) -> FlowLimits:
    """What a model of clay and air lets the motion do; ``steepness`` 1/s is jerk over acceleration."""
    greatest = air.flow_max
    if air.lag == 0.0 or greatest == 0.0:
        return FlowLimits(greatest, rests=air.leads)
    flow = greatest * np.arange(1, GRID + 1) / GRID
    change = np.array([_hardest(air, each, steepness) for each in flow.tolist()])
    return FlowLimits(greatest, flow, np.minimum.accumulate(change[::-1])[::-1], steepness, rests=True)


def _hardest(air: AirModel, flow: float, steepness: float) -> float:
    """m³/s²: the greatest change on the way from rest to a flow and back that the air can make."""
    low, high = 0.0, HARDEST
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if _possible(air, flow, middle * flow, steepness) else (low, middle)
    return low * flow


def _possible(air: AirModel, flow: float, change: float, steepness: float) -> bool:
    ramp, step = _ramp(flow, change, steepness)
    window = max(1, math.ceil(SMOOTHED / step))
    padded = np.concatenate((np.zeros(2 * window), ramp, np.full(2 * window, flow)))
    pressure = air.law.pressure(np.maximum(padded, air.creep))
    p = np.convolve(pressure, np.full(window, 1.0 / window), "valid")
    first, second = np.gradient(p, step), np.gradient(np.gradient(p, step), step)
    bent = p + air.regulator_lag * air.line_lag * second
    up, down = bent + air.lag * first, bent - air.lag * first
    return bool(up.max() <= MARGIN * air.pressure_max and down.min() >= 0.0)


def _ramp(flow: float, change: float, steepness: float) -> tuple[Array, float]:
    """(SAMPLES,) m³/s from rest to a flow, its change and the change of that bounded, and s a sample."""
    jerk = change * steepness
    rounded = min(1.0 / steepness, math.sqrt(flow / jerk))
    whole = rounded + flow / (jerk * rounded)
    t = np.linspace(0.0, whole, SAMPLES)
    slope = jerk * np.minimum(np.minimum(t, rounded), whole - t)
    step = whole / (SAMPLES - 1)
    return np.concatenate(([0.0], np.cumsum((slope[1:] + slope[:-1]) / 2))) * step, step


def lays(command: Command) -> bool:
    """Whether clay flows, or air is on, in a command."""
    if isinstance(command, Moves):
        return bool((command.clay > 0.0).any() or (command.air > 0.0).any())
    if isinstance(command, Arc | Spline):
        return command.clay > 0.0 or command.air > 0.0
    return isinstance(command, Prime)


def first_flow(command: Command, air: AirModel, speed_max: float) -> float:
    """m³/s with which a command begins to lay, as far as the air can; ``speed_max`` m/s is the nozzle's."""
    flow = _flows(command, speed_max)[1]
    laid = flow[flow > 0.0]
    return float(min(laid[0], air.flow_max)) if len(laid) else 0.0


class Pushing:
    """Tells which lines of a text are slower than written, because the air pushes no more."""

    def __init__(self, air: AirModel, speed_max: float) -> None:
        """``speed_max`` m/s: the nozzle's own limit."""
        self._air = air
        self._greatest = air.flow_max
        self._speed_max = speed_max
        self._lines = 0
        self._worst = 0, 0.0

    def notices(self, command: Command) -> Iterator[Notice]:
        """The first line is told at once; raises MotionError where nothing can be pushed at all."""
        line, flow, speed = _flows(command, self._speed_max)
        over = flow > self._greatest * SLACK
        if not over.any():
            return
        if self._greatest == 0.0:
            raise MotionError(_unpushable(int(line[over][0]), self._air))
        first, worst = int(over.argmax()), int(flow.argmax())
        if not self._lines:
            yield Notice(int(line[first]), "warning", self._text(float(flow[first]), float(speed[first])))
        self._lines += len(np.unique(line[over]))
        self._worst = max(self._worst, (int(line[worst]), float(flow[worst])), key=lambda found: found[1])

    def summary(self) -> Iterator[Notice]:
        """How many lines there were, and the worst, at the text's end."""
        if self._lines > 1:
            line, flow = self._worst
            text = f"{self._lines} lines are slowed down for the air, this one most: to {self._part(flow)}"
            yield Notice(line, "warning", text)

    def _text(self, flow: float, speed: float) -> str:
        needed = float(self._air.law.pressure(np.array(flow)))
        most = float(self._air.law.pressure(np.array(self._greatest)))
        slower = (
            f", at {speed * self._greatest / flow / MM:.4g} instead of {speed / MM:g} mm/s" if speed else ""
        )
        return (
            f"{flow / MM3:.4g} mm³/s of clay need {needed / KPA:.4g} kPa, the air gives {most / KPA:.4g} kPa "
            f"for printing: laid at {self._greatest / MM3:.4g} mm³/s{slower}"
        )

    def _part(self, flow: float) -> str:
        return f"{100 * self._greatest / flow:.3g} %"


def _flows(command: Command, speed_max: float) -> tuple[Ints, Array, Array]:
    """(N,) lines, (N,) m³/s asked for, (N,) m/s of a command's moves."""
    if isinstance(command, Moves):
        length = norms(np.diff(np.concatenate((command.start_G[None], command.end_G)), axis=0))
        speed = np.minimum(command.speed, speed_max)
        with np.errstate(divide="ignore", invalid="ignore"):
            return command.line, np.where(length > 0.0, command.clay / length * speed, 0.0), speed
    if isinstance(command, Arc | Spline):
        length_of = arc_length(command) if isinstance(command, Arc) else spline_length(command)
        speed_of = min(command.speed, speed_max)
        return np.array([command.line]), np.array([command.clay / length_of * speed_of]), np.array([speed_of])
    if isinstance(command, Prime):
        return np.array([command.line]), np.array([command.flow]), np.zeros(1)
    return np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0)


def _unpushable(line: int, air: AirModel) -> Problem:
    needed, most = air.law.threshold / KPA, air.pressure_max / KPA
    return Problem(
        "pressure",
        f"no clay flows below {needed:.4g} kPa, the air gives {most:.4g} kPa",
        line=line,
        key="extruder.pressure_max_kpa",
        value=needed,
        limit=most,
        unit="kPa",
        hint="soften the clay, take a wider or shorter nozzle, or correct the model in [clay] or [extruder]",
    )
