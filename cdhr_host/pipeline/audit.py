"""Every sample against every limit of the profile."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.errors import Problem
from cdhr_host.motion.vectors import norms
from cdhr_host.profile import Profile
from cdhr_host.units import KPA, MM
from cdhr_host.values import Array, CableState, Flags, Ints, Setpoints, ToolTrack

ROUNDING = 1e-6
"""Relative excess over a limit that is rounding."""
TOUCHING = 1e-9
"""m below the bed, or outside it, that is rounding."""


@dataclass(frozen=True, slots=True)
class _Rule:
    """One limit: where it is on the machine, in the unit people read."""

    kind: str
    what: str
    """sentence with ``{value}``, ``{limit}`` and ``{i}``, the cable's or slider's name"""
    hint: str
    unit: str
    si: float
    """factor from the unit to SI"""
    upper: bool
    """whether the limit is a greatest value"""
    names: tuple[str, ...] = ("1", "2", "3", "4", "5", "6")
    """of cables or sliders"""


RADIUS = _Rule(
    "bed",
    "the nozzle would be {value} mm from the bed's axis, the bed ends at {limit} mm",
    "move the part nearer to the centre, or enlarge [bed] radius_mm if the machine reaches there",
    "mm",
    MM,
    upper=True,
)
BELOW = _Rule(
    "bed",
    "the nozzle would be at z = {value} mm, below the bed at {limit} mm",
    "raise the part, or check the slicer's z offset",
    "mm",
    MM,
    upper=False,
)
ABOVE = _Rule(
    "bed",
    "the nozzle would be at z = {value} mm, the bed's volume ends at {limit} mm",
    "lower the part, or enlarge [bed] height_mm if the machine reaches there",
    "mm",
    MM,
    upper=True,
)
_FORCE_HINT = "move the part nearer to the axis, or take a profile with wider force windows (paper-wide)"
SLACK = _Rule(
    "force", "cable {i} would carry {value} N, less than {limit} N", _FORCE_HINT, "N", 1.0, upper=False
)
OVERLOAD = _Rule(
    "force", "cable {i} would carry {value} N, more than {limit} N", _FORCE_HINT, "N", 1.0, upper=True
)
PAIRED = ("1 left", "2 left", "3 left", "1 right", "2 right", "3 right")
SINGLE_SLACK = replace(SLACK, names=PAIRED)
SINGLE_OVERLOAD = replace(OVERLOAD, names=PAIRED)
WOUND_IN = _Rule(
    "travel",
    "slider {i} would be at {value} mm, its travel ends at {limit} mm",
    "move the part, or give the slider more travel in [sliders]",
    "mm",
    MM,
    upper=False,
)
PAID_OUT = _Rule("travel", WOUND_IN.what, WOUND_IN.hint, "mm", MM, upper=True)
SLIDER_SPEED = _Rule(
    "slider speed",
    "slider {i} would move at {value} mm/s, more than {limit} mm/s",
    "lower F",
    "mm/s",
    MM,
    upper=True,
)
SLIDER_ACCELERATION = _Rule(
    "slider acceleration",
    "slider {i} would accelerate at {value} mm/s², more than {limit} mm/s²",
    "lower [limits] acceleration_max_mm_s2",
    "mm/s²",
    MM,
    upper=True,
)
SPEED = _Rule(
    "speed",
    "the nozzle would move at {value} mm/s, more than {limit} mm/s",
    "please report this as a bug",
    "mm/s",
    MM,
    upper=True,
)
ACCELERATION = _Rule(
    "acceleration",
    "the nozzle would accelerate at {value} mm/s², more than {limit} mm/s²",
    "please report this as a bug",
    "mm/s²",
    MM,
    upper=True,
)
PRESSURE = _Rule(
    "pressure",
    "the flow needs {value} kPa, the air gives {limit} kPa",
    "lower F, the layer height or the flow (M221), or correct the model in [extruder]",
    "kPa",
    KPA,
    upper=True,
)


def on_bed(position_G: Array, profile: Profile) -> Flags:
    """(N, 3) m -> (N,): whether the nozzle is inside the printable cylinder."""
    x, y, z = position_G.T
    bed = profile.bed
    inside: Flags = (
        (np.hypot(x, y) <= bed.radius + TOUCHING) & (z >= -TOUCHING) & (z <= bed.height + TOUCHING)
    )
    return inside


class Audit:
    """Checks blocks in order; a line that breaks a limit is told for each cable or slider.

    It is told again when a later block finds the same line worse, with the same ``key``.
    """

    def __init__(self, profile: Profile) -> None:
        self._profile = profile
        forces = profile.forces
        self._least = np.repeat([forces.lower_min, forces.upper_min], 3)
        self._greatest = np.repeat([forces.lower_max, forces.upper_max], 3)
        self._told: dict[tuple[_Rule, int], tuple[int, float]] = {}
        self.total = 0
        """lines, limits and cables told so far"""

    def places(self, track: ToolTrack) -> list[Problem]:
        """What of a track leaves the bed."""
        bed, (x, y, z) = self._profile.bed, track.position_G.T
        found = [
            *self._broken(RADIUS, track.line, np.hypot(x, y)[:, None], bed.radius, TOUCHING),
            *self._broken(BELOW, track.line, z[:, None], 0.0, TOUCHING),
            *self._broken(ABOVE, track.line, z[:, None], bed.height, TOUCHING),
        ]
        return sorted(found, key=_by_line)

    def motion(self, track: ToolTrack, state: CableState, nine: Array, setpoints: Setpoints) -> list[Problem]:
        """What of a block breaks a limit of cables, sliders, nozzle or air; ``nine`` (N, 9) N."""
        forces = self._profile.forces
        line, limits, sliders = track.line, self._profile.limits, self._profile.sliders
        speed, acceleration = norms(track.velocity)[:, None], norms(track.acceleration)[:, None]
        pressure, supply = setpoints.pressure[:, None], self._profile.extruder.pressure_max
        found = [
            *self._broken(SLACK, line, state.tension, self._least),
            *self._broken(OVERLOAD, line, state.tension, self._greatest),
            *self._broken(SINGLE_SLACK, line, nine[:, :6], forces.single_min),
            *self._broken(SINGLE_OVERLOAD, line, nine[:, :6], forces.single_max),
            *self._broken(WOUND_IN, line, setpoints.slider, sliders.travel_min),
            *self._broken(PAID_OUT, line, setpoints.slider, sliders.travel_max),
            *self._broken(SLIDER_SPEED, line, np.abs(state.rate), sliders.speed_max),
            *self._broken(SLIDER_ACCELERATION, line, np.abs(state.acceleration), sliders.acceleration_max),
            *self._broken(SPEED, line, speed, limits.speed_max),
            *self._broken(ACCELERATION, line, acceleration, limits.acceleration_max),
            *self._broken(PRESSURE, line, pressure, supply),
        ]
        return sorted(found, key=_by_line)

    def _broken(
        self, rule: _Rule, line: Ints, values: Array, limit: Array | float, slack: float = 0.0
    ) -> Iterator[Problem]:
        """Values (N, k) against a limit: the worst of each line and column."""
        sign = 1.0 if rule.upper else -1.0
        bound = np.broadcast_to(limit, values.shape[1:])
        excess = sign * (values - bound) - np.maximum(slack, ROUNDING * np.abs(bound))
        for i in np.flatnonzero((excess > 0.0).any(axis=0)).tolist():
            rows = np.flatnonzero(excess[:, i] > 0.0)
            heads = np.flatnonzero(np.diff(line[rows], prepend=-1))
            worst = sign * np.maximum.reduceat(sign * values[rows, i], heads)
            for at, value in zip(line[rows[heads]].tolist(), worst.tolist(), strict=True):
                told_line, told = self._told.get((rule, i), (-1, value))
                if told_line == at and sign * value <= sign * told:
                    continue
                self._told[rule, i] = at, value
                self.total += told_line != at
                yield _problem(rule, at, i, value, float(bound[i]))


def _problem(rule: _Rule, line: int, i: int, value: float, limit: float) -> Problem:
    value, limit = value / rule.si, limit / rule.si
    digits = 3
    while f"{value:.{digits}f}" == f"{limit:.{digits}f}" and digits < 9:
        digits += 1
    message = rule.what.format(i=rule.names[i], value=f"{value:.{digits}f}", limit=f"{limit:g}")
    key = f"{rule.kind} {rule.names[i]} {'most' if rule.upper else 'least'}"
    return Problem(
        rule.kind, message, line=line, key=key, value=value, limit=limit, unit=rule.unit, hint=rule.hint
    )


def _by_line(problem: Problem) -> int:
    return problem.line or 0
