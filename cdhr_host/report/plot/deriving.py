"""What a log's rows say without naming it: speeds, accelerations, jerks, nine forces, margins."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.mechanism import Cables, Pairs, Windows, shares
from cdhr_host.profile import Profile
from cdhr_host.report.reading import LogFile
from cdhr_host.units import MM
from cdhr_host.values import Array

SMOOTH: Final = 20e-3
"""s: half the span of the differences for logs whose lengths are rounded; a tick for the others"""
ORDERS: Final = ("speed_mm_s", "acceleration_mm_s2", "jerk_mm_s3")
SIX: Final = range(1, 7)


class Table:
    """(N, k) rows with the names of their columns."""

    def __init__(self, names: Iterable[str], rows: Array) -> None:
        self.names, self.rows = tuple(names), rows
        self._at = {name: k for k, name in enumerate(self.names)}

    def __contains__(self, name: str) -> bool:
        return name in self._at

    def __getitem__(self, name: str) -> Array:
        """(N,)"""
        return self.rows[:, self._at[name]]

    def get(self, name: str, default: Array) -> Array:
        """(N,), or ``default`` where there is no such column."""
        at = self._at.get(name)
        return default if at is None else self.rows[:, at]

    def columns(self, names: Iterable[str]) -> Array:
        """(N, len(names))"""
        return self.rows[:, [self._at[name] for name in names]]

    def with_columns(self, more: dict[str, Array]) -> "Table":
        """The same with further columns (N,)."""
        return Table([*self.names, *more], np.column_stack([self.rows, *more.values()]))


@dataclass(frozen=True, slots=True)
class Stencil:
    """Central differences over ``reach`` rows to either side."""

    reach: int
    step: float
    """s: reach times the period"""

    @classmethod
    def of(cls, log: LogFile, period: float) -> "Stencil":
        """For a log of this period, s."""
        reach = max(1, round(SMOOTH / period)) if log.resolution else 1
        return cls(reach, reach * period)

    @property
    def margin(self) -> int:
        """Rows needed to either side."""
        return 2 * self.reach

    def middle(self, wide: Array) -> Array:
        """(N + 2 margin, k) -> (N, k): the rows themselves."""
        return wide[self.margin : len(wide) - self.margin]

    def differences(self, wide: Array, t: Array) -> tuple[Array, Array, Array]:
        """(N + 2 margin, k), (N + 2 margin,) s -> three (N, k): d/dt, d²/dt², d³/dt³.

        (x₊ - x₋)/2h, (x₊ - 2x + x₋)/h², (x₊₊ - 2x₊ + 2x₋ - x₋₋)/2h³; NaN beside a gap and at the ends.
        """
        m, h = self.reach, self.step
        far, near = wide[: len(wide) - 4 * m], wide[m : len(wide) - 3 * m]
        here, after, beyond = self.middle(wide), wide[3 * m : len(wide) - m], wide[4 * m :]
        even = np.abs(t[4 * m :] - t[: len(t) - 4 * m] - 4 * h) < 0.5 * h / m
        whole = np.where(even, 1.0, np.nan)[:, None]
        return (
            whole * (after - near) / (2 * h),
            whole * (after - 2 * here + near) / h**2,
            whole * (beyond - 2 * after + 2 * near - far) / (2 * h**3),
        )


def widened(blocks: Iterable[Array], margin: int) -> Iterator[Array]:
    """Blocks (N, k) -> blocks with ``margin`` further rows to either side; NaN beyond the ends."""
    held: Array | None = None
    for block in blocks:
        beyond = np.full((margin, block.shape[1]), np.nan)
        held = np.concatenate([beyond if held is None else held, block])
        if len(held) > 2 * margin:
            yield held
            held = held[len(held) - 2 * margin :]
    if held is not None:
        yield np.concatenate([held, np.full((margin, held.shape[1]), np.nan)])


class Deriver:
    """Adds to a table what can be worked out from it; with a machine also nine forces and margins."""

    def __init__(self, stencil: Stencil, machine: Profile | None) -> None:
        self._stencil = stencil
        self._machine = None if machine is None else _Machine(machine)

    def derived(self, wide: Table) -> Table:
        """Wide rows (N + 2 margin) -> (N) rows with nozzle and slider motion, forces, deviations."""
        table = Table(wide.names, self._stencil.middle(wide.rows))
        t = wide["t_s"]
        sliders = self._stencil.differences(wide.columns([f"slider{i}_mm" for i in SIX]), t)
        nozzle = self._stencil.differences(wide.columns(["x_mm", "y_mm", "z_mm"]), t)
        more = {"speed_mm_s": np.linalg.norm(nozzle[0], axis=1)}
        for order, values in zip(ORDERS, sliders, strict=True):
            more |= {f"slider{i}_{order}": values[:, i - 1] for i in SIX}
        if "pressure_actual_kpa" in table:
            more["pressure_deviation_kpa"] = table["pressure_actual_kpa"] - table["pressure_kpa"]
        if self._machine is not None and "tension1_n" in table:
            more |= self._machine.forces(table)
        return table.with_columns(more)


class _Machine:
    def __init__(self, profile: Profile) -> None:
        self._cables, self._pairs = Cables.from_profile(profile), Pairs.from_profile(profile)
        self._windows = Windows.from_profile(profile)

    def forces(self, table: Table) -> dict[str, Array]:
        """Left and right cables of the pairs by Eq. (13), (14), and the least margin of all nine."""
        place = table.columns(["x_mm", "y_mm", "z_mm"]) * MM - self._cables.reference_G
        six = table.columns([f"tension{i}_n" for i in SIX])
        share = shares(self._cables, self._pairs, place, six[:, :3])
        names = [f"tension{i}_{side}_n" for side in ("left", "right") for i in (1, 2, 3)]
        found = dict(zip(names, [*share.left.T, *share.right.T], strict=True))
        nine = np.hstack([share.left, share.right, six[:, 3:]])
        return {**found, "margin": self._windows.least_margin(nine)}
