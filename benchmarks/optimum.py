"""How near the planner is to the fastest motion along its own path.

    python benchmarks/optimum.py [FILE ...]     the small cases, the shipped programs, and FILEs

"bound" knows no jerk limit (bound.py): nothing is faster, and nothing with the jerk limit gets
near it where speed changes. "reference" keeps the jerk limit too (dense.py), on cases small
enough for a dense optimisation. Times are those of moving; standing is left out.
"""

import argparse
import json
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from bound import bound
from dense import reference
from paths import Run, machine, planned_runs, program_text, read, real_files, small_cases

SMOKE_CASES = ("square 20 mm, F60", "straight 4 mm, F50", "zigzag 60°, F60")
SMOKE_FILES = ("paper_eq35.gcode", "cura_tile_volumetric.gcode")


@dataclass(frozen=True, slots=True)
class Row:
    """One path; times in s."""

    name: str
    runs: int
    planned: float
    bound: float
    reference: float | None = None
    kept: bool = True
    """whether every reference converged, and kept the limits but for 1 % of time"""

    def cells(self) -> list[str]:
        """As a row of the table."""
        dense = ["–", "–"]
        if self.reference is not None:
            ratio = f"{self.planned / self.reference:.3f}" + ("" if self.kept else " (?)")
            dense = [f"{self.reference:.3f}", ratio]
        return [
            self.name,
            f"{self.planned:.3f}",
            *dense,
            f"{self.bound:.3f}",
            f"{self.planned / self.bound:.3f}",
        ]


def small_rows(only: Iterable[str] | None = None) -> Iterable[Row]:
    """The small cases, with the jerk-limited reference."""
    profile, limits = machine()
    for name, commands, start in small_cases(profile):
        if only is None or name in only:
            runs = planned_runs(commands, limits, start)
            found = [reference(run, limits) for run in runs]
            kept = all(each.converged and each.stretched < 1.01 for each in found)
            least = sum(bound(run, limits) for run in runs)
            yield Row(name, len(runs), _planned(runs), least, sum(each.duration for each in found), kept)


def file_rows(paths: Iterable[Path]) -> Iterable[Row]:
    """Whole programs, against the bound."""
    profile, limits = machine()
    for path in paths:
        runs = planned_runs(read(profile, program_text(path)), limits)
        yield Row(path.name, len(runs), _planned(runs), sum(bound(run, limits) for run in runs))


def _planned(runs: list[Run]) -> float:
    return sum(run.planned for run in runs)


def table(rows: Iterable[Row]) -> list[Row]:
    """Print rows as they come; progress is the table itself."""
    print("| path | planned s | reference s | ratio | bound s | ratio |\n|---|---|---|---|---|---|")
    done = []
    for row in rows:
        print("| " + " | ".join(row.cells()) + " |", flush=True)
        done.append(row)
    return done


def main() -> None:
    """Print the tables, or one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, help="further programs, plain or .gz")
    parser.add_argument("--smoke", action="store_true", help="a few cases")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    cases = SMOKE_CASES if options.smoke else None
    files = [path for path in real_files() if not options.smoke or path.name in SMOKE_FILES] + options.files
    if options.json:
        rows = []
        for row in [*small_rows(cases), *file_rows(files)]:
            print(row.name, file=sys.stderr)
            rows.append(asdict(row))
        print(json.dumps(rows))
        return
    small = table(small_rows(cases))
    worst = max(small, key=lambda row: row.planned / (row.reference or row.bound))
    print(f"\nworst of the small cases: {worst.name}, {worst.planned / (worst.reference or 1.0):.3f}\n")
    table(file_rows(files))


if __name__ == "__main__":
    main()
