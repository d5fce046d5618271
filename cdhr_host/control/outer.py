"""The loop for the real rig: a slow integrator on the nozzle's position inside a performance funnel.

The drives hold positions; motor torque through a ball screw is no force control (10 N of cable
are 6.4 mN m). So this loop only shifts what is commanded. Until the next measurement, the one p
taken at t_m moves the shift by

    shift' = -Ki rho artanh(|e| / rho) e / |e|,   e = p - plan(t_m),

at most at the rate limit: Ki near the axis of the funnel rho(t), as hard as allowed at its wall.
Comparing with the plan at t_m makes latency cost stability only, not accuracy. An error
outside the funnel for ``patience`` samples in a row stops the machine on its path; a source
silent for ``timeout`` leaves the shift where it is, and says so.

The upper platform is shifted with the lower one, and further up or down so that the force
sensors of cables 4-6 show the planned vertical pull: 1 N for each mm against the spring. The
rate limit holds for both together, the nozzle's correction first, so that neither platform is
moved faster; a correction that would leave its range stops the machine.
"""

import math
from bisect import bisect_left
from dataclasses import dataclass, field, replace

import numpy as np

from cdhr_host.control.funnel import Funnel
from cdhr_host.control.platforms import Platforms
from cdhr_host.control.pose import PoseSample
from cdhr_host.control.protocol import Action, Mode, Plan, Seen
from cdhr_host.profile import Profile
from cdhr_host.units import MM
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class OuterSettings:
    """What the designer chooses."""

    gain: float = 1.5
    """1/s: Ki; stable up to pi/2 over the latency, more than 2 gains nothing"""
    rate: float = 2.0 * MM
    """m/s each platform's corrections move it at most"""
    range: float = 15.0 * MM
    """m the shift may be away from the plan; the wall of what calibration should have caught"""
    funnel: Funnel = field(default_factory=Funnel)
    patience: int = 3
    """samples in a row outside the funnel that stop the machine"""
    timeout: float = 0.25
    """s without a new sample until the loop is open"""
    tension_gain: float = 0.5
    """1/s: of the upper platform's height on the spring's force; 0 for no force sensors"""
    tension_range: float = 5.0 * MM
    """m the height may be away"""
    memory: float = 1.0
    """s of plan that is remembered: the greatest latency of a sample"""


@dataclass(frozen=True, slots=True)
class OuterState:
    """What the loop remembers."""

    shift: Array
    """(3,) m"""
    rise: float
    """m of the upper platform above its place"""
    mode: Mode
    frame: int | None
    """newest sample used"""
    heard: float
    """s, when that was"""
    drift: Array
    """(3,) m/s of the shift, until the next sample"""
    outside: int
    """samples in a row outside the funnel"""
    began: float | None
    """s, when the loop was closed: the funnel's t = 0"""
    past: tuple[tuple[float, Array], ...]
    """times and planned lower positions"""


class Outer:
    """Position control of the nozzle; see the module."""

    def __init__(self, profile: Profile, settings: OuterSettings | None = None) -> None:
        self.settings = OuterSettings() if settings is None else settings
        self._platforms = Platforms(profile)
        self._stiffness = profile.spring.stiffness

    def start(self) -> OuterState:
        """Nothing heard yet: open loop from the start, closed at the first sample."""
        return OuterState(np.zeros(3), 0.0, Mode.OPEN, None, 0.0, np.zeros(3), 0, None, ())

    def step(self, state: OuterState, plan: Plan, seen: Seen, dt: float) -> tuple[OuterState, Action]:
        """The shift for the next ``dt`` s; once it says STOP it stays so."""
        before = state.mode
        state = self._remembered(state, plan)
        if before is not Mode.STOP:
            state = self._moved(self._listened(state, plan, seen.nozzle), dt)
            state = self._tightened(state, plan, seen, dt)
        shift = np.concatenate([state.shift, state.shift])
        shift[5] += state.rise
        notice = "" if state.mode is before else self._notice(state, plan.t)
        return state, Action(state.mode, shift=shift, notice=notice)

    def _remembered(self, state: OuterState, plan: Plan) -> OuterState:
        oldest = plan.t - self.settings.memory
        first = bisect_left(state.past, oldest, key=lambda row: row[0])
        return replace(state, past=(*state.past[first:], (plan.t, plan.position[:3])))

    def _listened(self, state: OuterState, plan: Plan, sample: PoseSample | None) -> OuterState:
        """Use a new sample; notice a silent source."""
        if sample is None or sample.frame == state.frame:
            silent = state.mode is Mode.CLOSED and plan.t - state.heard > self.settings.timeout
            return replace(state, mode=Mode.OPEN, drift=np.zeros(3)) if silent else state
        if sample.t < state.past[0][0]:
            return state
        error = sample.position - _planned(state.past, sample.t)
        began = plan.t if state.began is None or state.mode is Mode.OPEN else state.began
        state = replace(state, began=began, frame=sample.frame, heard=plan.t)
        return self._corrected(state, error, plan.t)

    def _corrected(self, state: OuterState, error: Array, t: float) -> OuterState:
        g, began = self.settings, state.began or 0.0
        size = float(np.linalg.norm(error))
        pressing = g.funnel.pressing(size, t - began)
        outside = 0 if pressing < math.inf else state.outside + 1
        if outside >= g.patience:
            return replace(state, mode=Mode.STOP, outside=outside)
        speed = 0.0 if outside else min(g.gain * pressing, g.rate)
        drift = -error * (speed / size) if size > 0.0 else np.zeros(3)
        return replace(state, mode=Mode.CLOSED, outside=outside, drift=drift)

    def _moved(self, state: OuterState, dt: float) -> OuterState:
        if state.mode is not Mode.CLOSED:
            return state
        shift = state.shift + dt * state.drift
        if float(np.linalg.norm(shift)) > self.settings.range:
            return replace(state, mode=Mode.STOP)
        return replace(state, shift=shift)

    def _tightened(self, state: OuterState, plan: Plan, seen: Seen, dt: float) -> OuterState:
        """Raise or lower the upper platform until its cables pull as planned."""
        g = self.settings
        if seen.tension is None or g.tension_gain == 0.0 or state.mode is Mode.STOP:
            return state
        equations = self._platforms.at(plan.position)
        short = equations.tension(plan.acceleration)[3:] - seen.tension[3:]
        missing = float(equations.pull[5, 3:] @ short) / self._stiffness
        move = self._room(state.drift, g.tension_gain * missing)
        rise = state.rise + dt * move
        return replace(state, mode=Mode.STOP) if abs(rise) > g.tension_range else replace(state, rise=rise)

    def _room(self, drift: Array, move: float) -> float:
        """What of a vertical ``move``, m/s, the rate limit leaves beside the shift's drift."""
        x, y, z = (float(part) for part in drift)
        left = math.sqrt(max(self.settings.rate**2 - x * x - y * y, 0.0))
        return max(-left - z, min(left - z, move))

    def _notice(self, state: OuterState, t: float) -> str:
        if state.mode is Mode.CLOSED:
            return f"closed loop from {t:.3f} s on"
        if state.mode is Mode.OPEN:
            return f"open loop from {t:.3f} s on: no pose since {state.heard:.3f} s; the correction is held"
        radius = self.settings.funnel.radius(t - (state.began or 0.0))
        if state.outside:
            return f"stop at {t:.3f} s: the nozzle is more than {radius / MM:.3f} mm away from the path"
        return (
            f"stop at {t:.3f} s: the correction would exceed {self.settings.range / MM:g} mm for the nozzle "
            f"or {self.settings.tension_range / MM:g} mm for the force"
        )


def _planned(past: tuple[tuple[float, Array], ...], t: float) -> Array:
    """The lower platform's planned position at a remembered time, between two memories linearly."""
    after = bisect_left(past, t, key=lambda row: row[0])
    if after == len(past):
        return past[-1][1]
    (t1, p1), (t0, p0) = past[after], past[max(after - 1, 0)]
    share = (t - t0) / (t1 - t0) if t1 > t0 else 1.0
    return np.asarray(p0 + share * (p1 - p0))
