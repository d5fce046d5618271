"""Find and read profiles: by installed name or by path, every problem of a file at once."""

import difflib
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from cdhr_host.errors import Problem, ProfileError
from cdhr_host.profile.schema import Profile
from cdhr_host.units import split_unit

MAX_BYTES = 1 << 20
"""A profile is a page of text; anything larger is not one."""


def profile_folder() -> Path:
    """Where installed profiles live: package data, or the repository's folder in a checkout."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "data" / "profiles"
    return installed if installed.is_dir() else package.parent / "profiles"


def profile_names() -> dict[str, Path]:
    """Installed profiles by name."""
    return {path.stem: path for path in sorted(profile_folder().glob("*.toml"))}


def find(name_or_path: str) -> Path:
    """The file of a profile; raises ProfileError with the nearest known name."""
    return find_among(profile_names(), name_or_path, "profile")


def find_among(names: dict[str, Path], name_or_path: str, kind: str) -> Path:
    """The file of an installed name, or that path; raises ProfileError with the nearest name."""
    if name_or_path in names:
        return names[name_or_path]
    path = Path(name_or_path)
    if path.is_file():
        return path
    near = difflib.get_close_matches(name_or_path, names, n=1, cutoff=0.4)
    hint = f"did you mean '{near[0]}'?" if near else "give one of these, or the path of a .toml file"
    known = ", ".join(names)
    raise ProfileError(Problem("missing", f"no {kind} '{name_or_path}'; installed are: {known}", hint=hint))


def read_table(path: Path) -> dict[str, Any]:
    """The TOML table of a file; raises ProfileError when it cannot be read or is not TOML."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ProfileError(
                Problem("malformed", f"{path} is larger than {MAX_BYTES} bytes: not a profile")
            )
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ProfileError(Problem("missing", f"cannot read {path}: {error.strerror}")) from error
    except UnicodeDecodeError as error:
        raise ProfileError(Problem("malformed", f"{path} is not UTF-8 text: not a profile")) from error
    except tomllib.TOMLDecodeError as error:
        raise ProfileError(
            Problem(
                "malformed", f"{path} is not valid TOML: {error}", hint="keys are written name_unit = number"
            )
        ) from error


def validate(table: dict[str, Any]) -> tuple[Profile, list[Problem]]:
    """Table -> (Profile, problems).

    Where a value is bad, the profile carries the one of ``paper`` in its place, so that what
    does not depend on it can still be checked; such a profile must never leave the caller
    while there are problems.
    """
    try:
        return Profile.model_validate(table), []
    except ValidationError as error:
        details = error.errors(include_url=False)
        problems = problems_of(error, Profile)
    return Profile.model_validate(_mended(table, details)), problems


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Every finding about a file of this model's sections, in the words of its author."""
    return [_problem(detail, model) for detail in error.errors(include_url=False)]


def _mended(table: dict[str, Any], details: list[ErrorDetails]) -> dict[str, Any]:
    """The table with every bad key dropped or replaced by the one of ``paper``."""
    sound = read_table(profile_folder() / "paper.toml")
    bad = {".".join(map(str, detail["loc"])) for detail in details}
    mended: dict[str, Any] = {}
    for section, keys in sound.items():
        given = table.get(section, {})
        given = given if isinstance(given, dict) else {}
        mended[section] = {
            key: given[key] if key in given and f"{section}.{key}" not in bad else value
            for key, value in keys.items()
        }
    return mended


def _problem(detail: ErrorDetails, model: type[BaseModel]) -> Problem:
    """One pydantic finding in the words of a profile's author."""
    place = ".".join(map(str, detail["loc"]))
    kind, value = detail["type"], detail["input"]
    shown = value if isinstance(value, (int, float, str)) and not isinstance(value, bool) else None
    if kind == "extra_forbidden":
        return Problem(
            "unknown", f"unknown key {place}", key=place, value=shown, hint=_nearest(detail["loc"], model)
        )
    if kind == "missing":
        return Problem("missing", f"{place} is missing", key=place, hint=_meaning(detail["loc"], model))
    limit = next(iter(detail.get("ctx", {}).values()), None)
    message = detail["msg"][0].lower() + detail["msg"][1:]
    return Problem(
        "range" if limit is not None else "type",
        f"{place} = {value!r}: {message.replace('input ', '')}",
        key=place,
        value=shown,
        limit=limit if isinstance(limit, (int, float)) else str(limit) if limit is not None else None,
        unit=_unit(str(detail["loc"][-1])),
        hint=_meaning(detail["loc"], model),
    )


def _unit(key: str) -> str | None:
    name, _ = split_unit(key)
    return key.removeprefix(name).strip("_") or None


def _section_keys(section: str, model: type[BaseModel]) -> dict[str, str]:
    """Keys of a section as the file spells them -> their descriptions."""
    field = model.model_fields.get(section)
    if field is None or not isinstance(field.annotation, type) or not issubclass(field.annotation, BaseModel):
        return {}
    return {
        info.alias or name: info.description or "" for name, info in field.annotation.model_fields.items()
    }


def _nearest(loc: tuple[int | str, ...], model: type[BaseModel]) -> str:
    known = list(model.model_fields) if len(loc) == 1 else list(_section_keys(str(loc[0]), model))
    near = difflib.get_close_matches(str(loc[-1]), known, n=1, cutoff=0.5)
    return f"did you mean '{near[0]}'?" if near else f"known here: {', '.join(known)}"


def _meaning(loc: tuple[int | str, ...], model: type[BaseModel]) -> str | None:
    if len(loc) < 2:
        return "a profile needs this section; copy it from an installed profile (cdhr profile list)"
    text = _section_keys(str(loc[0]), model).get(str(loc[1]))
    return f"{loc[1]}: {text}" if text else None


def described(profile: BaseModel) -> Iterator[tuple[str, str, float | int | str, str]]:
    """Rows (section, key with unit, value in that unit, description) of a machine or a material."""
    for section in type(profile).model_fields:
        values = getattr(profile, section)
        for name, info in type(values).model_fields.items():
            shown = info.alias or name
            value = getattr(values, name)
            if isinstance(value, float):
                value = float(f"{value / split_unit(shown)[1]:.12g}")
            yield section, shown, value, info.description or ""
