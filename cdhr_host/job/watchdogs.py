"""What the host watches while it prints: is the machine where the plan has it, does everybody keep up?

Drives and links have watchdogs of their own; these look at what only the host can see, because
it knows the plan. Each is told once, with what is to be done about it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np

from cdhr_host.drives.timing import CycleTiming
from cdhr_host.errors import Problem
from cdhr_host.profile.schema import Profile
from cdhr_host.units import KPA, MM
from cdhr_host.values import Array, Feedback, Flags, Setpoints

LATE_WINDOW: Final = 10.0
"""s over which late cycles are counted"""


class Reaction(Enum):
    """What an alarm asks for."""

    STOP = "stop"
    """the link's own stop at once, then FAULT: the machine is not what the plan takes it for"""
    HOLD = "hold"
    """a hold on the path; the operator may go on"""


@dataclass(frozen=True, slots=True)
class Alarm:
    """Something is wrong."""

    reaction: Reaction
    problem: Problem


class Watchdogs:
    """One run's watchdogs; made anew, or ``rearmed``, when the machine is armed."""

    def __init__(self, profile: Profile) -> None:
        self._watch = profile.watch
        self._per_newton = profile.sliders.screw_lead / (2.0 * math.pi * profile.drives.screw_efficiency)
        period = profile.drives.period
        self._period = period
        self._slack = Lasting(profile.watch.force_settling, period)
        self._force = Lasting(profile.watch.force_settling, period)
        self._torque = Lasting(profile.watch.force_settling, period)
        self._following = Lasting(profile.watch.following_settling, period)
        self._pressure = Lasting(profile.watch.pressure_settling, period)
        self._before: Array | None = None
        self._told: Array | None = None
        self._counted = (0.0, 0, 0)
        self._fed = (-math.inf, -1)

    def executed(self, rows: Setpoints, feedback: Feedback) -> Alarm | None:
        """N >= 1 executed rows and what was measured at each -> the first thing wrong, if any."""
        speed, heard = self._speed(rows.slider), self._heard(rows, feedback)
        return next(self._found(rows[heard], feedback[heard], speed[heard]), None) if heard.any() else None

    def cycles(self, now: float, timing: CycleTiming | None) -> Alarm | None:
        """How punctual the sender has been so far, at ``now`` s -> the alarm, if it is too late too often."""
        if timing is None:
            return None
        since, cycles, late = self._counted
        if timing.cycles < cycles or now - since > LATE_WINDOW:
            self._counted = now, timing.cycles, timing.late
        seen = max(timing.cycles - cycles, 1)
        share, limit = (timing.late - late) / seen, self._watch.late_share
        if seen * self._period < 1.0 or share <= limit:
            return None
        self._counted = now, timing.cycles, timing.late
        problem = Problem(
            "late",
            f"{share:.1%} of the sender's cycles were late (limit {limit:.1%})",
            value=share * 100.0,
            limit=limit * 100.0,
            unit="%",
            hint="close other programs, or give the sender real-time priority",
        )
        return Alarm(Reaction.HOLD, problem)

    def fed(self, now: float, tick: int, *, waiting: bool) -> Alarm | None:
        """The last tick fed, at ``now`` s -> the alarm if nothing comes although the link is ``waiting``."""
        since, last = self._fed
        if tick != last or not waiting:
            self._fed = now, tick
            return None
        silence = now - since
        if silence <= self._watch.feeder_silence:
            return None
        self._fed = now, tick
        problem = Problem(
            "feeder",
            f"no new setpoint for {silence:.1f} s (limit {self._watch.feeder_silence:g} s)",
            value=silence,
            limit=self._watch.feeder_silence,
            unit="s",
            hint="the planner does not keep up: close other programs",
        )
        return Alarm(Reaction.HOLD, problem)

    def disk(self, free: int) -> Alarm | None:
        """Bytes free where the journal is -> the alarm, if too few."""
        limit = self._watch.disk_free
        if free >= limit * 1_000_000:
            return None
        problem = Problem(
            "disk",
            f"{free / 1e6:.0f} MB are free on the journal's disk (limit {limit} MB)",
            value=free / 1e6,
            limit=limit,
            unit="MB",
            hint="delete old logs and journals, then resume",
        )
        return Alarm(Reaction.HOLD, problem)

    def _speed(self, slider: Array) -> Array:
        """(N, 6) m -> (N, 6) m/s, each tick against the one before."""
        before = slider[:1] if self._before is None else self._before
        self._before = slider[-1:]
        speed: Array = np.abs(np.diff(np.concatenate((before, slider)), axis=0)) / self._period
        return speed

    def _heard(self, rows: Setpoints, feedback: Feedback) -> Flags:
        """(N,) whether a row tells anything: a link that bears late answers repeats the last one meanwhile.

        Where the setpoints move and nothing at all changes, that is an old answer, and no machine that
        does not follow. How long answers may be missing is for the link to watch.
        """
        now = np.column_stack((rows.slider, feedback.slider, feedback.torque, feedback.pressure))
        before = now[:1] - 1.0 if self._told is None else self._told
        self._told = now[-1:]
        changed = np.diff(np.concatenate((before, now)), axis=0) != 0.0
        return np.asarray(changed[:, 6:].any(axis=1) | ~changed[:, :6].any(axis=1))

    def _found(self, rows: Setpoints, feedback: Feedback, speed: Array) -> Iterator[Alarm]:
        watch = self._watch
        away = np.abs(feedback.slider - rows.slider)
        allowed = watch.following_floor + watch.following_lag * speed
        if (at := self._following.first(away > allowed)) is not None:
            yield _FOLLOWING.alarm(rows, at, away, float(allowed[at]))
        if len(feedback.force):
            yield from self._forces(rows, feedback.force)
        off = np.abs(feedback.torque - rows.tension * self._per_newton)
        if (at := self._torque.first(off > watch.torque_deviation)) is not None:
            yield _TORQUE.alarm(rows, at, off, watch.torque_deviation)
        amiss = np.abs(feedback.pressure - rows.pressure)[:, None]
        if (at := self._pressure.first(amiss > watch.pressure_deviation)) is not None:
            yield _PRESSURE.alarm(rows, at, amiss, watch.pressure_deviation)

    def _forces(self, rows: Setpoints, force: Array) -> Iterator[Alarm]:
        watch = self._watch
        if (at := self._slack.first(force < watch.slack_force)) is not None:
            yield _SLACK.alarm(rows, at, force, watch.slack_force)
        off = np.abs(force - rows.tension[:, : force.shape[1]])
        if (at := self._force.first(off > watch.force_deviation)) is not None:
            yield _FORCE.alarm(rows, at, off, watch.force_deviation)


@dataclass(frozen=True, slots=True)
class _Deviation:
    """One way of not being where the plan is, and its words."""

    kind: str
    sentence: str
    unit: str
    one: float
    """of the unit, in SI"""
    reaction: Reaction
    hint: str

    def alarm(self, rows: Setpoints, at: tuple[int, int], found: Array, limit: float) -> Alarm:
        """The row and the axis it was found at, (N, k) what was found, and its limit."""
        row, axis = at
        value, most = float(found[at]) / self.one, limit / self.one
        what = self.sentence.format(axis=axis + 1, value=f"{value:.3g} {self.unit}")
        message = f"{what} at tick {rows.tick[row]} (limit {most:.3g} {self.unit})"
        hint = self.hint.format(axis=axis + 1)
        return Alarm(
            self.reaction,
            Problem(
                self.kind, message, int(rows.line[row]), value=value, limit=most, unit=self.unit, hint=hint
            ),
        )


_BLOCKED: Final = "free slider {axis}, check its cable and its coupling; then reference the machine again"
_FOLLOWING: Final = _Deviation(
    "following-error", "slider {axis} is {value} away from its setpoint", "mm", MM, Reaction.STOP, _BLOCKED
)
_TORQUE: Final = _Deviation(
    "torque-deviation",
    "motor {axis} is {value} away from its planned torque",
    "N m",
    1.0,
    Reaction.STOP,
    _BLOCKED,
)
_FORCE: Final = _Deviation(
    "force-deviation",
    "cable {axis} is {value} away from its planned force",
    "N",
    1.0,
    Reaction.STOP,
    _BLOCKED,
)
_SLACK: Final = _Deviation(
    "slack",
    "cable {axis} carries {value}: it is slack",
    "N",
    1.0,
    Reaction.STOP,
    "look at cable {axis}, its pulley and its slider before anything moves again",
)
_PRESSURE: Final = _Deviation(
    "pressure-deviation",
    "the pressure is {value} away from its command",
    "kPa",
    KPA,
    Reaction.HOLD,
    "check the air supply, the hose and the clay; then resume",
)


class Lasting:
    """Tells a condition once it has lasted, across batches."""

    def __init__(self, lasting: float, period: float) -> None:
        self._ticks = max(math.ceil(lasting / period), 1)
        self._run: Array | None = None

    def first(self, bad: Flags) -> tuple[int, int] | None:
        """(N, k) flags -> row and column at which one has lasted long enough; None while none has."""
        run = np.zeros(bad.shape[1]) if self._run is None else self._run
        counts = np.arange(1.0, len(bad) + 1.0)[:, None]
        reset = np.maximum.accumulate(np.where(bad, 0.0, counts), axis=0)
        lasted = counts - reset + np.where(reset == 0.0, run, 0.0)
        self._run = lasted[-1]
        over = np.argwhere(lasted >= self._ticks)
        return (int(over[0, 0]), int(over[0, 1])) if len(over) else None
