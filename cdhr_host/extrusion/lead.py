"""Planned flow -> the pressure command, early enough: on the ticks of the drives.

What a command does arrives at the clay after the dead times and through the lags. So this
stage looks at what is planned, works out on the axis of arrival which level the regulator's
lag has to be fed with, and sends it earlier by the dead time. It stands behind everything that
changes the time axis (override, hold, resume), so the lead is right under all of them.

With two lags the regulator's pressure is wanted at p + line_lag · p', p being what the clay is
to have; the level that takes the regulator there is the exact inverse of its lag. A level
stays between LEAST and the supply's greatest while the air is open. The end of the air has a
dead time of its own: when it is the longer one, the last levels cannot be sent any more and the
level before them lasts, which the inverse allows for.
"""

import copy
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any, ClassVar, Final, Generic, Protocol, Self, TypeVar

import numpy as np

from cdhr_host.extrusion.following import follow, settle
from cdhr_host.extrusion.model import AirModel, ticks
from cdhr_host.extrusion.past import Past
from cdhr_host.extrusion.wanted import Gaps, Wanted, coasted, until_shut, wanted
from cdhr_host.values import Array, Flags, Ints

LEAST: Final = 200.0
"""Pa: the lowest level of open air; 0 would shut the valve"""
SHUT, FREE, LASTING = range(3)
COASTING: Final = 1.0
"""s looked ahead for the end of a bead where clay is left to run out"""


class Rows(Protocol):
    """N consecutive ticks: what a stage needs of them, a dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def tick(self) -> Ints:
        """(N,)"""
        ...

    @property
    def nozzle_G(self) -> Array:
        """(N, 3) m"""
        ...

    @property
    def flow(self) -> Array:
        """(N,) m³/s"""
        ...

    def __len__(self) -> int: ...

    def __getitem__(self, rows: slice | Flags) -> Self: ...


R = TypeVar("R", bound=Rows)


class AirStage(Generic[R]):
    """Rows in, the same rows out with the pressure command in them, ``lead`` ticks later.

    Rows come in batches of any size, their ticks consecutive; the result does not depend on the
    batches. Without delays in the model rows pass as they are.
    """

    def __init__(self, model: AirModel, period: float) -> None:
        self._model = model
        self._period = period
        self._keep = float(np.exp(-period / model.regulator_lag)) if model.regulator_lag > 0.0 else 0.0
        self._open, self._close = ticks(model.open_dead, period), ticks(model.close_dead, period)
        self._gaps = Gaps(*(ticks(each, period) for each in (model.restore, model.gap, model.lag)))
        coasting = ticks(COASTING, period) if model.coast > 0.0 else 0
        self._ahead = self._gaps.longest + max(self._close - self._open, 0) + coasting + 2
        self.lead = max(self._open, self._close) + self._ahead if model.leads else 0
        self._rows: R | None = None
        self._past = Past()
        self._lasting = 0

    def push(self, rows: R) -> R:
        """Further rows -> those whose pressure no later row can change."""
        if not self.lead or not len(rows):
            return rows
        if self._past.empty:
            self._past.begin(int(rows.tick[0]), self._open)
        if self._rows is not None and rows.tick[0] != self._rows.tick[-1] + 1:
            raise ValueError(f"rows go on at tick {rows.tick[0]}, not {self._rows.tick[-1] + 1}")
        self._rows = rows if self._rows is None else _joined(self._rows, rows)
        self._arrive(int(rows.tick[-1]) + 1 - self._ahead, self._flow(self._rows))
        return self._sent()

    def flush(self) -> R | None:
        """The rows still held, if any, as they are when the nozzle stands after them."""
        rows = self._rows
        if rows is None or not len(rows):
            return None
        end = int(rows.tick[-1]) + 1
        flow = np.concatenate((self._flow(rows), np.zeros(self.lead + self._ahead)))
        self._arrive(end + max(self._open, self._close), flow)
        return self._sent()

    def fork(self) -> "AirStage[R]":
        """This stage as it is now, to go on apart from it."""
        other = copy.copy(self)
        other._past = copy.copy(self._past)
        return other

    def restart(self, tick: int) -> None:
        """Forget rows from ``tick`` on: others come in their place. What was sent before stays sent.

        Raises ValueError when that is longer ago than is remembered.
        """
        if not self.lead:
            return
        kept = None if self._rows is None else self._rows[self._rows.tick < tick]
        self._rows = kept if kept is not None and len(kept) else None
        unsent = tick if self._rows is None else int(self._rows.tick[0])
        if self._past.cut(tick + self._open) and self._past.level > 0.0:
            self._lasting = unsent + self._close

    def _flow(self, rows: R) -> Array:
        if self._model.coast == 0.0:
            return rows.flow
        steps = np.linalg.norm(np.diff(rows.nozzle_G, axis=0, prepend=rows.nozzle_G[:1]), axis=1)
        return coasted(rows.flow, np.cumsum(steps), self._model.coast, self._gaps)

    def _arrive(self, end: int, flow: Array) -> None:
        """Work out what arrives at the clay up to tick ``end``; ``flow`` is of the rows held and later."""
        rows, past = self._rows, self._past
        assert rows is not None
        count = end - past.end
        if count <= 0:
            return
        plan = wanted(
            flow[past.end - int(rows.tick[0]) :], past.since, self._model.law, self._model.creep, self._gaps
        )
        level, reached = np.zeros(count), np.zeros(count)
        kind, regulator = self._kinds(plan)[:count], self._regulator(plan)[:count]
        cuts = [0, *(np.flatnonzero(np.diff(kind)) + 1).tolist(), count]
        before, at = past.level, past.reached
        for a, b in pairwise(cuts):
            if kind[a] == FREE:
                run = follow(regulator[a:b], at, self._keep, LEAST, self._model.pressure_max)
                level[a:b], reached[a:b] = run
            else:
                level[a:b] = before if kind[a] == LASTING else 0.0
                reached[a:b] = settle(float(level[a]), at, self._keep, b - a)
            before, at = float(level[b - 1]), float(reached[b - 1])
        past.add(level, reached, plan)

    def _kinds(self, plan: Wanted) -> Ints:
        """(N,) SHUT, FREE to choose a level, or LASTING: the end of the air is under way already."""
        opened, sent = plan.open, max(self._lasting - self._past.end, 0)
        if sent and not opened[:sent].all():
            opened = np.concatenate((np.ones(sent, dtype=np.bool_), opened[sent:]))
        else:
            sent = 0
        lasting = until_shut(opened) <= self._close - self._open
        lasting[:sent] = True
        return np.where(opened, np.where(lasting, LASTING, FREE), SHUT)

    def _regulator(self, plan: Wanted) -> Array:
        """(N,) Pa wanted of the regulator: p + line_lag · p', where the air is open."""
        lag = self._model.line_lag
        if lag == 0.0:
            return plan.pressure
        around = np.concatenate(([self._past.wanted], plan.pressure, plan.pressure[-1:]))
        return np.asarray(plan.pressure + lag * (around[2:] - around[:-2]) / (2.0 * self._period))

    def _sent(self) -> R:
        """The rows whose commands are known, taken out of those held."""
        rows = self._rows
        assert rows is not None
        first, end = int(rows.tick[0]), self._past.end - max(self._open, self._close)
        count = min(max(end - first, 0), len(rows))
        self._rows = rows[count:] if count < len(rows) else None
        commands = self._commands(first, count)
        self._past.forget()
        return replace(rows[:count], pressure=commands)

    def _commands(self, first: int, count: int) -> Array:
        """(count,) Pa: levels and the end of the air, each early by its dead time."""
        begun, lasts = (self._past.opened(first + dead, count) for dead in (self._open, self._close))
        on = begun | lasts if self._close < self._open else begun & lasts
        return np.where(on, self._past.levels(first + self._open, count), 0.0)


def _joined(rows: R, more: R) -> R:
    """One after the other."""
    names = [field.name for field in fields(rows)]
    return type(rows)(*(np.concatenate((getattr(rows, name), getattr(more, name))) for name in names))
