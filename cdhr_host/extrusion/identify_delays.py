"""A scale under the nozzle while the air steps -> dead times of opening and closing, lag of the line.

The pressure command reaches the regulator after a dead time (one for raising, one for dropping
to zero), the regulator follows with its known lag T, the clay's pressure with the line's lag L:
after a step at 0 the clay's pressure has covered 1 - (T e^(-t/T) - L e^(-t/L)) / (T - L) of it.
The clay flows by its law, times a gain for each pressure of the steps: what the law is off on
that day must not pass for a delay. The scale sums up.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.errors import Problem, ProfileError
from cdhr_host.extrusion.rheology import PressureFlow
from cdhr_host.extrusion.robust import Fit, Residual, fitted
from cdhr_host.values import Array, Flags

GRID: Final = 2e-3
"""s between two steps of the sum"""
LONGEST: Final = 5.0
"""s, greatest dead time and lag that is looked for"""
MOST_LEVELS: Final = 8
"""different pressures in one record: each has a gain to be found"""
OFF: Final = 0.3
"""share by which the steps may differ from the flow curve"""
NOTHING: Final = 1e-3
"""s: a delay this short is the edge of what is looked for, its doubt unknown"""
ENTWINED: Final = 0.95
"""correlation of dead time and lag from which on they cannot be told apart"""
_TABLE: Final = 4097
_EQUAL: Final = 1e-5
"""relative difference of two lags below which they are one"""
_STARTS: Final = ((0.05, 0.05, 0.02), (0.2, 0.2, 0.1), (0.6, 0.6, 0.2))


@dataclass(frozen=True, slots=True)
class StepRecord:
    """N readings of a scale while the air is stepped."""

    t: Array
    """(N,) s, rising"""
    pressure: Array
    """(N,) Pa, the command from this reading on; a step counts from the reading that shows it"""
    mass: Array
    """(N,) kg on the scale"""

    @property
    def levels(self) -> Array:
        """(L,) Pa, rising: the different pressures with the air open."""
        return np.unique(self.pressure[self.pressure > 0.0])

    @property
    def steps(self) -> tuple[Array, Array, Flags]:
        """(E,) s, (E,) Pa of every step, and whether it shuts the air."""
        at = np.flatnonzero(np.diff(self.pressure)) + 1
        return self.t[at], np.diff(self.pressure)[at - 1], self.pressure[at] == 0.0


@dataclass(frozen=True, slots=True)
class Delays:
    """How late the clay is, and how well that is known."""

    fit: Fit
    """open dead time s, close dead time s, line lag s, kg at the start, (L,) ln of the gains;
    residuals in kg"""
    record: StepRecord

    @property
    def gain(self) -> Array:
        """(L,) clay that came over what the law says: 1 where the flow curve still holds."""
        return np.exp(self.fit.value[4:])

    @property
    def mass(self) -> Array:
        """(N,) kg of the model."""
        return self.record.mass + self.fit.residual


def identify_delays(record: StepRecord, law: PressureFlow, density: float, regulator_lag: float) -> Delays:
    """Fit the delays; density in kg/m³. Raises ProfileError for a record that cannot show them."""
    _check(record, law)
    model = _mass_model(record, law, density, regulator_lag)

    def residual(parameters: Array) -> Array:
        return model(parameters) - record.mass

    one = np.ones(len(record.levels))
    low = np.array([0.0, 0.0, 0.0, -np.inf, *(-3.0 * one)])
    high = np.array([LONGEST, LONGEST, LONGEST, np.inf, *(3.0 * one)])
    starts = [np.array([*each, record.mass[0], *(0.0 * one)]) for each in _STARTS]
    start = min(starts, key=lambda each: float(np.sum(residual(each) ** 2)))
    scale = np.array([0.1, 0.1, 0.1, np.ptp(record.mass), *(0.1 * one)])
    return Delays(fitted(residual, start, (low, high), scale), record)


def _mass_model(record: StepRecord, law: PressureFlow, density: float, regulator_lag: float) -> Residual:
    """(4 + L,) parameters -> (N,) kg the scale would show."""
    table = np.linspace(0.0, record.pressure.max(), _TABLE)
    flows = law.flow(table)
    grid = np.arange(record.t[0], record.t[-1] + GRID, GRID)
    at, step, shuts = record.steps

    def mass(parameters: Array) -> Array:
        open_dead, close_dead, line_lag, start = parameters[:4]
        pressure = np.full_like(grid, record.pressure[0])
        for begin, height in zip(at + np.where(shuts, close_dead, open_dead), step, strict=True):
            pressure += height * _followed(grid - begin, regulator_lag, line_lag)
        gained = flows * np.exp(np.interp(table, record.levels, parameters[4:]))
        flow = np.interp(pressure, table, gained)
        laid = np.concatenate(([0.0], np.cumsum(0.5 * GRID * (flow[1:] + flow[:-1]))))
        return np.asarray(start + density * np.interp(record.t, grid, laid))

    return mass


def _followed(since: Array, lag: float, other: float) -> Array:
    """(N,) s since a step -> share of it that has passed two first-order lags, either of which may be 0."""
    slow, quick, t = max(lag, other), min(lag, other), np.maximum(since, 0.0)
    if slow == 0.0:
        return (since >= 0.0).astype(float)
    if slow - quick < _EQUAL * slow:
        return 1.0 - (1.0 + t / slow) * np.exp(-t / slow)
    left = quick * np.exp(-t / quick) if quick > 0.0 else 0.0
    return np.where(since > 0.0, 1.0 - (slow * np.exp(-t / slow) - left) / (slow - quick), 0.0)


def _check(record: StepRecord, law: PressureFlow) -> None:
    _, step, shuts = record.steps
    opened = record.pressure.max()
    if not (np.any(step > 0.0) and np.any(shuts)):
        wrong = "the air never opens" if not np.any(step > 0.0) else "the air is never shut"
        hint = "record several steps from 0 to a printing pressure and back, a second or two each"
    elif len(record.levels) > MOST_LEVELS:
        wrong = f"the air takes {len(record.levels)} different pressures"
        hint = 'print the steps with lead = "off" in [extruder]: then the command steps, and the clay follows'
    elif opened <= law.threshold:
        wrong = f"{opened / 1e3:.0f} kPa never moves a clay that yields at {law.threshold / 1e3:.0f} kPa"
        hint = "name the right clay with --material, or weigh its flow curve first"
    elif not np.ptp(record.mass) > 0.0:
        wrong, hint = "the scale never moves", "put it under the nozzle and tare it"
    else:
        return
    raise ProfileError(Problem("range", f"these steps show no delay: {wrong}", hint=hint))


def delay_doubts(delays: Delays) -> list[Problem]:
    """What the record does not tell well."""
    fit, found = delays.fit, []
    worst = float(delays.gain[np.argmax(np.abs(np.log(delays.gain)))])
    if abs(worst - 1.0) > OFF:
        found.append(
            Problem(
                "doubt",
                f"{100 * worst:.0f} % of the clay came that the flow curve says",
                hint="weigh the flow curve again on the same day: clay stiffens as it dries",
            )
        )
    names = ("open_dead_ms", "close_dead_ms", "line_lag_ms")
    for name, value, sigma in zip(names, fit.value, fit.sigma, strict=False):
        spread = fit.quantile * sigma
        if spread > max(0.3 * value, 0.02) or value < NOTHING:
            found.append(
                Problem(
                    "doubt",
                    f"{name} {1e3 * value:.0f} ± {1e3 * spread:.0f}: not well known"
                    + (", hardly to be told from the dead times" if _entwined(fit) else ""),
                    key=f"clay.{name}",
                    hint="record more steps, at two pressures, with a scale that reads finer or more often",
                )
            )
    return found


def _entwined(fit: Fit) -> bool:
    return bool(np.max(np.abs(fit.correlation[2, :2])) > ENTWINED)
