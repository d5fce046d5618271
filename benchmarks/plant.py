"""The simulated rig with all its effects on, against real time: CPU time of this process on one core.

python benchmarks/plant.py
"""

import argparse
import time
from dataclasses import replace

import numpy as np

from cdhr_host.mechanism import Cables, lengths, slider, trajectories
from cdhr_host.pipeline import open_profile
from cdhr_host.plant.bodies import Build
from cdhr_host.plant.faults import PAPER, Faults
from cdhr_host.plant.rig import Rig, RigState

TICKS = 100
"""short runs, of which the quickest counts: a shared machine disturbs the longer ones"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=60)
    parser.add_argument("--smoke", action="store_true", help="few runs")
    options = parser.parse_args()
    profile = open_profile("paper")
    cables, period = Cables.from_profile(profile), profile.drives.period
    q = trajectories.eq15(np.arange(1, TICKS + 1) * period)
    rows = slider(cables, lengths(cables, q, q)).tolist()
    budget = replace(PAPER, encoder=1e-6, force=0.05, sensor_delay=2)
    build = Build(friction=0.02, mass_height=0.01)
    for name, rigid in (("elastic, all effects", False), ("rigid cables", True)):
        rig = Rig(profile, Faults.drawn(1, budget), build=build, rigid=rigid)
        taken = sorted(cpu(rig, rows) for _ in range(3 if options.smoke else options.runs))
        best, median = (TICKS * period / t for t in (taken[0], taken[len(taken) // 2]))
        print(f"{name:<24} {best:6.0f} times real time, median of {len(taken)} runs {median:.0f}")


def cpu(rig: Rig, rows: list[list[float]]) -> float:
    """s for one run along the rows, every tick sensed."""
    before, state = time.process_time(), RigState()
    for row in rows:
        state = rig.step(state, row)
        rig.sensed(state)
    return time.process_time() - before


if __name__ == "__main__":
    main()
