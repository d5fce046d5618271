"""The paper by one command: which figures and tables there are, and how to get them."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Final

from cdhr_host.report.paper import controlled, driven, experiment, kinematic, sensitivity
from cdhr_host.report.paper.items import Cell, Item, Panel, Study

ITEMS: Final[dict[str, Callable[[Study], Item]]] = {
    "figure-5": kinematic.errors,
    "figure-6": kinematic.spring,
    "figure-7": driven.errors,
    "figure-8": driven.spring,
    "figure-10": driven.undistributed,
    "figure-11": driven.distributed,
    "figure-13": controlled.without_optimisation,
    "figure-14": controlled.with_optimisation,
    "table-1": experiment.table1,
    "table-2": experiment.table2,
    "sensitivity": sensitivity.sensitivity,
}
"""name -> how it is recomputed"""
FIGURES: Final = {5, 6, 7, 8, 10, 11, 13, 14, 15, 16}
TABLES: Final = {1, 2}
SAME_RUNS: Final = {"figure-15": "table-1", "figure-16": "table-2"}
"""figures that show the runs of a table"""


def item_name(kind: str, number: int) -> str:
    """``figure`` or ``table`` and its number -> name in ITEMS; raises KeyError for others."""
    name = f"{kind}-{number}"
    name = SAME_RUNS.get(name, name)
    if name not in ITEMS:
        raise KeyError(name)
    return name


def reproduce(names: Sequence[str], study: Study, *, workers: int = 2) -> Iterator[tuple[str, Item]]:
    """Each named item, in order, as it is finished; several processes share the work."""
    if workers < 2 or len(names) < 2:
        yield from ((name, ITEMS[name](study)) for name in names)
        return
    with ProcessPoolExecutor(workers) as pool:
        slow_first = sorted(names, key=lambda name: not name.startswith("table"))
        running = {name: pool.submit(ITEMS[name], study) for name in slow_first}
        yield from ((name, running[name].result()) for name in names)


__all__ = ["FIGURES", "ITEMS", "TABLES", "Cell", "Item", "Panel", "Study", "item_name", "reproduce"]
