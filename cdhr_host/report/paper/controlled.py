"""Sect. 4: the controller on the circle (35), forces within their windows. Figs. 13 and 14."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.control import Gains, Plan, Prescribed, Seen
from cdhr_host.mechanism import trajectories
from cdhr_host.plant.bodies import Bodies, BodiesState, Build, Forces
from cdhr_host.plant.noise import normal
from cdhr_host.plant.strands import Strands
from cdhr_host.profile import Profile
from cdhr_host.report.paper.items import Cell, Item, Panel, Study
from cdhr_host.units import MM
from cdhr_host.values import Array

STEADY: Final = Build(inertia_across=1e9, inertia_about=1e9)
"""a platform that does not turn, however its pairs pull"""
NAMES: Final = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class Loop:
    """How a run is set up."""

    gains: Gains
    period: float = 1e-3
    """s between two control steps"""
    noise: float = 0.0
    """m of the measured positions"""
    delay: int = 0
    """control steps a measurement is old"""
    inner: float = 1e-3
    """s the plant is stepped by at most"""


@dataclass(frozen=True, slots=True)
class Followed:
    """What came of it, after each control step."""

    t: Array
    error: Array
    """(N, 3) m of the nozzle platform"""
    tension: Array
    """(N, 6) N"""
    saturated: int
    """control steps with a cable at its bound"""

    @property
    def worst(self) -> Array:
        """(3,) mm."""
        return np.asarray(np.abs(self.error).max(axis=0) / MM)


def followed(profile: Profile, loop: Loop, seconds: float = 10.0) -> Followed:
    """The circle (35), started on it with its velocity, both platforms under control."""
    t: Array = np.arange(round(seconds / loop.period) + 1, dtype=np.float64) * loop.period
    q, v, a = (np.hstack([part, part]) for part in (trajectories.eq35(t, order) for order in range(3)))
    bodies = Bodies(profile, Strands.from_profile(profile), STEADY)
    controller = Prescribed(profile, loop.gains)
    state, memory = _started(q[0], v[0]), controller.start()
    steps = max(1, round(loop.period / loop.inner))
    heard: list[Seen] = []
    error, tension, saturated = np.empty((len(t) - 1, 3)), np.empty((len(t) - 1, 6)), 0
    for n in range(len(t) - 1):
        heard = [*heard, _seen(state, loop.noise * normal(1, 0, n, 6))][-1 - loop.delay :]
        memory, action = controller.step(memory, Plan(float(t[n]), q[n], v[n], a[n]), heard[0], loop.period)
        assert action.tension is not None
        tension[n] = action.tension
        saturated += controller.at_bound(action.tension)
        force = action.tension.tolist()
        nine = [0.5 * pull for pull in force[:3]] * 2 + force[3:]
        for _ in range(steps):
            state = bodies.step(state, Forces(nine), loop.period / steps)
        error[n] = np.array(state.lower) - q[n + 1, :3]
    return Followed(t[1:], error, tension, saturated)


def _started(position: Array, velocity: Array) -> BodiesState:
    (x, y, z), (vx, vy, vz) = position[:3].tolist(), velocity[:3].tolist()
    return BodiesState(lower=(x, y, z), upper=(x, y, z), velocity=(vx, vy, vz), upper_velocity=(vx, vy, vz))


def _seen(state: BodiesState, noise: Array) -> Seen:
    position = np.array([*state.lower, *state.upper]) + noise
    return Seen(position, np.array([*state.velocity, *state.upper_velocity]))


@dataclass(frozen=True, slots=True)
class Reading:
    """A way to read Sect. 4, and what the study found with it."""

    text: str
    loop: Loop
    study: str
    tolerance: float
    """as a share of the study's number (of ranges their middle), and half its last digit; wide where
    switching makes the motion chaotic"""
    thorough: bool = False
    """takes long"""


HARD: Final = 0.0
PLAIN: Final = "0.259 0.228 0.264"
OPTIMISED: Final = "0.040 0.047 0.001"
WITHOUT: Final = (
    Reading("eta 10 mm/s², 1 kHz", Loop(Gains(reach=0.01, layer=HARD)), "0.0005 - -", 0.1),
    Reading("eta 10 mm/s², 60 Hz", Loop(Gains(reach=0.01, layer=HARD), 1 / 60), "0.0077 - -", 0.1),
    Reading("eta 430 mm/s², 2 ms", Loop(Gains(reach=0.43, layer=HARD), 2e-3), "0.07 0.07 0.17", 0.35),
    Reading("eta 460 mm/s², 2 ms", Loop(Gains(reach=0.46, layer=HARD), 2e-3), "0.225 0.21 0.37", 0.4),
    Reading("eta 10 m/s², auxiliary system, 1 ms", Loop(Gains(reach=10.0, layer=HARD)), "14 22 37", 0.6),
    Reading(
        "eta 10 m/s², no auxiliary system, 5 ms",
        Loop(Gains(reach=10.0, layer=HARD, auxiliary=False), 5e-3),
        "0.235 0.328 0.292",
        0.1,
    ),
    Reading(
        "boundary layer, 60 Hz, 0.05 mm of noise", Loop(Gains(), 1 / 60, 0.05 * MM), "0.19 0.22 0.24", 0.35
    ),
)
WITH: Final = (
    Reading("boundary layer, 1 kHz, no optimisation", Loop(Gains()), "0.0005 0.0005 0.0000", 0.2),
    Reading("boundary layer, 60 Hz, no optimisation", Loop(Gains(), 1 / 60), "0.0085 0.0085 0.0000", 0.1),
    Reading(
        "eta 10 m/s², no auxiliary system, 1 ms, no optimisation",
        Loop(Gains(reach=10.0, layer=HARD, auxiliary=False)),
        "0.044 0.037 0.058",
        0.1,
    ),
    Reading(
        "eta 430 mm/s², 2 ms, optimised inside the windows, W = diag(1, 1, 30)",
        Loop(Gains(reach=0.43, layer=HARD, weight=30.0), 2e-3),
        "0.5 0.9 0.036",
        0.6,
    ),
    Reading(
        "eta 350 mm/s², 0.2 ms, vertical acceleration restored, windows violated",
        Loop(Gains(reach=0.35, layer=HARD, vertical=True), 2e-4, inner=2e-4),
        "0.045 0.078 0.003",
        0.2,
        thorough=True,
    ),
)


def without_optimisation(study: Study) -> Item:
    """Fig. 13: clipped forces."""
    why = (
        "The paper gives eta without a unit and no sample time. The printed errors are what hard switching "
        "leaves at eta of about 0.45 m/s² or at slow sampling: several readings give their size, none can be "
        "told from the others. eta 10 m/s², the literal SI reading, saturates all the time."
    )
    return _item(study, "Fig. 13, Sect. 4: controller on Eq. (35), forces clipped", WITHOUT, PLAIN, why)


def with_optimisation(study: Study) -> Item:
    """Fig. 14: the vertical kept."""
    why = (
        "z far below x, y is reproduced by restoring the vertical acceleration, which leaves the windows; "
        "inside them z is bought with x, y. No setting gives both columns of the paper. With a boundary "
        "layer and a feasible trajectory nothing saturates and nothing is there to optimise. The paper's z "
        "is an upper bound."
    )
    return _item(
        study, "Fig. 14, Sect. 4: controller on Eq. (35), with force optimisation", WITH, OPTIMISED, why
    )


def _item(study: Study, title: str, readings: tuple[Reading, ...], printed: str, why: str) -> Item:
    found: list[Cell] = []
    panels: list[Panel] = []
    for reading in readings:
        if reading.thorough and not study.thorough:
            continue
        run = followed(study.profiles["paper-simulation"], reading.loop)
        for name, paper, ours, wanted in zip(
            NAMES, printed.split(), run.worst.tolist(), reading.study.split(), strict=True
        ):
            known = None if wanted == "-" else float(wanted)
            tolerance = 0.0 if known is None else reading.tolerance * known + _last_digit(wanted)
            found.append(Cell(name, paper, ours, "mm", reading.text, known, tolerance))
        off = run.error / MM
        panels.append(Panel(reading.text, "mm", run.t, dict(zip(NAMES, off.T, strict=True))))
    return Item(title, tuple(found), why, tuple(panels[:3]))


def _last_digit(printed: str) -> float:
    """Half of it."""
    return 0.5 * 10.0 ** -len(printed.partition(".")[2])
