"""From the start of a print, the file being proven, to its first setpoints: CPU seconds in one process.

    python benchmarks/start.py [FILE]

Without a file, a generated one of 500 000 lines.
"""

import argparse
import tempfile
from pathlib import Path
from time import process_time

from programs import spiral_pot

from cdhr_host.cli.source import Source
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.checked import Checked
from cdhr_host.pipeline.rig import Rig


def first(file: Path, rig: Rig) -> tuple[float, float]:
    """CPU seconds to the first setpoint, and to the first at which the nozzle moves."""
    began, ready = process_time(), None
    staircase = Staircase(rig.profile, rig=rig)
    for step in staircase.walk(Source(str(file)).chunks()):
        if not isinstance(step, Checked) or not len(step.setpoints):
            continue
        ready = ready or process_time() - began
        if step.track.velocity.any():
            return ready, process_time() - began
    raise ValueError(f"{file} moves nothing")


def main() -> None:
    """Measure one file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("--profile", default="paper-wide")
    parser.add_argument("--smoke", action="store_true", help="a small file")
    options = parser.parse_args()
    rig = Rig.from_profile(open_profile(options.profile))
    with tempfile.TemporaryDirectory() as folder:
        file = options.file or spiral_pot(Path(folder) / "pot.gcode", 4_000 if options.smoke else 500_000)
        ready, moving = first(file, rig)
    print(
        f"{file.name}: first setpoint after {ready:.3f} s, first that moves the nozzle after {moving:.3f} s"
    )


if __name__ == "__main__":
    main()
