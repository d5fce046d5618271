"""What a reproduced figure or table is made of."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from cdhr_host.profile import Profile
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class Cell:
    """One number of the paper beside ours."""

    name: str
    paper: str
    """as printed; empty where the text has no number"""
    ours: float
    unit: str
    reading: str
    """under which reading of the paper ours was computed"""
    expected: float | None = None
    """what this reading gave in the independent study that docs/paper.md reports"""
    tolerance: float = 0.0
    """of ``ours`` against ``expected``, same unit"""

    @property
    def holds(self) -> bool | None:
        """Whether ours is what the study found; None where it has no number."""
        return None if self.expected is None else abs(self.ours - self.expected) <= self.tolerance

    @property
    def ratio(self) -> float | None:
        """Ours over the paper's."""
        try:
            printed = float(self.paper)
        except ValueError:
            return None
        return self.ours / printed if printed else None


@dataclass(frozen=True, slots=True)
class Panel:
    """One drawing: curves over time."""

    title: str
    unit: str
    t: Array
    curves: Mapping[str, Array]


@dataclass(frozen=True, slots=True)
class Item:
    """A figure or table, or both when they show the same runs."""

    title: str
    cells: tuple[Cell, ...]
    why: str
    """why ours differs from the paper's"""
    panels: tuple[Panel, ...] = field(default_factory=tuple)


@dataclass(frozen=True, slots=True)
class Study:
    """The machines, and how much is run: everything, or what a test has time for."""

    profiles: Mapping[str, Profile]
    """by name: paper and paper-simulation"""
    seeds: int = 5
    thorough: bool = True
    """slow readings too, and the experiments to their end"""


def known(said: str, chance: float = 0.0, share: float = 0.0) -> tuple[float | None, float]:
    """The study's word -> its number and the tolerance: half its last digit, ``chance``, a share of it.

    "-" says nothing.
    """
    if said == "-":
        return None, 0.0
    digit = 0.5 * 10.0 ** -len(said.partition(".")[2])
    return float(said), digit + chance + share * float(said)


def cells(
    names: str, paper: str, ours: Array, expected: str, *, unit: str, reading: str, tolerance: float
) -> tuple[Cell, ...]:
    """One cell for each word of ``names``; ``paper`` and ``expected`` have as many words, "-" for none."""
    rows = zip(names.split(), paper.split(), ours.tolist(), expected.split(), strict=True)
    return tuple(
        Cell(
            name,
            "" if printed == "-" else printed,
            value,
            unit,
            reading,
            None if wanted == "-" else float(wanted),
            tolerance,
        )
        for name, printed, value, wanted in rows
    )
