"""``cdhr reproduce``: items, their page, their pictures."""

from collections.abc import Callable, Sequence
from pathlib import Path

from cdhr_host.errors import Problem, ProfileError
from cdhr_host.pipeline import open_profile
from cdhr_host.report.paper import ITEMS, Item, Study, item_name, reproduce
from cdhr_host.report.paper.page import page
from cdhr_host.report.paper.pictures import available, draw

PAGE = "paper.md"
MACHINES = ("paper", "paper-simulation")


def names_of(figure: int | None, table: int | None) -> list[str]:
    """What was asked for, everything when nothing; raises KeyError for a number the paper has not."""
    if figure is None and table is None:
        return list(ITEMS)
    asked = [("figure", figure), ("table", table)]
    return list(dict.fromkeys(item_name(kind, number) for kind, number in asked if number is not None))


def study(*, seeds: int = 5, thorough: bool = True) -> Study:
    """The installed machines of Table A1; raises ProfileError where one is no longer what it was."""
    profiles = {name: open_profile(name) for name in MACHINES}
    for name, profile in profiles.items():
        if profile.geometry.pulley_model != "swivel":
            raise ProfileError(
                Problem("changed", f"{name} no longer is Table A1", key="geometry.pulley_model")
            )
    return Study(profiles, seeds, thorough)


def write(
    names: Sequence[str], of: Study, folder: Path, told: Callable[[str, Item], None], *, workers: int = 2
) -> dict[str, Item]:
    """Recompute, tell each item as it comes, leave page and pictures in ``folder``.

    Without matplotlib there is the page alone.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, Item] = {}
    pictures: dict[str, str] = {}
    for name, item in reproduce(names, of, workers=workers):
        found[name] = item
        if item.panels and available():
            pictures[name] = f"{name}.png"
            draw(item, folder / pictures[name])
        told(name, item)
    (folder / PAGE).write_text(page(found, pictures, of.seeds), encoding="utf-8")
    return found
