"""A second, simple reading of G-code, for checking logs only: what is drawn, how fast, with how much clay.

Knows G0-G3, G5, G5.1, G17-G21, G28, G61, G64, G90-G92, M82-M83, M200, M220, M221; everything else
draws nothing.
"""

import math
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))?")
LEAST_MM3 = 1e-6
PLANES = {"G17": (0, 1, 2), "G18": (2, 0, 1), "G19": (1, 2, 0)}
"""Two axes of the plane, then its normal"""
HALVINGS = 9
"""Times a Bézier curve is cut in two before its pieces count as straight"""


@dataclass
class Drawing:
    """M moves in order; arcs have a sweep that is not 0, curves are polylines."""

    line: np.ndarray
    start: np.ndarray
    end: np.ndarray
    centre: np.ndarray
    sweep: np.ndarray
    axes: np.ndarray
    """the plane of each arc"""
    feed: np.ndarray
    """mm/s"""
    extrudes: np.ndarray
    tolerance: np.ndarray
    """mm it may deviate"""
    exact: np.ndarray
    """begins and ends at rest"""
    curves: dict[int, np.ndarray]
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
        if move in self.curves:
            curve = self.curves[move]
            return curve[np.linspace(0, len(curve) - 1, 5).astype(int)]
        if self.sweep[move] == 0:
            return self.start[move] + part[:, None] * (self.end[move] - self.start[move])
        axes = self.axes[move]
        ends = self.start[move][axes], self.end[move][axes], self.centre[move][axes]
        flat = _on_arc(*(np.tile(place, (5, 1)) for place in ends), np.full(5, self.sweep[move]), part)
        return flat[:, np.argsort(axes)]

    def distance(self, move: np.ndarray, point: np.ndarray) -> np.ndarray:
        """(N,), (N, 3) -> distance of each point from its move."""
        straight = _to_line(self.start[move], self.end[move], point)
        curved = self.sweep[move] != 0
        if curved.any():
            of = move[curved]
            axes = self.axes[of]
            places = (self.start[of], self.end[of], self.centre[of], point[curved])
            start, end, centre, to = (np.take_along_axis(place, axes, 1) for place in places)
            straight[curved] = _to_arc(start, end, centre, self.sweep[of], to)
        for each, curve in self.curves.items():
            here = np.flatnonzero(move == each)
            straight[here] = [_to_polyline(curve, place) for place in point[here]]
        return straight


def _to_line(start: np.ndarray, end: np.ndarray, point: np.ndarray) -> np.ndarray:
    d = end - start
    along = np.einsum("ij,ij->i", point - start, d) / np.maximum(np.einsum("ij,ij->i", d, d), 1e-300)
    return np.linalg.norm(start + np.clip(along, 0, 1)[:, None] * d - point, axis=1)


def _to_polyline(points: np.ndarray, to: np.ndarray) -> float:
    count = len(points) - 1
    return float(_to_line(points[:-1], points[1:], np.tile(to, (count, 1))).min())


def bezier(control: np.ndarray, halvings: int = HALVINGS) -> np.ndarray:
    """(4, 3) -> (2**halvings + 1, 3): points on the curve, by halving it (de Casteljau)."""
    if halvings == 0:
        return control[[0, 3]]
    a, b, c, d = control
    ab, bc, cd = (a + b) / 2, (b + c) / 2, (c + d) / 2
    abc, bcd = (ab + bc) / 2, (bc + cd) / 2
    middle = (abc + bcd) / 2
    first = bezier(np.array([a, ab, abc, middle]), halvings - 1)
    return np.concatenate([first, bezier(np.array([middle, bcd, cd, d]), halvings - 1)[1:]])


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
    plane: tuple[int, int, int] = (0, 1, 2)
    onward: np.ndarray | None = None
    tolerance: float = 0.0
    exact: bool = False
    curves: dict[int, np.ndarray] = field(default_factory=dict)
    moves: list[tuple[Any, ...]] = field(default_factory=list)
    clay: float = 0.0
    free: list[int] = field(default_factory=list)
    priming: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        extruder = self.profile["extruder"]
        self.tolerance = self.profile["path"]["tolerance_mm"]
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
        control = self.control(code, words, target)
        moved = bool(np.any(target != self.at)) or code in ("G2", "G3")
        if control is not None:
            moved = bool(np.any(control != self.at))
        if clay and not moved:
            self.priming.append(line)
        if moved:
            centre, sweep = self.turn(code, words, target) if code in ("G2", "G3") else (np.zeros(3), 0.0)
            limit = self.profile["limits"]["speed_max_mm_s"]
            feed = min(self.feed * self.speed, limit)
            if control is not None:
                self.curves[len(self.moves)] = bezier(control)
            self.add(line, target, centre, sweep, feed, extrudes=clay > 0)
        self.at = target

    def add(
        self, line: int, target: np.ndarray, centre: np.ndarray, sweep: float, feed: float, *, extrudes: bool
    ) -> None:
        how = self.plane, feed, extrudes, self.tolerance, self.exact
        self.moves.append((line, self.at, target, centre, sweep, *how))

    def control(self, code: str, words: dict[str, float], target: np.ndarray) -> np.ndarray | None:
        """(4, 3): control points of G5 and G5.1."""
        first, second = (
            np.array([words.get(x, 0.0), words.get(y, 0.0), 0.0]) * self.unit for x, y in ("IJ", "PQ")
        )
        onward, self.onward = self.onward, None
        if code == "G5":
            if "I" not in words and onward is not None:
                first = onward
            self.onward = -second
            return np.array([self.at, self.at + first, target + second, target])
        if code == "G5.1":
            middle = self.at + first
            return np.array([self.at, (self.at + 2 * middle) / 3, (target + 2 * middle) / 3, target])
        return None

    def turn(self, code: str, words: dict[str, float], target: np.ndarray) -> tuple[np.ndarray, float]:
        if "R" in words:
            centre = self.by_radius(code, words["R"] * self.unit, target)
        else:
            centre = self.at + np.array([words.get(letter, 0.0) for letter in "IJK"]) * self.unit
        axes = list(self.plane)
        a, b = (self.at - centre)[axes], (target - centre)[axes]
        sweep = (math.atan2(b[1], b[0]) - math.atan2(a[1], a[0])) % (2 * math.pi)
        if code == "G3":
            return centre, sweep if sweep > 5e-7 else 2 * math.pi
        return centre, sweep - 2 * math.pi

    def by_radius(self, code: str, radius: float, target: np.ndarray) -> np.ndarray:
        axes = list(self.plane)
        chord = (target - self.at)[axes]
        length = float(np.hypot(chord[0], chord[1]))
        rise = math.sqrt(max(radius**2 - length**2 / 4, 0.0))
        side = rise if (code == "G3") == (radius > 0) else -rise
        centre = np.zeros(3)
        centre[axes] = self.at[axes] + chord / 2 + side / length * np.array([-chord[1], chord[0], 0.0])
        return centre

    def home(self, line: int) -> None:
        """G28: the way is the machine's own; where it ended stands in the log."""
        rows = np.flatnonzero(self.lines <= line)
        self.at = self.nozzle[rows[-1]].copy() if len(rows) else np.zeros(3)
        self.offset = np.zeros(3)
        self.free.append(line)
        self.onward = None
        self.add(line, self.at, np.zeros(3), 0.0, math.inf, extrudes=False)

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
        elif code in PLANES:
            self.plane = PLANES[code]
        elif code in ("G61", "G61.1", "G64"):
            self.exact = code != "G64"
            usual = self.profile["path"]["tolerance_mm"]
            self.tolerance = words["P"] * self.unit if "P" in words else usual
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
        if code in ("G0", "G1", "G2", "G3", "G5", "G5.1"):
            pen.draw(number, code, words)
        elif code == "G28":
            pen.home(number)
        elif code == "G92":
            pen.shift(words)
        elif code in ("M2", "M30"):
            break
        else:
            pen.set(code, words)
    columns = list(zip(*pen.moves, strict=True)) if pen.moves else [[] for _ in range(10)]
    line, start, end, centre, sweep, axes, feed, extrudes, tolerance, exact = map(np.array, columns)
    flags = extrudes.astype(bool), tolerance, exact.astype(bool)
    rest = pen.curves, pen.clay, pen.free, pen.priming
    return Drawing(line, start, end, centre, sweep, axes, feed, *flags, *rest)
