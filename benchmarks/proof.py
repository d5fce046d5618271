"""The whole-file proof, and the log at 1 kHz, against the yardstick Y of the same run.

    python benchmarks/proof.py FILE [--profile paper-wide] [--runs 3]

Y is the CPU time of the plain numpy evaluation of six cable lengths for as many setpoints as
the file has at 1 kHz (yardstick.py). All figures are CPU seconds of whole processes.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

from measure import Cost, cdhr, median_cost
from programs import spiral_pot

RATE_HZ = 1000
BESIDE = Path(__file__).parent


def row(name: str, used: Cost, yard: Cost, lines: int) -> str:
    """One line of the table."""
    return (
        f"| {name} | {used.cpu_s:.2f} s | {used.cpu_s / yard.cpu_s:.2f} Y "
        f"| {used.cpu_s / lines * 1e6:.1f} | {used.peak_mb:.0f} MB |"
    )


def report(program: Path, profile: str, runs: int, folder: Path) -> None:
    """Measure one file and print its table."""
    dry = ["dry-run", str(program), "--profile", profile, "--rate", str(RATE_HZ), "--json"]
    proof = median_cost(cdhr(*dry), runs)
    facts = json.loads(proof.output)
    setpoints = round(facts["duration_s"] * RATE_HZ)
    yard = median_cost([sys.executable, str(BESIDE / "yardstick.py"), str(setpoints)], runs)
    log = median_cost(cdhr(*dry, "--log", str(folder / "log.parquet"), "--compact"), runs)
    print(f"{program.name}: {facts['lines']} lines, {setpoints} setpoints, Y = {yard.cpu_s:.2f} s")
    print("| | CPU | of Y | µs per line | peak memory |")
    print("|---|---|---|---|---|")
    print(row("proof, no log", proof, yard, facts["lines"]))
    print(row("proof and compact log", log, yard, facts["lines"]))


def main() -> None:
    """Measure the file given, or a generated one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("--profile", default="paper-wide")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--smoke", action="store_true", help="a small file, once")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        program = options.file or spiral_pot(Path(folder) / "pot.gcode", 4_000 if options.smoke else 500_000)
        report(program, options.profile, 1 if options.smoke else options.runs, Path(folder))


if __name__ == "__main__":
    main()
