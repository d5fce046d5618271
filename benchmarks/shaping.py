"""Input shaping on the simulated machine: what still rings after a corner.

    python benchmarks/shaping.py [--figure docs/shaping.png]

The nozzle drives a right angle on the rigid-body plant (``plant/bodies.py``: elastic cables, both
platforms, the spring). Two modes ring sideways, the upper platform's at 14.3 Hz and the lower one's
at 18.1 Hz; each shaper is made for the frequency of FREQUENCIES at which it leaves least. Vibration
is half the greatest swing across the leg that follows the corner, after the last motion planned
across it.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Final, Literal

import numpy as np
from paths import machine

from cdhr_host.mechanism import Cables, lengths, slider
from cdhr_host.motion.planner import Planner, all_tracks
from cdhr_host.motion.sampling import Timeline
from cdhr_host.motion.shaping import UNSHAPED, Kind, Shaper, shaper
from cdhr_host.pipeline import open_profile
from cdhr_host.plant.bodies import Bodies, BodiesState, Wound
from cdhr_host.plant.strands import Strands
from cdhr_host.values import Array, Moves

STEP = 2.5e-4
"""s, of the plant and of the sliders' setpoints"""
LEGS = 0.02, 0.06
"""m, before and after the corner"""
SPEED = 0.06
"""m/s"""
NAMES: Final[tuple[Kind, ...]] = ("zv", "mzv", "ei")
FREQUENCIES = (14.0, 15.0, 16.0, 17.0, 18.0)
"""Hz"""
DAMPING = 0.025
"""of these modes on the plant"""
STILL = 1e-9
"""m, less is no motion"""


@dataclass(frozen=True, slots=True)
class Ringing:
    """What a shaper leaves."""

    shaper: Literal["none", "zv", "mzv", "ei"]
    frequency_hz: float
    """it is made for"""
    vibration_um: float
    left: float
    """of the vibration without shaper"""
    longer_ms: float
    leaves_path_um: float


@cache
def bodies() -> tuple[Bodies, Cables]:
    """The machine."""
    profile = open_profile("paper-wide")
    return Bodies(profile, Strands.from_profile(profile)), Cables.from_profile(profile)


def corner(shaped: Shaper) -> tuple[Array, Array]:
    """(N, 3) m where the plan has the nozzle, and (N, 3) m where the plant has it, every STEP."""
    plant, cables = bodies()
    _, limits = machine("paper-wide")
    points = np.array([[0, 0, 0], [LEGS[0], 0, 0], [LEGS[0], LEGS[1], 0]], dtype=float)
    two = np.ones(2)
    moves = Moves(np.array([1, 2]), points[0], points[1:], SPEED * two, 0 * two, 0 * two)
    timeline = Timeline(STEP, shaped)
    tracks = list(all_tracks(Planner(limits, points[0]), timeline, [moves]))
    q = np.concatenate([track.position_G for track in tracks])
    rows = slider(cables, lengths(cables, q, q))
    rates = np.gradient(rows, STEP, axis=0)
    return q, driven(plant, [plant.wound(*pair) for pair in zip(rows.tolist(), rates.tolist(), strict=True)])


def driven(plant: Bodies, commands: Sequence[Wound]) -> Array:
    """(N, 3) m: the lower platform's way under sliders that follow their setpoints."""
    state, seen = BodiesState(), np.empty((len(commands), 3))
    for k, command in enumerate(commands):
        state = plant.step(state, command, STEP)
        seen[k] = state.lower
    return seen


def ringing(planned: Array, seen: Array) -> Array:
    """(N,) m across the second leg, from the time on that nothing is planned across it any more.

    What changes slowly there is how far the cables give under their own forces.
    """
    across = planned[:, 0]
    begin = int(np.flatnonzero(np.abs(across - across[-1]) > STILL)[-1]) + 2
    end = int(np.flatnonzero(np.abs(np.diff(planned[:, 1], n=2)) > STILL * STEP)[-1])
    off = (seen - planned)[begin:end, 0]
    place = np.linspace(-1.0, 1.0, len(off))
    return np.asarray(off - np.polyval(np.polyfit(place, off, 3), place))


def vibration(shaped: Shaper) -> float:
    """m: half the greatest swing."""
    return float(np.ptp(ringing(*corner(shaped))) / 2)


def table() -> list[Ringing]:
    """Every shaper, at the frequency at which it leaves least."""
    _, limits = machine("paper-wide")
    whole = vibration(UNSHAPED)
    found = [Ringing("none", 0.0, whole * 1e6, 1.0, 0.0, 0.0)]
    for name in NAMES:
        left, frequency = min((vibration(shaper(name, each, DAMPING)), each) for each in FREQUENCIES)
        shaped = shaper(name, frequency, DAMPING)
        away = shaped.deviation(limits.acceleration)
        found.append(Ringing(name, frequency, left * 1e6, left / whole, shaped.length * 1e3, away * 1e6))
    return found


def figure(path: Path) -> None:
    """What rings after the corner, without and with each shaper."""
    from matplotlib import pyplot  # noqa: PLC0415 -- only the figure needs it

    drawn, axes = pyplot.subplots(figsize=(7.0, 3.2), layout="constrained")
    for each in table():
        shaped = UNSHAPED if each.shaper == "none" else shaper(each.shaper, each.frequency_hz, DAMPING)
        swing = ringing(*corner(shaped))
        axes.plot(STEP * np.arange(len(swing)), swing * 1e6, lw=1.0, label=each.shaper)
    axes.set(xlabel="s after the corner", ylabel="nozzle across the leg, µm", xlim=(0.0, 0.6))
    axes.legend(frameon=False)
    drawn.savefig(path, dpi=120, metadata={"Software": None})


def main() -> None:
    """Print the table, or one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--figure", type=Path, help="draw what rings into a PNG")
    parser.add_argument("--smoke", action="store_true", help="the same: it takes seconds")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    found = table()
    if options.json:
        print(json.dumps([asdict(each) for each in found]))
    else:
        print("| shaper | made for Hz | vibration µm | left | longer by ms | leaves the path by at most µm |")
        print("|---|---|---|---|---|---|")
        for each in found:
            left = f"{each.vibration_um:.2f} | {each.left:.1%}"
            price = f"{each.longer_ms:.0f} | {each.leaves_path_um:.0f}"
            print(f"| {each.shaper} | {each.frequency_hz or '–'} | {left} | {price} |")
    if options.figure is not None:
        figure(options.figure)


if __name__ == "__main__":
    main()
