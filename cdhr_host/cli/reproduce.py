"""``cdhr reproduce``: the paper's figures and tables, recomputed."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdhr_host.cli.options import Json, examples
from cdhr_host.cli.refusals import Refusal, emit, say, writing

if TYPE_CHECKING:
    from cdhr_host.report.paper import Item

EXAMPLES = examples(
    "cdhr reproduce",
    "cdhr reproduce --figure 7",
    "cdhr reproduce --table 1 --out /tmp/table1",
    more="Pictures need matplotlib: pip install 'cdhr-host[plot]'.",
)


def reproduce(
    *,
    figure: Annotated[
        int | None, typer.Option("--figure", "-f", metavar="N", help="One figure: 5-8, 10, 11, 13-16.")
    ] = None,
    table: Annotated[
        int | None, typer.Option("--table", "-t", metavar="N", help="One table: 1 or 2.")
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="Where page and pictures go.")
    ] = Path("reproduction"),
    seeds: Annotated[
        int, typer.Option(metavar="N", help="How many faulty machines are drawn.", min=1, max=100)
    ] = 5,
    quick: Annotated[
        bool, typer.Option("--quick", help="Leave out slow readings; short experiments.")
    ] = False,
    json_: Json = False,
) -> None:
    """Recompute the paper on the simulated machine: its numbers, ours, and why they differ."""
    from cdhr_host.report.paper import FIGURES, TABLES
    from cdhr_host.report.paper.page import totals
    from cdhr_host.report.paper.pictures import available
    from cdhr_host.report.reproduce import PAGE, names_of, study, write

    try:
        names = names_of(figure, table)
    except KeyError as error:
        known = f"figures {sorted(FIGURES)} and tables {sorted(TABLES)}"
        raise Refusal(f"cdhr: error: no {error.args[0]} to recompute\nhint: there are {known}") from error
    if not available():
        say("cdhr: warning: no pictures without matplotlib; pip install 'cdhr-host[plot]'")
    with writing(out):
        found = write(names, study(seeds=seeds, thorough=not quick), out, _told)
    compared, agree = totals(found.values())
    if json_:
        emit(
            json.dumps(
                {"page": str(out / PAGE), "compared": compared, "agree": agree, "items": _record(found)}
            )
        )
        return
    emit(f"{out / PAGE}: {agree} of {compared} numbers agree with the study that docs/paper.md reports")


def _told(name: str, item: "Item") -> None:
    say(f"{name}: {len(item.cells)} numbers")


def _record(found: "dict[str, Item]") -> dict[str, list[dict[str, object]]]:
    return {
        name: [
            {
                "name": cell.name,
                "paper": cell.paper,
                "ours": cell.ours,
                "unit": cell.unit,
                "study": cell.expected,
                "agrees": cell.holds,
                "reading": cell.reading,
            }
            for cell in item.cells
        ]
        for name, item in found.items()
    }
