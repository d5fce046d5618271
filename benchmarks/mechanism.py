"""What the mechanism room costs: CPU time of this process on one core.

OPENBLAS_NUM_THREADS=1 python benchmarks/mechanism.py [POSES]
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from cdhr_host.mechanism import (
    Cables,
    Clearance,
    Give,
    Loads,
    Pairs,
    Policy,
    Workspace,
    affine_nine_tensions,
    cable_state,
    forward,
    lengths,
    nine_tensions,
    stretched_forward,
    tensions,
)
from cdhr_host.pipeline import open_profile

POSES = 1_000_000
REPEATS = 3


def cpu(work: Callable[[], object]) -> float:
    """s: least of a few runs."""
    times = []
    for _ in range(REPEATS):
        before = time.process_time()
        work()
        times.append(time.process_time() - before)
    return min(times)


def report(what: str, count: int, seconds: float) -> None:
    print(f"{what:<52}{count:>9} poses{seconds:9.3f} s{seconds / count * 1e6:10.3f} us/pose")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=POSES)
    parser.add_argument("--smoke", action="store_true", help="few poses")
    options = parser.parse_args()
    count = 20_000 if options.smoke else options.poses
    profile = open_profile("paper-wide")
    cables, loads, pairs = (
        Cables.from_profile(profile),
        Loads.from_profile(profile),
        Pairs.from_profile(profile),
    )
    before = time.process_time()
    policy = Policy.from_profile(profile, "free")
    print(f"fit of the policy free{time.process_time() - before:46.3f} s")
    turn = np.linspace(0.0, 1e-3 * count, count)
    q = np.column_stack([0.2 * np.cos(turn), 0.2 * np.sin(turn), 0.3 * np.arange(count) / count])
    v, a = 0.1 * q[:, [1, 0, 2]], 0.1 * q
    upper = policy.follow(q, v, a)
    report("six forces", count, cpu(lambda: tensions(cables, loads, q, upper.place, a, upper.acceleration)))
    report(
        "nine forces with distribution",
        count,
        cpu(lambda: nine_tensions(cables, loads, pairs, q, upper.place, a, upper.acceleration)),
    )
    report("lengths, rates, forces", count, cpu(lambda: cable_state(cables, loads, q, upper.place, v, a)))
    report("policy free with derivatives", count, cpu(lambda: policy.follow(q, v, a)))
    wanted = lengths(cables, q, upper.place)
    report("forward kinematics", count, cpu(lambda: forward(cables, wanted)))
    some = slice(0, count, 20)
    part, give = len(q[some]), Give.from_profile(profile)
    slider = wanted[some] - cables.reference_lengths
    report(
        "nine forces affine in acceleration",
        part,
        cpu(lambda: affine_nine_tensions(cables, loads, pairs, q[some], upper.place[some])),
    )
    report(
        "forward kinematics of stretched cables",
        part,
        cpu(lambda: stretched_forward(cables, loads, give, slider)),
    )
    space = Workspace.from_profile(profile, "free")
    report("all limits of a pose", part, cpu(lambda: space.feasible(q[some])))
    lines, clay = np.arange(part), np.ones(part, dtype=np.bool_)
    report(
        "clearance of cables over the print, samples 0.2 mm",
        part,
        cpu(lambda: Clearance.from_profile(profile).block(q[:part], lines, clay)),
    )


if __name__ == "__main__":
    main()
