"""Paths to measure on: small drawn cases, excerpts, whole programs; as the planner's own runs."""

import gzip
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from cdhr_host.mechanism import direction_change_bound
from cdhr_host.motion.leg import Leg
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.smooth_path import SmoothPath
from cdhr_host.pipeline import open_profile
from cdhr_host.profile import Profile
from cdhr_host.program import Interpreter
from cdhr_host.values import Array, Command, Moves

GCODE = Path(__file__).parent.parent / "gcode"
CHUNK = 1 << 20
STANDSTILL = 1e-9
"""m/s below which the nozzle stands"""


def machine(name: str = "paper-wide") -> tuple[Profile, MotionLimits]:
    """A profile and the limits its planner works with."""
    profile = open_profile(name)
    return profile, MotionLimits.from_profile(profile, direction_change_bound(profile))


def real_files() -> list[Path]:
    """The programs of slicers, and the paper's, that the repository ships."""
    return sorted(GCODE.glob("*.gcode")) + sorted(GCODE.glob("*.gcode.gz"))


def program_text(path: Path) -> bytes:
    """A program, decompressed."""
    raw = path.read_bytes()
    return gzip.decompress(raw) if path.suffix == ".gz" else raw


def read(profile: Profile, text: bytes, at_G: Array | None = None) -> list[Command]:
    """Commands of a program that begins at ``at_G`` (3,) m."""
    chunks = [text[i : i + CHUNK] for i in range(0, len(text), CHUNK)]
    return list(Interpreter(profile, at_G=at_G).commands(chunks))


@dataclass(frozen=True, slots=True)
class Run:
    """What the planner does between two exact stops: K cubic pieces of path, and when it is where."""

    s: Array
    """(K+1,) m, borders of the pieces"""
    curve: Array
    """(4, K, 3) q, q', q'', q''' at the start of each piece"""
    feed: Array
    """(K,) m/s"""
    bent: Array
    """(K,) whether the path bends there"""
    planned: float
    """s"""
    when: Array
    """(N,) s, instants of the plan"""
    where: Array
    """(4, N) s, s', s'', s''' at them"""

    def at(self, s: Array, *, before: bool = False) -> tuple[Array, Array, Array, Array]:
        """(N,) m -> q, q', q'', q''' (N, 3) each; where pieces meet, of the one after or ``before``."""
        found = np.searchsorted(self.s, s, side="left" if before else "right")
        piece = np.clip(found - 1, 0, len(self.feed) - 1)
        x = (s - self.s[piece])[:, None]
        c0, c1, c2, c3 = self.curve[:, piece]
        return (
            c0 + x * (c1 + x * (c2 / 2 + x * (c3 / 6))),
            c1 + x * (c2 + x * (c3 / 2)),
            c2 + x * c3,
            c3,
        )

    def plan_at(self, t: Array) -> tuple[Array, Array, Array]:
        """(N,) s -> s, s', s'' of the plan."""
        k = np.clip(np.searchsorted(self.when, t, side="right") - 1, 0, len(self.when) - 1)
        x = t - self.when[k]
        s, v, a, j = self.where[:, k]
        return s + x * (v + x * (a / 2 + x * (j / 6))), v + x * (a + x * (j / 2)), a + x * j


def planned_runs(commands: Iterable[Command], limits: MotionLimits, at_G: Array | None = None) -> list[Run]:
    """The planner's runs of a program, in order."""
    planner = Planner(limits, np.zeros(3) if at_G is None else at_G)
    stretches = chain.from_iterable(planner.stretches(command) for command in commands)
    runs, legs = [], []
    for stretch in chain(stretches, planner.close()):
        if isinstance(stretch, Leg):
            legs.append(stretch)
            if _rests(stretch):
                runs.append(_joined(legs))
                legs = []
    assert not legs, "a program ends at rest"
    return runs


def _rests(leg: Leg) -> bool:
    """Whether the nozzle stands at the leg's end."""
    s, rate, _ = leg.law.at(np.array([leg.duration]))
    return bool(np.abs(leg.path.at(s)[2] * rate).max() < STANDSTILL)


def _joined(legs: list[Leg]) -> Run:
    """One run of the stretches it was committed in."""
    borders, curves, feeds, bent, when, where = [np.zeros(1)], [], [], [], [], []
    duration = 0.0
    for leg in legs:
        span = (float(leg.law.state[0, 0]), float(leg.law.at(np.array([leg.duration]))[0][0]))
        start, piece = _between(leg.path, span)
        shift = borders[-1][-1] - span[0]
        borders.append(np.append(start[1:], span[1]) + shift)
        curves.append(np.stack((*leg.path.at(start)[1:], leg.path.coefficients[3][:, piece].T)))
        feeds.append(leg.segments.feed[leg.path.segment[piece]])
        bent.append(leg.path.bending[piece] > 0)
        when.append(leg.law.t + duration)
        where.append(leg.law.state + np.array([shift, 0.0, 0.0, 0.0])[:, None])
        duration += leg.duration
    return Run(
        np.concatenate(borders),
        np.concatenate(curves, axis=1),
        np.concatenate(feeds),
        np.concatenate(bent),
        duration,
        np.concatenate(when),
        np.concatenate(where, axis=1),
    )


def _between(path: SmoothPath, span: tuple[float, float]) -> tuple[Array, Array]:
    """Starts (K,) and numbers (K,) of a path's pieces within a span, cut at its beginning."""
    ends = np.append(path.start[1:], path.end)
    piece = np.flatnonzero((ends > span[0] + 1e-12) & (path.start < span[1] - 1e-12))
    return np.maximum(path.start[piece], span[0]), piece


def drawn_program(points_mm: Array, feeds_mm_s: Array | float) -> bytes:
    """A program through points (N, 2), from (0, 0)."""
    feeds = np.broadcast_to(np.asarray(feeds_mm_s, dtype=float), (len(points_mm),))
    lines = [f"G1 X{x:.5f} Y{y:.5f} F{60 * f:.3f}" for (x, y), f in zip(points_mm, feeds, strict=True)]
    return ("G21\nG90\n" + "\n".join(lines) + "\n").encode()


def _polygon(corners: int, side_mm: float) -> Array:
    """A closed regular polygon from (0, 0), its first side along x."""
    angle = 2 * np.pi / corners * np.arange(corners)
    return np.cumsum(side_mm * np.column_stack((np.cos(angle), np.sin(angle))), axis=0)


def _zigzag(turn_deg: float, side_mm: float, sides: int) -> Array:
    """Legs that turn left and right in turn by the same angle."""
    heading = np.radians(turn_deg) * (np.arange(sides) % 2)
    return np.cumsum(side_mm * np.column_stack((np.cos(heading), np.sin(heading))), axis=0)


def _circle(radius_mm: float, chord_mm: float) -> Array:
    """A full turn of chords that starts after a straight lead-in along its tangent."""
    count = math.ceil(2 * math.pi * radius_mm / chord_mm)
    angle = 2 * math.pi * np.arange(count + 1) / count
    turn = radius_mm * np.column_stack((np.sin(angle), 1 - np.cos(angle)))
    return np.vstack((turn + np.array([5.0, 0.0]), [15.0, 0.0]))


def _spiral(turns: float, pitch_mm: float, chord_mm: float) -> Array:
    """An Archimedean spiral inwards to outwards, chords of about equal length."""
    angle, points = 0.5 * math.pi, []
    while angle < 2 * math.pi * turns:
        r = pitch_mm * angle / (2 * math.pi)
        points.append((r * math.cos(angle), r * math.sin(angle)))
        angle += chord_mm / math.hypot(r, pitch_mm / (2 * math.pi))
    return np.array(points)


def _hilbert(order: int, step_mm: float) -> Array:
    """A Hilbert curve by its L-system, from (0, 0)."""
    word = "A"
    for _ in range(order):
        word = "".join({"A": "+BF-AFA-FB+", "B": "-AF+BFB+FA-"}.get(c, c) for c in word)
    heading, at, points = 0, np.zeros(2), []
    for letter in word:
        heading += {"+": 1, "-": -1}.get(letter, 0)
        if letter == "F":
            at = at + step_mm * np.round([math.cos(heading * math.pi / 2), math.sin(heading * math.pi / 2)])
            points.append(at)
    return np.array(points)


def _noisy_line(length_mm: float, chord_mm: float, noise_mm: float) -> Array:
    """A line of chords, each point off by up to a noise."""
    x = np.arange(chord_mm, length_mm, chord_mm)
    return np.column_stack((x, np.random.default_rng(1).uniform(-noise_mm, noise_mm, len(x))))


SMALL: dict[str, Callable[[], bytes]] = {
    "straight 60 mm, F50": lambda: drawn_program(np.array([[60.0, 0.0]]), 50.0),
    "straight 4 mm, F50": lambda: drawn_program(np.array([[4.0, 0.0]]), 50.0),
    "straight, F 10-50-20-80": lambda: drawn_program(
        np.column_stack((np.arange(10.0, 90.0, 10.0), np.zeros(8))),
        np.array([10.0, 50.0, 20.0, 80.0, 10.0, 50.0, 20.0, 80.0]),
    ),
    "square 20 mm, F20": lambda: drawn_program(_polygon(4, 20.0), 20.0),
    "square 20 mm, F60": lambda: drawn_program(_polygon(4, 20.0), 60.0),
    "octagon 10 mm, F60": lambda: drawn_program(_polygon(8, 10.0), 60.0),
    "zigzag 20°, F60": lambda: drawn_program(_zigzag(20.0, 10.0, 6), 60.0),
    "zigzag 60°, F60": lambda: drawn_program(_zigzag(60.0, 10.0, 6), 60.0),
    "zigzag 120°, F60": lambda: drawn_program(_zigzag(120.0, 10.0, 6), 60.0),
    "zigzag 140°, 2 mm, F60": lambda: drawn_program(_zigzag(140.0, 2.0, 10), 60.0),
    "circle R10, chords 0.3 mm, F20": lambda: drawn_program(_circle(10.0, 0.3), 20.0),
    "circle R10, chords 0.3 mm, F90": lambda: drawn_program(_circle(10.0, 0.3), 90.0),
    "circle R10, chords 2 mm, F60": lambda: drawn_program(_circle(10.0, 2.0), 60.0),
    "spiral, chords 0.5 mm, F60": lambda: drawn_program(_spiral(3.0, 5.0, 0.5), 60.0),
    "Hilbert 3 mm, F40": lambda: drawn_program(_hilbert(2, 3.0), 40.0),
    "line, 0.5 mm chords, 0.05 mm noise, F40": lambda: drawn_program(_noisy_line(20.0, 0.5, 0.05), 40.0),
}
"""Small programs by name; each starts at program (0, 0, 0)."""

EXCERPTS = {
    "cura_tile_volumetric.gcode": (30, 50),
    "prusa_vase_spiral_relE.gcode": (1000, 1040),
    "fullcontrol_nonplanar_generic_relE.gcode": (800, 830),
    "prusa_tile_infill_volE.gcode": (100, 116),
    "paper_eq15.gcode": (500, 540),
    "cura_ring.gcode": (1000, 1030),
    "pot_spiral.gcode.gz": (9000, 9050),
}
"""Rows of moves of real programs that are small enough for a dense optimisation."""


def excerpt(profile: Profile, name: str) -> tuple[list[Command], Array]:
    """Some moves of a real program, and where they start."""
    first, last = EXCERPTS[name]
    moves = [c for c in read(profile, program_text(GCODE / name)) if isinstance(c, Moves)]
    ends = np.concatenate([m.end_G for m in moves])
    columns = [np.concatenate([getattr(m, key) for m in moves]) for key in ("line", "speed", "clay", "air")]
    line, speed, clay, air = (column[first:last] for column in columns)
    start = ends[first - 1].copy()
    return [Moves(line, start, ends[first:last].copy(), speed, clay, air)], start


def small_cases(profile: Profile) -> Iterator[tuple[str, list[Command], Array]]:
    """Name, commands and start (3,) m of each small case."""
    for name, draw in SMALL.items():
        yield name, read(profile, draw()), np.zeros(3)
    for name in EXCERPTS:
        yield (f"{name} [{EXCERPTS[name][0]}:{EXCERPTS[name][1]}]", *excerpt(profile, name))
