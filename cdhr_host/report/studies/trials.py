"""What the studies do over and over: one simulated machine measured, one set of faults, one slice."""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cdhr_host.mechanism import Cables, Workspace, lengths, slider
from cdhr_host.mechanism.calibration import Points, calibrate
from cdhr_host.mechanism.calibration_model import SIZE, Doubts, Frame, nozzle, predicted
from cdhr_host.profile import Profile
from cdhr_host.samples import LAWS
from cdhr_host.values import Array

ASIDE: Final = 200
"""places of a trial that are not measured"""
SPOTS: Final = 400
"""places of a trajectory that are looked at"""
GROUPS: Final = ("pulley", "attachment", "offset", "radius")


@dataclass(frozen=True, slots=True)
class Trial:
    """A machine drawn from the doubts by its seed, measured at these sliders."""

    seed: int
    cables: Cables
    doubts: Doubts
    slider: Array
    """(N, 3) m of sliders 1-3"""
    aside: Array
    """(M, 3) m: where the result is judged"""
    noise: float
    """m, standard deviation of a measured coordinate"""


class Tried(NamedTuple):
    """What came of a trial."""

    off: tuple[float, ...]
    """parameters less the truth, in their standard deviations; nothing for known ones"""
    before: float
    """m, rms of the distance at the places aside, by the drawing"""
    after: float
    """m, the same by the calibration"""
    worst: float
    """m, greatest distance there after calibration"""
    doubt: float
    """m, greatest standard deviation the calibration gives itself there"""


def measured(trial: Trial) -> tuple[Array, Array]:
    """(P,) m, (N, 3) m: the machine drawn, and what is measured of its nozzle."""
    draws = np.random.Generator(np.random.Philox(key=trial.seed))
    truth = trial.doubts.each() * draws.standard_normal(SIZE)
    noise = trial.noise * draws.standard_normal((len(trial.slider), 3))
    return truth, predicted(trial.cables, Frame.same(), truth, trial.slider) + noise


def tried(trial: Trial) -> Tried:
    """Draw the machine, measure it, calibrate, compare with the truth."""
    truth, place = measured(trial)
    same = Frame.same()
    found = calibrate(trial.cables, Points(trial.slider, place), trial.doubts, noise=trial.noise)
    free = trial.doubts.each() > 0.0
    off = (found.parameters - truth)[free] / found.deviation[free]
    true = predicted(trial.cables, same, truth, trial.aside)
    first = np.linalg.norm(true - predicted(trial.cables, same, 0.0 * truth, trial.aside), axis=1)
    last = np.linalg.norm(true - found.predicted(trial.aside), axis=1)
    return Tried(
        tuple(off.tolist()),
        float(np.sqrt(np.mean(first**2))),
        float(np.sqrt(np.mean(last**2))),
        float(last.max()),
        float(found.nozzle_doubt(trial.aside).max()),
    )


@dataclass(frozen=True, slots=True)
class Fault:
    """One machine with one kind of fault, on a trajectory of the paper."""

    seed: int
    cables: Cables
    group: str
    size: float
    """m, standard deviation"""
    equation: str


def strayed(fault: Fault) -> float:
    """M: greatest distance of the nozzle from the path when the sliders are planned by the drawing."""
    law = LAWS[fault.equation]
    q = law.position(law.times(law.duration / SPOTS))
    run = slider(fault.cables, lengths(fault.cables, q, q))[:, :3]
    only = Doubts(**{name: fault.size if name == fault.group else 0.0 for name in GROUPS})
    draws = np.random.Generator(np.random.Philox(key=fault.seed))
    reached = nozzle(fault.cables, only.each() * draws.standard_normal(SIZE), run)
    return float(np.linalg.norm(reached - q, axis=1).max())


@dataclass(frozen=True, slots=True)
class Slice:
    """A level slice of the machine's space."""

    profile: Profile
    height: float
    """m above the reference pose"""
    radius: float
    step: float


def margins(at: Slice) -> Array:
    """(K, K): smallest normalised force margin on a square grid, -1 where a limit is broken; row by y."""
    line = grid_line(at.radius, at.step)
    x, y = np.meshgrid(line, line)
    q = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, at.height)])
    space = Workspace.from_profile(at.profile)
    found = np.where(space.within_limits(q), np.maximum(space.margin(q), -1.0), -1.0)
    return np.asarray(np.where(np.hypot(q[:, 0], q[:, 1]) <= at.radius + 1e-9, found, -1.0).reshape(x.shape))


def grid_line(radius: float, step: float) -> Array:
    """(K,) m: from -radius to radius, 0 among them."""
    count = int(np.floor(radius / step + 1e-9))
    return step * np.arange(-count, count + 1, dtype=np.float64)
