"""A second, simple reading of G-code, for checking logs only: what is drawn, how fast, with how much clay.

Knows G0-G3, G20-G21, G28, G90-G92, M82-M83, M200, M220, M221; everything else draws nothing.
"""

import math
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))?")
LEAST_MM3 = 1e-6


@dataclass
class Drawing:
    """M moves in order; arcs have a sweep that is not 0."""

    line: np.ndarray
    start: np.ndarray
    end: np.ndarray
    centre: np.ndarray
    sweep: np.ndarray
    feed: np.ndarray
    """mm/s"""
    extrudes: np.ndarray
    clay_mm3: float
    free_lines: list[int]
    """lines of G28, whose way is the machine's own"""
    priming_lines: list[int]

    def move_at(self, line: np.ndarray) -> np.ndarray:
        """The last move at or before a line; -1 before the first."""
        return np.searchsorted(self.line, line, "right") - 1

    def places(self, move: int) -> np.ndarray:
        """(5, 3): evenly along a move, both ends included."""
        part = np.linspace(0, 1, 5)
        if self.sweep[move] == 0:
            return self.start[move] + part[:, None] * (self.end[move] - self.start[move])
        ends = self.start[move], self.end[move], self.centre[move]
        return _on_arc(*(np.tile(place, (5, 1)) for place in ends), np.full(5, self.sweep[move]), part)

    def distance(self, move: np.ndarray, point: np.ndarray) -> np.ndarray:
        """(N,), (N, 3) -> distance of each point from its move."""
        straight = _to_line(self.start[move], self.end[move], point)
        curved = self.sweep[move] != 0
        if curved.any():
            of = move[curved]
            straight[curved] = _to_arc(
                self.start[of], self.end[of], self.centre[of], self.sweep[of], point[curved]
            )
        return straight


def _to_line(start: np.ndarray, end: np.ndarray, point: np.ndarray) -> np.ndarray:
    d = end - start
    along = np.einsum("ij,ij->i", point - start, d) / np.maximum(np.einsum("ij,ij->i", d, d), 1e-300)
    return np.linalg.norm(start + np.clip(along, 0, 1)[:, None] * d - point, axis=1)


def _to_arc(
    start: np.ndarray, end: np.ndarray, centre: np.ndarray, sweep: np.ndarray, point: np.ndarray
) -> np.ndarray:
    """Distance from a helix, at the angle of the point."""
    out = (start - centre)[:, :2]
    first = np.arctan2(out[:, 1], out[:, 0])
    seen = np.arctan2(point[:, 1] - centre[:, 1], point[:, 0] - centre[:, 0])
    turned = np.mod((seen - first) * np.sign(sweep), 2 * np.pi)
    best = np.full(len(point), np.inf)
    for part in (np.clip(turned / np.abs(sweep), 0, 1), np.zeros(len(point)), np.ones(len(point))):
        place = _on_arc(start, end, centre, sweep, part)
        best = np.minimum(best, np.linalg.norm(place - point, axis=1))
    return best


def _on_arc(
    start: np.ndarray, end: np.ndarray, centre: np.ndarray, sweep: np.ndarray, part: np.ndarray
) -> np.ndarray:
    """Places on helices, ``part`` (N,) of the way; the radius goes evenly from start to end."""
    out, back = (start - centre)[:, :2], (end - centre)[:, :2]
    radius = np.linalg.norm(out, axis=1) * (1 - part) + np.linalg.norm(back, axis=1) * part
    angle = np.arctan2(out[:, 1], out[:, 0]) + part * sweep
    height = start[:, 2] * (1 - part) + end[:, 2] * part
    flat = centre[:, :2] + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.column_stack([flat, height])


@dataclass
class Pen:
    """Where the reading stands."""

    profile: dict[str, Any]
    lines: np.ndarray
    nozzle: np.ndarray
    at: np.ndarray = field(default_factory=lambda: np.zeros(3))
    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))
    unit: float = 1.0
    absolute: bool = True
    absolute_e: bool = True
    e: float = 0.0
    fed: float = 0.0
    fed_most: float = 0.0
    feed: float = 0.0
    speed: float = 1.0
    flow: float = 1.0
    scale: float = 1.0
    moves: list[tuple[Any, ...]] = field(default_factory=list)
    clay: float = 0.0
    free: list[int] = field(default_factory=list)
    priming: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        extruder = self.profile["extruder"]
        self.area = math.pi / 4 * extruder["filament_diameter_mm"] ** 2
        self.scale = 1.0 if extruder["e_unit"] == "mm3" else self.area

    def push(self, words: dict[str, float]) -> float:
        """mm³ of clay that E adds beyond what was taken back before."""
        if "E" not in words:
            return 0.0
        step = words["E"] * self.unit - self.e if self.absolute_e else words["E"] * self.unit
        self.e = self.e + step
        self.fed += step * self.scale
        new = max(0.0, self.fed - self.fed_most) * self.flow
        self.fed_most = max(self.fed, self.fed_most)
        return new if new > LEAST_MM3 else 0.0

    def draw(self, line: int, code: str, words: dict[str, float]) -> None:
        if "F" in words:
            self.feed = words["F"] * self.unit / 60
        clay = self.push(words)
        self.clay += clay
        target = self.at.copy()
        for k, axis in enumerate("XYZ"):
            if axis in words:
                value = words[axis] * self.unit
                target[k] = value + self.offset[k] if self.absolute else self.at[k] + value
        moved = bool(np.any(target != self.at)) or code in ("G2", "G3")
        if clay and not moved:
            self.priming.append(line)
        if moved:
            centre, sweep = self.turn(code, words, target) if code in ("G2", "G3") else (np.zeros(3), 0.0)
            limit = self.profile["limits"]["speed_max_mm_s"]
            feed = min(self.feed * self.speed, limit)
            self.moves.append((line, self.at, target, centre, sweep, feed, clay > 0))
        self.at = target

    def turn(self, code: str, words: dict[str, float], target: np.ndarray) -> tuple[np.ndarray, float]:
        if "R" in words:
            centre = self.by_radius(code, words["R"] * self.unit, target)
        else:
            centre = self.at + np.array([words.get("I", 0.0), words.get("J", 0.0), 0.0]) * self.unit
        a, b = self.at - centre, target - centre
        sweep = (math.atan2(b[1], b[0]) - math.atan2(a[1], a[0])) % (2 * math.pi)
        if code == "G3":
            return centre, sweep if sweep > 5e-7 else 2 * math.pi
        return centre, sweep - 2 * math.pi

    def by_radius(self, code: str, radius: float, target: np.ndarray) -> np.ndarray:
        chord = target - self.at
        length = float(np.hypot(chord[0], chord[1]))
        rise = math.sqrt(max(radius**2 - length**2 / 4, 0.0))
        side = rise if (code == "G3") == (radius > 0) else -rise
        return self.at + chord / 2 + side / length * np.array([-chord[1], chord[0], 0.0])

    def home(self, line: int) -> None:
        """G28: the way is the machine's own; where it ended stands in the log."""
        rows = np.flatnonzero(self.lines <= line)
        self.at = self.nozzle[rows[-1]].copy() if len(rows) else np.zeros(3)
        self.offset = np.zeros(3)
        self.free.append(line)
        self.moves.append((line, self.at, self.at, np.zeros(3), 0.0, math.inf, False))

    def shift(self, words: dict[str, float]) -> None:
        """G92."""
        if not words:
            words = dict.fromkeys("XYZE", 0.0)
        for k, axis in enumerate("XYZ"):
            if axis in words:
                self.offset[k] = self.at[k] - words[axis] * self.unit
        self.e = words.get("E", self.e / self.unit) * self.unit

    def set(self, code: str, words: dict[str, float]) -> None:
        """The words that change how others are read."""
        if code in ("G20", "G21"):
            self.unit = 25.4 if code == "G20" else 1.0
        elif code in ("G90", "G91"):
            self.absolute = code == "G90"
        elif code in ("M82", "M83"):
            self.absolute_e = code == "M82"
        elif code == "M200":
            self.scale = 1.0 if words.get("D", 0.0) > 0 else self.area
        elif code == "M220":
            self.speed = words.get("S", 100.0) / 100
        elif code == "M221":
            self.flow = words.get("S", 100.0) / 100


def _words(text: str) -> tuple[str, dict[str, float]]:
    text = re.sub(r"\(.*?\)|;.*|\*.*", " ", text).upper()
    pairs = [(letter, float(number or 0)) for letter, number in WORD.findall(text)]
    if pairs and pairs[0][0] == "N":
        pairs = pairs[1:]
    if not pairs:
        return "", {}
    return f"{pairs[0][0]}{pairs[0][1]:g}", dict(pairs[1:])


def draw(text: str, profile: dict[str, Any], lines: np.ndarray, nozzle: np.ndarray) -> Drawing:
    """The program's text, and a log's lines (N,) and nozzle (N, 3), needed for where G28 ends."""
    pen = Pen(profile, lines, nozzle)
    for number, raw in enumerate(text.split("\n"), 1):
        code, words = _words(raw)
        if code in ("G0", "G1", "G2", "G3"):
            pen.draw(number, code, words)
        elif code == "G28":
            pen.home(number)
        elif code == "G92":
            pen.shift(words)
        elif code in ("M2", "M30"):
            break
        else:
            pen.set(code, words)
    columns = list(zip(*pen.moves, strict=True)) if pen.moves else [[] for _ in range(7)]
    line, start, end, centre, sweep, feed, extrudes = (np.array(column) for column in columns)
    return Drawing(
        line, start, end, centre, sweep, feed, extrudes.astype(bool), pen.clay, pen.free, pen.priming
    )
