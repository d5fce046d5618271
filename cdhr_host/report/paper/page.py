"""The reproduction as one page of Markdown."""

from collections.abc import Iterable, Iterator, Mapping

from cdhr_host.report.paper.items import Cell, Item

HEAD = """# The paper, recomputed

Qian et al., Mech. Sci. 14, 371-386, 2023, https://doi.org/10.5194/ms-14-371-2023, on the simulated machine.
*study*: what an independent study found under the same reading; *agrees* compares ours with it, not with the
paper. A number of the paper that no reading gives is shown as it comes out. Figures are taken by their
subject, in the order of the text.

Faults of the simulated machine, once for every cell: pulleys 1 mm (standard deviation) out of place, run-out
0.1 mm, lost motion 0.05 mm, camera 0.08 mm at 60 Hz, 50 ms late; {seeds} machines.
"""
COLUMNS = "| quantity | paper | ours | ratio | study | agrees | reading |\n|---|---|---|---|---|---|---|"


def page(items: Mapping[str, Item], pictures: Mapping[str, str], seeds: int) -> str:
    """Items by name, file names of their pictures -> Markdown."""
    return "\n".join([HEAD.format(seeds=seeds), *_parts(items, pictures), ""])


def _parts(items: Mapping[str, Item], pictures: Mapping[str, str]) -> Iterator[str]:
    for name, item in items.items():
        yield f"## {item.title}\n"
        if name in pictures:
            yield f"![{item.title}]({pictures[name]})\n"
        yield COLUMNS
        yield from (_row(cell) for cell in item.cells)
        yield f"\n**Why they differ.** {item.why}\n"


def _row(cell: Cell) -> str:
    said = "" if cell.expected is None else f"{cell.expected:g}"
    agrees = {None: "", True: "yes", False: "**no**"}[cell.holds]
    ratio = "" if cell.ratio is None else f"{cell.ratio:.3g}"
    name = f"{cell.name}, {cell.unit}" if cell.unit != "-" else cell.name
    fields = (name, cell.paper, number(cell.ours), ratio, said, agrees, cell.reading)
    return f"| {' | '.join(fields)} |"


def number(value: float) -> str:
    """Four digits, no more than matter; rounding noise is 0."""
    return "0" if abs(value) < 1e-9 else f"{value:.4g}"


def totals(items: Iterable[Item]) -> tuple[int, int]:
    """Numbers with a study to compare with, and how many of them agree."""
    held = [cell.holds for item in items for cell in item.cells if cell.holds is not None]
    return len(held), sum(held)
