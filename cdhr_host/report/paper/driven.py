"""Sect. 3.3 and 3.4: nine forces prescribed, nothing fed back. Figs. 7, 8, 10 and 11."""

from dataclasses import dataclass
from math import asin, atan2

import numpy as np

from cdhr_host.mechanism import Cables, Loads, tensions, trajectories
from cdhr_host.mechanism.kinematics import components
from cdhr_host.mechanism.pairs import Pairs, shares
from cdhr_host.mechanism.pulley import PULLEYS, Pulley, SwivelWrap, Vector
from cdhr_host.mechanism.statics import spring_force
from cdhr_host.plant.bodies import Bodies, BodiesState, Build, Forces
from cdhr_host.plant.strands import Strands
from cdhr_host.plant.turning import Turn
from cdhr_host.profile import Profile
from cdhr_host.report.paper.items import Cell, Item, Panel, Study, cells
from cdhr_host.report.paper.spools import worst_with_spools
from cdhr_host.units import MM
from cdhr_host.values import Array

LEVEL = Build(inertia_across=1e3, inertia_about=1e3)
"""a platform that hardly turns: the paper's model of three translations"""
NAMES = "x y z"
TURNS = "roll pitch yaw"
EXACT = 0.02
"""of the study's number, beyond its last digit: forces held in steps"""
HELD_STEP, FINE_STEP = 1e-3, 1e-2
"""s: forces held that long; steps of forces that are taken at their middle"""


class PrintedWrap(SwivelWrap):
    """The paper's mixture: theta of a swivelling pulley, direction in the fixed plane. Eq. (3)-(7)."""

    def __init__(  # noqa: PLR0917 -- the order of Pulley
        self, x: Array, y: Array, z: Array, sign: Array | float, radius: float, azimuth: Array | float
    ) -> None:
        super().__init__(x, y, z, sign, radius, azimuth)
        self._line = x, y, z
        self._turn, self._r = azimuth, radius

    def direction(self) -> Vector:
        """BC over L of Eq. (8), AC in the plane of ``azimuth`` (typing errors of Eq. (6) corrected)."""
        (x, y, z), sine, cosine = self._line, np.sin(self.angle()), np.cos(self.angle())
        x, y = x - self._r * sine * np.cos(self._turn), y - self._r * sine * np.sin(self._turn)
        size = self._groove.line
        return x / size, y / size, (z + self._sign * self._r * cosine) / size


@dataclass(frozen=True, slots=True)
class Drive:
    """How a run is set up."""

    plan: Pulley
    """model behind the forces"""
    plant: str = "swivel"
    """model of the simulated pulleys"""
    build: Build = LEVEL
    alike: bool = False
    """both cables of a pair pull alike, whatever the moments"""
    held: float | None = None
    """s the forces are held; None for continuous ones"""
    seconds: float = 200.0


@dataclass(frozen=True, slots=True)
class Run:
    """What came of it."""

    t: Array
    lower: Array
    """(N, 3) m"""
    upper: Array
    turn: Array
    """(N, 3) rad: roll, pitch, yaw"""
    plan: Array
    """(N, 3) m of both platforms"""

    @property
    def worst(self) -> Array:
        """(3,) mm: greatest error of the nozzle platform."""
        return np.asarray(np.abs(self.lower - self.plan).max(axis=0) / MM)

    @property
    def most_turned(self) -> Array:
        """(3,) rad."""
        return np.asarray(np.abs(self.turn).max(axis=0))


def driven(profile: Profile, drive: Drive) -> Run:
    """Forces of Eq. (12), shared by Eq. (14), into the rigid bodies along Eq. (15)."""
    dt = drive.held or FINE_STEP
    start: Array = np.arange(round(drive.seconds / dt), dtype=np.float64) * dt
    at = start if drive.held else start + 0.5 * dt
    nine = _forces(profile, drive, trajectories.eq15(at), trajectories.eq15(at, 2))
    bodies = Bodies(profile, Strands.from_profile(profile, drive.plant), drive.build)
    state = BodiesState()
    lower, upper, turn = [], [], []
    for row in nine.tolist():
        state = bodies.step(state, Forces(row), dt)
        lower.append(state.lower)
        upper.append(state.upper)
        turn.append(roll_pitch_yaw(state.turn))
    t = start + dt
    return Run(t, np.array(lower), np.array(upper), np.array(turn), trajectories.eq15(t))


def _forces(profile: Profile, drive: Drive, q: Array, acceleration: Array) -> Array:
    """(N, 9) N."""
    cables, loads = Cables.from_profile(profile).with_pulley(drive.plan), Loads.from_profile(profile)
    six = tensions(cables, loads, q, q, acceleration, acceleration)
    if drive.alike:
        return np.hstack([0.5 * six[:, :3], 0.5 * six[:, :3], six[:, 3:]])
    shared = shares(cables, Pairs.from_profile(profile), q, six[:, :3])
    return np.hstack([shared.left, shared.right, six[:, 3:]])


def roll_pitch_yaw(turn: Turn) -> tuple[float, float, float]:
    """rad about x, then y, then z of W."""
    w, x, y, z = turn
    return (
        atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        asin(2.0 * (w * y - z * x)),
        atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


READINGS = (
    ("1.213 1.228 16.514", Drive(PULLEYS["point"]), "1.554 1.239 13.12", "not compensated, swivel", 0.01),
    (
        "1.213 1.228 16.514",
        Drive(PULLEYS["point"], "fixed-plane"),
        "2.00 1.69 13.1",
        "not compensated, fixed-plane",
        0.01,
    ),
    (
        "0.003 0.005 0.035",
        Drive(PrintedWrap, "fixed-plane", held=HELD_STEP),
        "0.0118 0.0085 0.0085",
        "forces by the paper's mixture of pulleys, fixed-plane",
        EXACT,
    ),
    (
        "0.003 0.005 0.035",
        Drive(PrintedWrap, held=HELD_STEP),
        "0.58 0.57 0.02",
        "forces by the paper's mixture of pulleys, swivel",
        EXACT,
    ),
)
"""printed, set-up, study, reading, tolerance as a share"""
SPOOLS = ((0.01, "1.54 1.23 13.1"), (1.0, "1.25 1.03 13.1"))
"""kg, study"""


def errors(study: Study) -> Item:
    """Fig. 7: errors of the platform under prescribed forces."""
    profile = study.profiles["paper-simulation"]
    held = driven(profile, Drive(PULLEYS["swivel"], held=HELD_STEP))
    found = _close(
        held.worst, "0.003 0.005 0.035", "0.0044 0.0046 0.0008", "compensated, forces held 1 ms", EXACT
    )
    panels = [_error_panel("compensated, forces held 1 ms", held)]
    for printed, drive, expected, reading, share in READINGS if study.thorough else READINGS[:3]:
        run = driven(profile, drive)
        found += _close(run.worst, printed, expected, reading, share)
        panels.append(_error_panel(reading, run))
    for spool, expected in SPOOLS if study.thorough else ():
        reading = f"not compensated, swivel, spools of I/r² = {spool:g} kg with Eq. (16) fed forward"
        found += _close(worst_with_spools(profile, spool), "1.213 1.228 16.514", expected, reading, 0.015)
    why = (
        "Nothing accumulates: the platform swings, undamped, at 0.65 to 0.80 Hz about a static offset. Our "
        "uncompensated z is 21 % lower than printed, the compensated z 0.035 is not reached by any reading; "
        "3 to 5 um in x and y need plan and simulated pulleys of the same kind."
    )
    return Item(
        "Fig. 7, Sect. 3.3: nozzle platform along Eq. (15), forces prescribed", found, why, (*panels[:2],)
    )


def spring(study: Study) -> Item:
    """Fig. 8: force of the spring under prescribed forces without compensation."""
    profile = study.profiles["paper-simulation"]
    run = driven(profile, Drive(PULLEYS["point"]))
    rows = slice(0, len(run.t))
    parts = spring_force(
        Loads.from_profile(profile), components(run.lower, rows), components(run.upper, rows)
    )
    size = np.sqrt(sum(part * part for part in parts))
    found = cells(
        "least greatest",
        "- -",
        np.array([size.min(), size.max()]),
        "29.87 30.53",
        unit="N",
        reading="not compensated, swivel",
        tolerance=0.03,
    )
    why = "Agrees in kind: the force fluctuates about 30 N; the text gives no numbers."
    return Item(
        "Fig. 8, Sect. 3.3: force of the spring along Eq. (15), forces prescribed",
        found,
        why,
        (Panel("spring without compensation", "N", run.t, {"size": size}),),
    )


def undistributed(study: Study) -> Item:
    """Fig. 10: both cables of a pair pull alike."""
    run = driven(study.profiles["paper-simulation"], Drive(PULLEYS["swivel"], build=Build(), alike=True))
    found = _close(
        run.worst, "19.361 19.041 9.682", "1.736 1.561 0.561", "f/2 each, six degrees of freedom", 0.01
    )
    found += _turned(run, "0.360 0.373 0.455", "0.271 0.268 0.020", 0.01)
    for height, expected, turns in ((0.01, "5 5 -", "0.34 0.34 -"), (0.02, "11 11 -", "0.44 0.44 -")):
        high = driven(
            study.profiles["paper-simulation"],
            Drive(PULLEYS["swivel"], build=Build(mass_height=height), alike=True),
        )
        reading = f"f/2 each, centre of mass {height / MM:g} mm above the attachments"
        printed = "19.361 19.041 9.682", "0.360 0.373 0.455"
        found += cells(NAMES, printed[0], high.worst, expected, unit="mm", reading=reading, tolerance=0.5)
        found += cells(
            TURNS, printed[1], high.most_turned, turns, unit="rad", reading=reading, tolerance=0.01
        )
    why = (
        "Not reproduced beyond the order of the turns. It depends on heights the paper does not give: with "
        "the centre of mass 10 to 20 mm above the attachments 5 to 11 mm and 0.34 to 0.44 rad come out."
    )
    return Item(
        "Fig. 10, Sect. 3.4: pairs that pull alike, along Eq. (15)",
        found,
        why,
        (
            _error_panel("f/2 each", run),
            Panel("turn", "rad", run.t, dict(zip(TURNS.split(), run.turn.T, strict=True))),
        ),
    )


def distributed(study: Study) -> Item:
    """Fig. 11: forces shared by Eq. (14)."""
    found: tuple[Cell, ...] = ()
    panels = []
    studies = ((HELD_STEP, "0.0044 0.0046 0.0008"), (2.0 * HELD_STEP, "0.009 0.009 0.002"))
    for held, expected in studies:
        run = driven(study.profiles["paper-simulation"], Drive(PULLEYS["swivel"], build=Build(), held=held))
        reading = f"shared by Eq. (14), forces held {held * 1e3:g} ms"
        found += _close(run.worst, "0.010 0.012 0.035", expected, reading, EXACT)
        found += _turned(run, "0.001 0.001 0.001", "0 0 0", 0.0)
        panels.append(_error_panel(reading, run))
    why = (
        "x and y follow from how long the forces are held; z is not reached by any reading. The printed "
        "turns are upper bounds (much below 0.001 rad)."
    )
    return Item("Fig. 11, Sect. 3.4: forces shared by Eq. (14), along Eq. (15)", found, why, tuple(panels))


def _close(worst: Array, printed: str, expected: str, reading: str, share: float) -> tuple[Cell, ...]:
    """Errors within a share of the study's, and half its last digit."""
    found: list[Cell] = []
    for name, paper, ours, study in zip(
        NAMES.split(), printed.split(), worst.tolist(), expected.split(), strict=True
    ):
        digit = 0.5 * 10.0 ** -len(study.split(".")[1])
        found.append(Cell(name, paper, ours, "mm", reading, float(study), share * float(study) + digit))
    return tuple(found)


def _turned(run: Run, printed: str, expected: str, share: float) -> tuple[Cell, ...]:
    wanted = max(float(word) for word in expected.split())
    return cells(
        TURNS,
        printed,
        run.most_turned,
        expected,
        unit="rad",
        reading="greatest angle about x, y, z",
        tolerance=share * wanted + (5e-4 if share else 1e-6),
    )


def _error_panel(title: str, run: Run) -> Panel:
    off = (run.lower - run.plan) / MM
    return Panel(title, "mm", run.t, dict(zip(NAMES.split(), off.T, strict=True)))
