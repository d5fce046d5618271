"""Sect. 4: the controller on the circle (35), forces within their windows. Figs. 13 and 14."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdhr_host.control import Gains, Plan, Prescribed, Seen
from cdhr_host.mechanism import trajectories
from cdhr_host.plant.bodies import Bodies, BodiesState, Build, Forces
from cdhr_host.plant.noise import normal
from cdhr_host.plant.strands import Strands
from cdhr_host.profile import Profile
from cdhr_host.report.paper.items import Cell, Item, Panel, Study, known
from cdhr_host.units import MM
from cdhr_host.values import Array

STEADY: Final = Build(inertia_across=1e9, inertia_about=1e9)
"""a platform that does not turn, however its pairs pull"""
NAMES: Final = ("x", "y", "z")
UP: Final = np.array([0.0, 0.0, 1.0] * 2)


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
    aside: float = 0.0
    """m the start is beside the circle, in z"""
    seed: int = 1
    """of the noise"""
    seconds: float = 10.0


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


def followed(profile: Profile, loop: Loop) -> Followed:
    """The circle (35), started on it with its velocity, both platforms under control."""
    t: Array = np.arange(round(loop.seconds / loop.period) + 1, dtype=np.float64) * loop.period
    q, v, a = (np.hstack([part, part]) for part in (trajectories.eq35(t, order) for order in range(3)))
    bodies = Bodies(profile, Strands.from_profile(profile), STEADY)
    controller = Prescribed(profile, loop.gains)
    state, memory = _started(q[0] + loop.aside * UP, v[0]), controller.start()
    steps = max(1, round(loop.period / loop.inner))
    heard: list[Seen] = []
    error, tension, saturated = np.empty((len(t) - 1, 3)), np.empty((len(t) - 1, 6)), 0
    for n in range(len(t) - 1):
        heard = [*heard, _seen(state, loop.noise * normal(loop.seed, 0, n, 6))][-1 - loop.delay :]
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
    """x, y, z, mm: a number, least and greatest as ``a..b``, or ``-``"""
    others: tuple[Loop, ...] = ()
    """the same but for what the study leaves open; the tolerance is how far they come out from ours"""
    thorough: bool = False
    """takes long"""


def _starts(loop: Loop) -> tuple[Loop, ...]:
    """Hard switching makes the motion chaotic: 10 nm at the start may change the digits."""
    return tuple(replace(loop, aside=nm * 1e-9) for nm in (-20, -10, 10, 20, 30))


def _noises(loop: Loop) -> tuple[Loop, ...]:
    return tuple(replace(loop, seed=seed) for seed in range(2, 7))


def _rates(loop: Loop) -> tuple[Loop, ...]:
    """Sample periods and pose of the Jacobian: the study gives neither."""
    poses = loop.gains, replace(loop.gains, at_plan=True)
    fast = (replace(loop, gains=gains, period=period) for gains in poses for period in (2e-3, 5e-3))
    return *fast, *(replace(loop, gains=gains, period=1 / 60, seconds=30.0) for gains in poses)


HARD: Final = 0.0
EXACT: Final = 0.05
"""of the study's number, where nothing is left open; its last digit comes on top"""
PLAIN: Final = "0.259 0.228 0.264"
OPTIMISED: Final = "0.040 0.047 0.001"
SMALL: Final = Loop(Gains(reach=0.43, layer=HARD), 2e-3)
WINDUP: Final = Loop(Gains(reach=10.0, layer=HARD))
NO_WINDUP: Final = Loop(Gains(reach=10.0, layer=HARD, auxiliary=False))
NOISY: Final = Loop(Gains(), 1 / 60, 0.05 * MM)
WEIGHTED: Final = Loop(Gains(reach=0.43, layer=HARD, weight=30.0), 2e-3)
WITHOUT: Final = (
    Reading("eta 10 mm/s², 1 kHz", Loop(Gains(reach=0.01, layer=HARD)), "0.0005 - -"),
    Reading("eta 10 mm/s², 60 Hz", Loop(Gains(reach=0.01, layer=HARD), 1 / 60), "0.0077 - -"),
    Reading("eta 430 mm/s², 2 ms", SMALL, "0.07 0.07 0.17", _starts(SMALL)),
    Reading(
        "eta 460 mm/s², 2 ms",
        Loop(Gains(reach=0.46, layer=HARD), 2e-3),
        "0.15..0.30 0.16..0.26 0.24..0.50",
    ),
    Reading(
        "eta 10 m/s², auxiliary system, 1 ms", WINDUP, "14 22 37", (*_starts(WINDUP), *_rates(WINDUP)), True
    ),
    Reading(
        "eta 10 m/s², no auxiliary system, 5 ms",
        replace(NO_WINDUP, period=5e-3),
        "0.235 0.328 0.292",
        _starts(replace(NO_WINDUP, period=5e-3)),
    ),
    Reading("boundary layer, 60 Hz, 0.05 mm of noise", NOISY, "0.19 0.22 0.24", _noises(NOISY)),
)
WITH: Final = (
    Reading("boundary layer, 1 kHz, no optimisation", Loop(Gains()), "0.0005 0.0005 0.0000"),
    Reading("boundary layer, 60 Hz, no optimisation", Loop(Gains(), 1 / 60), "0.0085 0.0085 0.0000"),
    Reading(
        "eta 10 m/s², no auxiliary system, 1 ms, no optimisation",
        NO_WINDUP,
        "0.044 0.037 0.058",
        _starts(NO_WINDUP),
        True,
    ),
    Reading(
        "eta 430 mm/s², 2 ms, optimised inside the windows, W = diag(1, 1, 30)",
        WEIGHTED,
        "0.5 0.9 0.036",
        _starts(WEIGHTED),
        True,
    ),
    Reading(
        "eta 350 mm/s², 0.2 ms, vertical acceleration restored, windows violated",
        Loop(Gains(reach=0.35, layer=HARD, vertical=True), 2e-4, inner=2e-4),
        "0.045 0.078 0.003",
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
        apart = _apart(study, reading, run)
        for name, paper, ours, said, open_ in zip(
            NAMES, printed.split(), run.worst.tolist(), reading.study.split(), apart.tolist(), strict=True
        ):
            found.append(Cell(name, paper, ours, "mm", _told(reading), *_compared(said, open_)))
        off = run.error / MM
        panels.append(Panel(reading.text, "mm", run.t, dict(zip(NAMES, off.T, strict=True))))
    return Item(title, tuple(found), why, tuple(panels[:3]))


def _apart(study: Study, reading: Reading, run: Followed) -> Array:
    """(3,) mm: the furthest that what the study leaves open takes the errors from ours."""
    others = [followed(study.profiles["paper-simulation"], other).worst for other in reading.others]
    return np.asarray(np.abs(np.array([run.worst, *others]) - run.worst).max(axis=0))


def _told(reading: Reading) -> str:
    count = len(reading.others)
    return reading.text + (f"; tolerance by {count} runs that differ in what is left open" if count else "")


def _compared(said: str, apart: float) -> tuple[float | None, float]:
    """The study's number, or the middle of its range, and the tolerance."""
    least, _, greatest = said.partition("..")
    if not greatest:
        return known(said, apart, 0.0 if apart else EXACT)
    middle, half = 0.5 * (float(least) + float(greatest)), 0.5 * (float(greatest) - float(least))
    return middle, half
