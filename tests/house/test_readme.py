"""README says what is true: its commands, its example's output, its links."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from looking import ROOT
from typer.testing import CliRunner

from cdhr_host.cli.app import app

README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def examples() -> Iterator[tuple[str, str]]:
    """(command, output) of the console blocks."""
    for block in re.findall(r"```console\n(.*?)```", README, re.DOTALL):
        for part in block.split("$ ")[1:]:
            command, _, output = part.partition("\n")
            yield command, output


def steady(output: str) -> str:
    """Output without what rounding decides: where an extreme is met twice, and errors near zero."""
    return re.sub(r"\d\.\d\de-1\d", "tiny", re.sub(r"\(line \d+\)", "(line)", output)).strip()


def test_the_example_prints_what_readme_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gcode").symlink_to(ROOT / "gcode")
    monkeypatch.chdir(tmp_path)
    code = 0
    for command, shown in examples():
        if command == "echo $?":
            assert shown.strip() == str(code)
            continue
        result = CliRunner().invoke(app, shlex.split(command)[1:])
        code = result.exit_code
        assert steady(result.stderr + result.stdout) == steady(shown), command


def test_the_first_commands_name_what_is_there() -> None:
    main, tests = re.findall(r"^python3 -m pip install .*$", README, re.MULTILINE)
    program = re.search(r"&& cdhr stream (\S+) --speed 20$", main)
    assert program is not None
    assert (ROOT / program[1]).is_file()
    assert tests == "python3 -m pip install '.[test]' && python3 -m pytest"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8"))
    assert not [link for link in links if "://" not in link and not (page.parent / link).exists()]
