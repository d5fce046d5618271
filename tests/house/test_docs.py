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
SHOWN = re.compile(r"^```(?!python)\w*\n(.*?)^```|^((?: {4}.*\n)+)", re.DOTALL | re.MULTILINE)
"""every block that is not Python"""
COMMAND = re.compile(r"(?:\$ )?((?:cdhr|dask|curl|python3?|pip|prusa-slicer|CuraEngine|xset|systemctl) .*)")
LONG = "minutes of CPU: tests/report/test_reproduce.py tries its items"
SLICER = "needs a slicer and a part: tests/shipped/test_slicers.py makes one and runs it"
ELSEWHERE = {
    "cdhr jog": "a screen: tests/cli/test_jog_terminal.py",
    "cdhr jog --drives slcan:/dev/ttyACM0@1000000 --profile mine.toml": "a screen and a real adapter: "
    "tests/cli/test_jog_terminal.py takes a simulated one",
    "cdhr calibrate clay cups.csv steps.csv --plot fit.png --write my-stoneware": "needs a weighed run: "
    "tests/cli/test_calibrate_clay.py simulates one",
    "cdhr reproduce": LONG,
    "cdhr reproduce --table 2": LONG,
    "cdhr reproduce --quick": LONG,
    "prusa-slicer --load profiles/slicers/paper-wide.ini --center 0,0 --export-gcode -o pot.gcode "
    "pot.stl": SLICER,
    "CuraEngine slice -j profiles/slicers/cdhr_paper_wide.def.json -o pot.gcode -e0 -l pot.stl": SLICER,
    "cdhr dry-run pot.gcode --profile paper-wide": SLICER,
    "python3 -m venv .venv && . .venv/bin/activate && python3 -m pip install .": "what .ci/run begins with",
}
"""commands that a page shows and this test does not run, and why"""
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
    shim.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m cdhr_host "$@"\n')
    shim.chmod(0o755)
    (at / "gcode").symlink_to(ROOT / "gcode")
    steps = (f"{{ {command}\n}} > {tools}/{i}.out 2>&1" for i, command in enumerate(commands))
    script = "\n".join(("trap 'kill $(jobs -p) 2> /dev/null; wait' EXIT", *steps))
    home = {"HOME": str(tools), "XDG_STATE_HOME": str(tools / "state"), "PYTHONPATH": str(ROOT)}
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


def commands() -> list[str]:
    """Every command that any page shows, without its comment."""
    texts = ("".join(block) for page in PAGES for block in SHOWN.findall(page.read_text(encoding="utf-8")))
    found = (COMMAND.match(line.strip()) for text in texts for line in text.splitlines())
    return [re.sub(r" +#.*", "", match[1]) for match in found if match]


def test_every_command_of_every_page_is_run_or_says_where_it_is() -> None:
    run = {command for page in PAGES for command, _ in examples(page)}
    left = {command for command in commands() if not any(whole.startswith(command) for whole in run)}
    assert left == set(ELSEWHERE)
    tests = re.findall(r"tests/[\w/]+\.py", " ".join(ELSEWHERE.values()))
    assert all((ROOT / test).is_file() for test in tests)


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
