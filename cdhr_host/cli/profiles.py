"""``cdhr profile``: which machines are known, what they are, whether a file is one."""

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdhr_host.cli.options import Json, MaterialName, examples
from cdhr_host.cli.refusals import Refusal, about, emit

if TYPE_CHECKING:
    from cdhr_host.profile import MaterialFile, Profile

Sections = dict[str, list[tuple[str, Any, str]]]
"""section -> its keys with their values and descriptions"""

app = typer.Typer(
    help="List, show and check machine and material profiles.",
    epilog=examples(
        "cdhr profile list",
        "cdhr profile show paper > mine.toml",
        "cdhr profile show stoneware > my-clay.toml",
        "cdhr profile check mine.toml",
    ),
    no_args_is_help=True,
)
Name = Annotated[
    str, typer.Argument(metavar="P", help="Name of an installed machine or material profile, or a path.")
]


@app.command("list", epilog=examples("cdhr profile list", "cdhr profile list --json"))
def list_(json_: Json = False) -> None:
    """The installed profiles: machines, then materials."""
    from cdhr_host.pipeline import open_profile
    from cdhr_host.profile import material_names, profile_names, read_material

    machines = [(name, open_profile(name).machine, path) for name, path in sorted(profile_names().items())]
    clays = [(name, read_material(name).clay, path) for name, path in sorted(material_names().items())]
    if json_:
        found = [{"name": n, "machine": m.name, "source": m.source, "path": str(p)} for n, m, p in machines]
        pastes = [
            {"name": n, "clay": c.name, "source": c.source, "example": c.example, "path": str(p)}
            for n, c, p in clays
        ]
        emit(json.dumps({"profiles": found, "materials": pastes}))
        return
    rows = [(name, machine.name, path) for name, machine, path in machines]
    rows += [(name, f"{clay.name}{' (an example)' * clay.example}", path) for name, clay, path in clays]
    width = max(len(name) for name, _, _ in rows)
    for name, title, path in rows:
        emit(f"{name:<{width}}  {title}\n{'':<{width}}  {path}")


@app.command(epilog=examples("cdhr profile show paper", "cdhr profile show paper > mine.toml"))
def show(name: Name = "paper", material: MaterialName = None, json_: Json = False) -> None:
    """Every value of a profile with its unit: a valid profile in itself."""
    with about(name):
        sections = _grouped(_opened(name, material))
    if json_:
        emit(json.dumps({part: {key: value for key, value, _ in rows} for part, rows in sections.items()}))
        return
    for line in _written(sections):
        emit(line)


@app.command(epilog=examples("cdhr profile check mine.toml", "cdhr profile check"))
def check(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[P]...", help="Names or paths; without any, the installed ones."),
    ] = None,
) -> None:
    """Read profiles and list everything wrong with them; exit code 3 when there is anything."""
    from cdhr_host.errors import ProfileError
    from cdhr_host.profile import material_names, profile_names

    refusals = []
    for name in names or [*profile_names(), *material_names()]:
        try:
            with about(name):
                verdict = _verdict(_opened(name))
            emit(f"{name}: ok: {verdict}")
        except Refusal as refusal:
            refusals.append(str(refusal))
    if refusals:
        raise Refusal("\n".join(refusals), ProfileError.exit_code)


def toml_lines(profile: "Profile | MaterialFile") -> Iterator[str]:
    """A profile as the lines of its file."""
    return _written(_grouped(profile))


def _written(sections: "Sections") -> Iterator[str]:
    for part, rows in sections.items():
        yield f"[{part}]"
        for key, value, text in rows:
            assignment = f"{key} = {_toml(value)}"
            yield f"{assignment:<42} # {text}" if text else assignment
        yield ""


def _toml(value: Any) -> str:
    """A value as TOML writes it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml(key)} = {_toml(each)}" for key, each in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False)


def _opened(name: str, material: str | None = None) -> "Profile | MaterialFile":
    """A machine or a material, whichever the name or the file is."""
    from cdhr_host.pipeline import open_profile
    from cdhr_host.profile import is_material, read_material

    if material is None and is_material(name):
        return read_material(name)
    return open_profile(name, material)


def _verdict(profile: "Profile | MaterialFile") -> str:
    """What a sound profile is."""
    from cdhr_host.drives.canopen.load import bus_share
    from cdhr_host.profile import MaterialFile

    if isinstance(profile, MaterialFile):
        return profile.clay.name
    return f"{profile.machine.name}; CAN bus {bus_share(profile):.0%} full at worst"


def _grouped(profile: "Profile | MaterialFile") -> "Sections":
    """Section -> (key with unit, value in that unit, description)."""
    from cdhr_host.profile import described

    found: Sections = {}
    for section, key, value, text in described(profile):
        found.setdefault(section, []).append((key, value, text))
    return found
