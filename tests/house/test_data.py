"""The data folders: programs say what they are, profiles explain every key."""

import gzip
import tomllib
from pathlib import Path

import pytest
from looking import ROOT

PROGRAMS = sorted(path for path in (ROOT / "gcode").iterdir() if path.is_file())
PROFILES = sorted((ROOT / "profiles").glob("*.toml"))
MATERIALS = sorted((ROOT / "profiles" / "materials").glob("*.toml"))


def test_programs_are_data_only() -> None:
    assert not list((ROOT / "gcode").rglob("*.py"))
    assert not list((ROOT / "profiles").rglob("*.py"))
    assert {suffix for path in PROGRAMS for suffix in path.suffixes[:1]} <= {".gcode"}


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_first_line_of_a_program_says_what_it_is(path: Path) -> None:
    with gzip.open(path, "rb") if path.suffix == ".gz" else path.open("rb") as file:
        first = file.readline(400)
    assert first.startswith(b";")
    assert len(first.strip(b"; \r\n")) > 10


@pytest.mark.parametrize("path", PROFILES + MATERIALS, ids=lambda path: path.stem)
def test_every_key_of_a_profile_has_a_comment(path: Path) -> None:
    plain = {"name", "source"}
    bare = [
        line
        for line in path.read_text(encoding="utf-8").splitlines()
        if "=" in line
        and not line.startswith("#")
        and line.split("=")[0].strip() not in plain
        and "#" not in line
    ]
    assert bare == []


@pytest.mark.parametrize("path", PROFILES, ids=lambda path: path.stem)
def test_profiles_have_the_same_keys(path: Path) -> None:
    def keys(file: Path) -> set[str]:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
        return {f"{section}.{key}" for section, values in table.items() for key in values}

    assert keys(path) == keys(PROFILES[0])
