"""The documents say what is true: their examples give what they print, generated pages are as the code is."""

import doctest
import importlib.util
import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from looking import ROOT

DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
BLOCK = re.compile(r"^```console\n(.*?)^```", re.DOTALL | re.MULTILINE)
LIMIT = 400
"""s that a page's commands may take"""


def examples(page: Path) -> list[tuple[str, str]]:
    """(command, output) of the console blocks; a command ending in a backslash goes on."""
    found = []
    for block in BLOCK.findall(page.read_text(encoding="utf-8")):
        for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            whole = re.match(r"(?:.*\\\n)*.*\n?", part)
            assert whole is not None
            found.append((whole[0].strip(), part[whole.end() :]))
    return found


def session(commands: list[str], at: Path) -> list[str]:
    """What each command prints, both streams, run one after the other in one shell."""
    tools = at / "tools"
    tools.mkdir()
    shim = tools / "cdhr"
    shim.write_text(f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" -m cdhr_host "$@"\n')
    shim.chmod(0o755)
    (at / "gcode").symlink_to(ROOT / "gcode")
    steps = (f"{{ {command}\n}} > {tools}/{i}.out 2>&1" for i, command in enumerate(commands))
    script = "\n".join(("trap 'kill $(jobs -p) 2> /dev/null; wait' EXIT", *steps))
    home = {"HOME": str(tools), "XDG_STATE_HOME": str(tools / "state")}
    path = os.pathsep.join((str(tools), str(Path(sys.executable).parent), os.environ["PATH"]))
    shell = subprocess.Popen(
        ["bash", "-u", "-c", script],
        cwd=at,
        env={**os.environ, **home, "PATH": path, "NO_COLOR": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        shell.wait(LIMIT)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(shell.pid, signal.SIGKILL)
        shell.wait()
    return [(tools / f"{i}.out").read_text(encoding="utf-8") for i in range(len(commands))]


def agrees(printed: str, shown: str) -> bool:
    """Whether the output is as shown; ``...`` alone stands for any lines, in a line for any text."""
    lines = (
        r"(?:.*\n)*?" if line == "..." else re.escape(line).replace(r"\.\.\.", ".*") + r"\n"
        for line in shown.strip("\n").splitlines()
    )
    return re.fullmatch("".join(lines), printed.strip("\n") + "\n") is not None


@pytest.mark.parametrize("page", [page for page in PAGES if examples(page)], ids=lambda page: page.stem)
def test_commands_print_what_the_page_shows(page: Path, tmp_path: Path) -> None:
    wanted = examples(page)
    printed = session([command for command, _ in wanted], tmp_path)
    for (command, shown), got in zip(wanted, printed, strict=True):
        refused = any(line.startswith("cdhr: error") or "Traceback" in line for line in got.splitlines())
        if shown.strip():
            assert agrees(got, shown), f"$ {command}\n{got}"
        else:
            assert not refused, f"$ {command}\n{got}"


@pytest.mark.parametrize(
    "page", [page for page in PAGES if ">>> " in page.read_text(encoding="utf-8")], ids=lambda page: page.stem
)
def test_python_examples_give_what_the_page_shows(page: Path) -> None:
    failed, tried = doctest.testfile(str(page), module_relative=False)
    assert tried
    assert not failed


def test_generated_pages_are_as_the_code_is(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("reference", DOCS / "reference.py")
    assert spec is not None
    assert spec.loader is not None
    reference = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(reference)
    reference.main(tmp_path)
    for name in reference.PAGES:
        written = (DOCS / name).read_text(encoding="utf-8")
        assert written == (tmp_path / name).read_text(encoding="utf-8"), "run: python docs/reference.py"
