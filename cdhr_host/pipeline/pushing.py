"""Clay and air as bounds on the motion: no flow and no change of flow that the pressure cannot make.

A flow Q(t) needs of the regulator's input p(Q) + lag · p'(Q) Q' (and a term of second order
where there are two lags), which must stay between 0 and the greatest pressure. So on the way
between a tenth of a flow and all of it Q' is at most the room to either end over lag · dp/dQ;
the last tenth, walked in a fraction of a millimetre, may lag behind.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.extrusion import AirModel
from cdhr_host.motion.arc import arc_length
from cdhr_host.motion.curves import spline_length
from cdhr_host.motion.flow import FlowLimits
from cdhr_host.motion.smooth_path import norms
from cdhr_host.units import KPA, MM, MM3
from cdhr_host.values import Arc, Array, Command, Ints, Moves, Notice, Prime, Spline

GRID: Final = 48
"""flows at which the greatest change is worked out"""
WAY: Final = 0.1
"""of a flow, from which on its change is bounded"""
MARGIN: Final = 0.9
"""of the room that is used"""
SLACK: Final = 1.0 + 1e-9
"""a flow beyond its limit by less is rounding"""


def flow_limits(air: AirModel) -> FlowLimits:
    """What a model of clay and air lets the motion do."""
    greatest = air.flow_max
    if air.lag == 0.0 or greatest == 0.0:
        return FlowLimits(greatest, rests=air.leads)
    flow = greatest * np.arange(1, GRID + 1) / GRID
    pressure = air.law.pressure(flow)
    room = MARGIN * np.minimum(pressure, air.pressure_max - pressure)
    possible = room / (air.lag * air.law.resistance(flow))
    on_way = (flow[:, None] >= WAY * flow) & (flow[:, None] <= flow)
    change = np.where(on_way, possible[:, None], np.inf).min(axis=0)
    second = air.regulator_lag * air.line_lag / air.lag
    return FlowLimits(greatest, flow, change, second, rests=True)


def lays(command: Command) -> bool:
    """Whether clay flows, or air is on, in a command."""
    if isinstance(command, Moves):
        return bool((command.clay > 0.0).any() or (command.air > 0.0).any())
    if isinstance(command, Arc | Spline):
        return command.clay > 0.0 or command.air > 0.0
    return isinstance(command, Prime)


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
