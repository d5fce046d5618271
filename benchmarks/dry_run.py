"""A dry run of a long file: times real time, and memory that does not grow with the file.

python benchmarks/dry_run.py [--lines 100000] [--runs 3]
"""

import argparse
import json
import tempfile
from pathlib import Path

from measure import Cost, cdhr, median_cost
from programs import spiral_pot


def dry_run(lines: int, runs: int, folder: Path) -> tuple[Cost, float]:
    """Cost of a dry run of so many lines, and how much motion it is, s."""
    program = spiral_pot(folder / f"pot{lines}.gcode", lines)
    found = median_cost(cdhr("dry-run", str(program), "--profile", "paper-wide", "--json"), runs)
    return found, float(json.loads(found.output)["duration_s"])


def main() -> None:
    """Measure the file and one a quarter as long."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lines", type=int, default=100_000)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--smoke", action="store_true", help="a small file, once")
    options = parser.parse_args()
    if options.smoke:
        options.lines, options.runs = 4_000, 1
    print("| lines | motion | CPU | times real time | µs per line | peak memory |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for lines in (options.lines // 4, options.lines):
            used, motion = dry_run(lines, options.runs, Path(folder))
            print(
                f"| {lines} | {motion:.0f} s | {used.cpu_s:.2f} s | {motion / used.cpu_s:.0f} "
                f"| {used.cpu_s / lines * 1e6:.1f} | {used.peak_mb:.0f} MB |"
            )


if __name__ == "__main__":
    main()
