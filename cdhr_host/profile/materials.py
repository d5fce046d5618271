"""Material profiles: the [clay] section as a file of its own, put into a machine's table by name."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from cdhr_host.errors import Problem, ProfileError
from cdhr_host.profile.clay import Clay
from cdhr_host.profile.fields import Section
from cdhr_host.profile.load import find_among, problems_of, profile_folder, read_table


class MaterialFile(Section):
    """A material profile: one clay."""

    clay: Clay


def material_folder() -> Path:
    """Where installed material profiles live."""
    return profile_folder() / "materials"


def material_names() -> dict[str, Path]:
    """Installed material profiles by name."""
    return {path.stem: path for path in sorted(material_folder().glob("*.toml"))}


def find_material(name_or_path: str) -> Path:
    """The file of a material profile; raises ProfileError with the nearest known name."""
    return find_among(material_names(), name_or_path, "material")


def is_material(name_or_path: str) -> bool:
    """Whether this names a material, or a file that has a clay and no machine."""
    if name_or_path in material_names():
        return True
    path = Path(name_or_path)
    return path.is_file() and "clay" in (table := read_table(path)) and "machine" not in table


def read_material(name_or_path: str) -> MaterialFile:
    """A material by name or path; raises ProfileError with every problem of its file at once."""
    table = read_table(find_material(name_or_path))
    problems = _problems(table)
    if problems:
        raise ProfileError(problems)
    return MaterialFile.model_validate(table)


def with_material(table: dict[str, Any], material: str | None = None) -> tuple[dict[str, Any], list[Problem]]:
    """A machine's table -> the table with its named clay as section [clay], and what is wrong.

    ``material`` goes before ``extruder.material``. The result names no material any more: it is
    complete in itself. Raises ProfileError when there is no such material.
    """
    extruder = table.get("extruder")
    named = extruder.get("material", "") if isinstance(extruder, dict) else ""
    if not isinstance(named, str) or not (material or named):
        return table, []
    if not material and "clay" in table:
        message = f'extruder.material = "{named}" and a section [clay] both say what the clay is'
        return table, [
            Problem("inconsistent", message, key="extruder.material", hint="remove one of the two")
        ]
    name = material or named
    clay = read_table(find_material(name))
    problems = [_about(name, problem) for problem in _problems(clay)]
    merged = {**table, "clay": {} if problems else clay["clay"]}
    if isinstance(extruder, dict):
        merged["extruder"] = {key: value for key, value in extruder.items() if key != "material"}
    return merged, problems


def _problems(table: dict[str, Any]) -> list[Problem]:
    """Everything wrong with a material file; each of its keys must be there."""
    try:
        MaterialFile.model_validate(table)
        problems = []
    except ValidationError as error:
        problems = problems_of(error, MaterialFile)
    given = table.get("clay")
    if isinstance(given, dict):
        fields = ((info.alias or name, info.description) for name, info in Clay.model_fields.items())
        problems += [
            Problem("missing", f"clay.{key} is missing", key=f"clay.{key}", hint=f"{key}: {text}")
            for key, text in fields
            if key not in given
        ]
    return problems


def _about(name: str, problem: Problem) -> Problem:
    """The same problem, its message naming the material it was found in."""
    return replace(problem, message=f"material {name}: {problem.message}")
