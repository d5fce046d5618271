"""Clay identified from simulated weighings and steps: how often the truth lies within three sigma.

python benchmarks/clay_fit.py           100 draws of each clay, 20 of the steps
python benchmarks/clay_fit.py --smoke   two of each
"""

import argparse

import numpy as np
from scipy import stats

from cdhr_host.extrusion import bores, flow_law
from cdhr_host.extrusion.identify import Weighings, identify_flow
from cdhr_host.extrusion.identify_delays import StepRecord, identify_delays
from cdhr_host.pipeline import open_profile
from cdhr_host.plant.clay import Clay, Paste
from cdhr_host.profile import material_names

NOISE = 0.03
"""of a weighing, beside 0.3 mm³/s"""
SCALE = 1e-5
"""kg of noise of the scale, read 20 times a second"""
FLOWS = np.array([1.0, 3, 10, 30, 75, 150, 300, 450, 600, 900]) * 1e-9
PERIOD = 2e-3


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="little input")
    smoke = parser.parse_args().smoke
    beyond = 100 * 2 * stats.t.sf(3.0, len(FLOWS) - 3)
    print(
        f"Ten weighings, {100 * NOISE:g} % of noise; Student's t leaves {beyond:.1f} % beyond three sigma.\n"
    )
    print("| clay | parameter | true | rms error | median sigma | within 3 sigma | within 95 % |")
    print("|---|---|---|---|---|---|---|")
    for name in material_names():
        weighed(name, 2 if smoke else 100)
    print("\nTwelve steps at three pressures, 0.01 g of noise.\n")
    print("| clay | delay | true, ms | rms error | median sigma | within 3 sigma | within 95 % |")
    print("|---|---|---|---|---|---|---|")
    stepped("stoneware", 2 if smoke else 20)


def weighed(name: str, draws: int) -> None:
    """Rows of one clay's flow curve."""
    machine = open_profile("paper", name)
    law, clay = flow_law(machine.extruder, machine.clay), machine.clay
    pressure = law.pressure(FLOWS)
    fits = []
    for seed in range(draws):
        draw = np.random.default_rng(seed).standard_normal((2, len(FLOWS)))
        flow = np.maximum(FLOWS * (1 + NOISE * draw[0]) + 0.3e-9 * draw[1], 0.0)
        fits.append(identify_flow(Weighings(pressure, flow), bores(machine.extruder)).fit)
    truth = np.array([clay.yield_stress, clay.consistency, clay.index])
    rows(name, ("yield stress, Pa", "consistency, Pa sⁿ", "index"), truth, fits, 1.0)


def stepped(name: str, draws: int) -> None:
    """Rows of one clay's delays, the plant's clay being the one that is weighed."""
    machine = open_profile("paper", name)
    law, clay, lag = flow_law(machine.extruder, machine.clay), machine.clay, machine.drives.regulator_lag
    levels = law.pressure(FLOWS[[3, 6, 9]])
    spans = [span for k in range(12) for span in ((0.0, 1.0), (levels[k % 3], 2.0))]
    command = np.concatenate([np.full(round(t / PERIOD), p) for p, t in [*spans, (0.0, 1.5)]])
    plant = Clay(Paste(law, lag, clay.line_lag, clay.open_dead, clay.close_dead), PERIOD)
    _, _, flow = plant.step(plant.standing(), np.arange(len(command)), command)
    mass = clay.density * PERIOD * np.concatenate(([0.0], np.cumsum(flow)[:-1]))[::25]
    t = PERIOD * np.arange(len(command))[::25]
    fits = []
    for seed in range(draws):
        noise = SCALE * np.random.default_rng(seed).standard_normal(len(t))
        fits.append(identify_delays(StepRecord(t, command[::25], mass + noise), law, clay.density, lag).fit)
    truth = np.array([clay.open_dead, clay.close_dead, clay.line_lag])
    rows(name, ("open dead", "close dead", "line lag"), truth, fits, 1e-3)


def rows(name: str, words: tuple[str, ...], truth: np.ndarray, fits: list, unit: float) -> None:
    """One row a parameter."""
    error = np.array([fit.value[: len(truth)] - truth for fit in fits])
    sigma = np.array([fit.sigma[: len(truth)] for fit in fits])
    inside = (np.abs(error) < 3 * sigma).mean(axis=0), (np.abs(error) < fits[0].quantile * sigma).mean(axis=0)
    for i, word in enumerate(words):
        rms, typical = np.sqrt(np.mean(error[:, i] ** 2)) / unit, np.median(sigma[:, i]) / unit
        print(
            f"| {name} | {word} | {truth[i] / unit:.4g} | {rms:.2g} | {typical:.2g} "
            f"| {inside[0][i]:.0%} | {inside[1][i]:.0%} |"
        )


if __name__ == "__main__":
    main()
