"""Every benchmark of this folder in turn.

python benchmarks/run.py --smoke     each on little input, to see that it still runs
"""

import argparse
import subprocess
import sys
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


def main() -> None:
    """Run them; exit 1 when one fails, after all have run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="little input")
    arguments = ["--smoke"] if parser.parse_args().smoke else []
    failed = []
    for script in sorted(path for path in FOLDER.glob("*.py") if path.stem not in HELPERS | BY_HAND):
        print(f"\n== {script.name}", flush=True)
        if subprocess.run([sys.executable, str(script), *arguments], check=False).returncode:
            failed.append(script.name)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
