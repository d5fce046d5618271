"""Every benchmark of this folder in turn.

python benchmarks/run.py --smoke     each on little input, to see that it still runs
"""

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FOLDER = Path(__file__).parent
HELPERS = {
    "run",
    "measure",
    "programs",
    "paths",
    "yardstick",
    "bound",
    "dense",
    "trapezoids",
    "laid",
    "hosts",
    "far_side",
}
BY_HAND = {"chaos_drives"}
"""needs an idle machine and an hour; its cases are tests (tests/drives/test_processes.py)"""


REAL_TIME = {"drives", "serve", "slicer_print", "soak", "start"}
"""need the processors for themselves"""


def ran(script: Path) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """A short run of one, and what it says."""
    command = [sys.executable, str(script), "--smoke"]
    return script, subprocess.run(
        command, check=False, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )


def smoke(scripts: list[Path]) -> Iterator[tuple[Path, int]]:
    """Short runs, several at a time where no clock matters; each script and its exit code."""
    for alone in (False, True):
        turn = [path for path in scripts if (path.stem in REAL_TIME) is alone]
        with ThreadPoolExecutor(1 if alone else os.cpu_count()) as pool:
            for script, done in pool.map(ran, turn):
                print(f"\n== {script.name}\n{done.stdout}", end="", flush=True)
                yield script, done.returncode


def whole(scripts: list[Path]) -> Iterator[tuple[Path, int]]:
    """One after the other; each script and its exit code."""
    for script in scripts:
        print(f"\n== {script.name}", flush=True)
        yield script, subprocess.run([sys.executable, str(script)], check=False).returncode


def main() -> None:
    """Run them; exit 1 when one fails, after all have run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="little input")
    run = smoke if parser.parse_args().smoke else whole
    scripts = sorted(path for path in FOLDER.glob("*.py") if path.stem not in HELPERS | BY_HAND)
    failed = [script.name for script, code in run(scripts) if code]
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
