"""The plan of the house: every module has a floor, every library one door."""

import subprocess
import sys
import tomllib

import pytest
from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports
from looking import PACKAGE, ROOT, dotted, imports, modules

PLAN = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
FLOORS = next(contract for contract in PLAN["contracts"] if contract["id"] == "floors")["layers"]
PURE = next(contract for contract in PLAN["contracts"] if contract["id"] == "pure")


def test_every_module_has_a_floor() -> None:
    planned = {name.strip(" ()") for floor in FLOORS for name in floor.split("|")}
    built = {path.stem for path in PACKAGE.glob("*.py") if path.stem != "__init__"}
    built |= {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert built <= planned


def test_folders_with_modules_are_packages() -> None:
    bare = {path.parent for path in modules() if not (path.parent / "__init__.py").exists()}
    assert not bare


def test_pure_rooms_are_all_named_in_the_contract() -> None:
    shell = {"cli", "console", "report", "serve", "job", "drives", "profile", "data", "__pycache__"}
    rooms = {
        f"cdhr_host.{path.name}" for path in PACKAGE.iterdir() if path.is_dir() and path.name not in shell
    }
    assert rooms <= set(PURE["source_modules"])


def test_the_contracts_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True) == EXIT_STATUS_SUCCESS


def test_ruckig_has_one_door() -> None:
    doors = [dotted(path) for path in modules() if "ruckig" in imports(path)]
    assert len(doors) <= 1
    assert all(door.startswith("cdhr_host.motion.") for door in doors)


@pytest.mark.parametrize(
    ("library", "rooms"),
    [
        ("typer", {"cli"}),
        ("rich", {"cli", "console"}),
        ("pyarrow", {"report"}),
        ("pydantic", {"profile"}),
        ("serial", {"drives"}),
        ("can", {"drives"}),
        ("canopen", {"drives"}),
    ],
)
def test_a_library_comes_in_by_its_door(library: str, rooms: set[str]) -> None:
    users = {dotted(path).split(".")[1] for path in modules() if library in imports(path)}
    assert users <= rooms


def test_command_line_starts_without_the_heavy_libraries() -> None:
    """Importing the command line must not import what only its commands need."""
    heavy = ("numpy", "scipy", "pyarrow", "pydantic", "rich", "ruckig", "can", "canopen", "serial")
    code = f"import sys, cdhr_host.cli; print([name for name in {heavy!r} if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
