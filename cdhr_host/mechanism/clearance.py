"""Lower cables against the bed and against what is already printed.

The six lower cables run from the platform's attachments down to their pulleys, past the nozzle's
tip and under it: what stands there is hit. A cable is the straight part from its attachment to its
pulley; those of a pair are parallel. The bed is a disc at program z = 0, a print is a height map.
"""

from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from cdhr_host.errors import Problem
from cdhr_host.mechanism.cables import LOWER, Cables
from cdhr_host.mechanism.height_map import HeightMap
from cdhr_host.mechanism.kinematics import platform_blocks
from cdhr_host.mechanism.pairs import Pairs
from cdhr_host.profile import Profile
from cdhr_host.units import MM
from cdhr_host.values import Array, Flags, Ints

GAP: Final = 2.0 * MM
"""that must stay between a cable and what it could hit"""
CELL: Final = 5.0 * MM
"""of the height map, and what the platform moves between two looks"""
CABLES: Final = ("1 left", "2 left", "3 left", "1 right", "2 right", "3 right")
LOOKS: Final = 1 << 16
"""points along cables looked at in one go"""


class Lines(NamedTuple):
    """The straight parts of N x 6 lower cables, in program coordinates of the nozzle's tip."""

    start: Array
    """(N, 6, 3) m: attachments"""
    run: Array
    """(N, 6, 3) m: from there to the pulleys"""


def cable_lines(cables: Cables, pairs: Pairs, nozzle_length: float, nozzle_G: Array) -> Lines:
    """(N, 3) -> Lines: left 1-3, right 1-3. Raises MotionError out of reach."""
    run = np.empty((len(nozzle_G), 6, 3))
    for rows, wraps in platform_blocks(cables, LOWER, nozzle_G - cables.reference_G):
        for i, wrap in enumerate(wraps):
            for axis, part in enumerate(wrap.straight()):
                run[rows, i, axis] = run[rows, i + 3, axis] = part
    start = nozzle_G[:, None] + np.concatenate([pairs.left, pairs.right])
    start[:, :, 2] += nozzle_length
    return Lines(start, run)


def depth_inside(lines: Lines, level: float, radius: float) -> Array:
    """-> (N, 6) m: how far inside a disc about the program's axis each cable gets below ``level``.

    Negative where what is below passes outside; -inf where nothing of the cable is below.
    """
    begin = _first_below(lines, level)
    flat, aim = lines.start[:, :, :2], lines.run[:, :, :2]
    size = np.einsum("nik,nik->ni", aim, aim)
    nearest = np.clip(-np.einsum("nik,nik->ni", flat, aim) / size, np.minimum(begin, 1.0), 1.0)
    closest = flat + nearest[:, :, None] * aim
    distance = np.sqrt(np.einsum("nik,nik->ni", closest, closest))
    return np.where(begin < 1.0, radius - distance, -np.inf)


def clear_radius(
    cables: Cables, pairs: Pairs, nozzle_length: float, height: float, *, gap: float = 0.0, step: float = MM
) -> float:
    """m: greatest radius of a flat part or bed that no cable cuts while the nozzle is anywhere over it.

    ``height`` is the lower attachment plane's in W, m, with the nozzle's tip on the part. To ``step``;
    the nozzle goes round the rim and the cables are worst there. inf where nothing is cut within reach.
    """
    base = cables.reference_G + np.array([0.0, 0.0, height - float(cables.attachments[0, 2])])
    turn = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
    rim = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
    axis = np.array([base[0], base[1], 0.0])
    reach = 0.5 * float(np.linalg.norm(cables.anchors[0, :2]) - np.linalg.norm(cables.attachments[0, :2]))
    for radius in np.arange(step, reach, step):
        lines = cable_lines(cables, pairs, nozzle_length, base + radius * rim)
        about = Lines(lines.start - axis, lines.run)
        if (depth_inside(about, float(base[2]) + gap, float(radius)) > 0.0).any():
            return float(radius - step)
    return float("inf")


@dataclass(slots=True)
class Clearance:
    """The print so far, and the cables over it: fed block by block in the order of the program."""

    cables: Cables
    pairs: Pairs
    nozzle_length: float
    bed_radius: float
    gap: float
    map: HeightMap
    _told: set[tuple[int, str]] = field(default_factory=set)

    @classmethod
    def from_profile(cls, profile: Profile, *, gap: float = GAP) -> "Clearance":
        """An empty bed."""
        return cls(
            Cables.from_profile(profile),
            Pairs.from_profile(profile),
            profile.geometry.nozzle_length,
            profile.bed.radius,
            gap,
            HeightMap(profile.bed.radius, CELL),
        )

    def block(self, nozzle_G: Array, line: Ints, clay: Flags) -> list[Problem]:
        """(N, 3) m, (N,), (N,) in the order of motion -> collisions, one for each line and cable.

        ``clay`` marks samples that lay clay on the way to them, which is straight. The block is
        laid first, then looked at. Poses must be on the bed and within reach; raises MotionError
        otherwise.
        """
        if not len(nozzle_G):
            return []
        self.map.lay(nozzle_G, line, clay)
        places, sample = _evenly(nozzle_G)
        lines = cable_lines(self.cables, self.pairs, self.nozzle_length, places)
        return [*self._bed(lines, line[sample]), *self._print(lines, line[sample])]

    def _bed(self, lines: Lines, line: Ints) -> list[Problem]:
        depth = depth_inside(lines, self.gap, self.bed_radius)
        return [
            problem
            for pose, cable in np.argwhere(depth > 0.0)
            for problem in self._problem(int(line[pose]), int(cable), "the bed", float(depth[pose, cable]))
        ]

    def _print(self, lines: Lines, line: Ints) -> list[Problem]:
        if not self.map.top > 0.0:
            return []
        doubtful = np.argwhere(depth_inside(lines, self.map.top + self.gap, self.map.radius) > 0.0)
        found: list[Problem] = []
        count = 1 + int(np.ceil(4.0 * self.map.radius / self.map.cell))
        for part in np.array_split(doubtful, 1 + len(doubtful) * count // LOOKS):
            pose, cable = part.T
            deep, by = self._deepest(Lines(lines.start[pose, cable], lines.run[pose, cable]), count)
            for i in np.flatnonzero(deep > 0.0):
                what = f"what line {by[i]} printed"
                found += self._problem(int(line[pose[i]]), int(cable[i]), what, float(deep[i]))
        return found

    def _deepest(self, lines: Lines, count: int) -> tuple[Array, Ints]:
        """(M, 3) lines -> how far each is into the map, m, and the line printed there."""
        size = np.linalg.norm(lines.run[:, :2], axis=1)
        middle = -np.einsum("nk,nk->n", lines.start[:, :2], lines.run[:, :2]) / size**2
        reach = self.map.radius / size
        along = np.clip(middle[:, None] + np.linspace(-1.0, 1.0, count) * reach[:, None], 0.0, 1.0)
        points = lines.start[:, None] + along[:, :, None] * lines.run[:, None]
        height, by = self.map.at(points[:, :, 0], points[:, :, 1])
        deep = height + self.gap - points[:, :, 2]
        worst = deep.argmax(axis=1)
        rows = np.arange(len(worst))
        return deep[rows, worst], by[rows, worst]

    def _problem(self, line: int, cable: int, what: str, value: float) -> list[Problem]:
        """Empty when this line was already told about this cable."""
        name = CABLES[cable]
        if (line, name) in self._told:
            return []
        self._told.add((line, name))
        return [
            Problem(
                "clearance",
                f"cable {name} would run into {what}: {value / MM:.3g} mm too far",
                line=line,
                value=value / MM,
                limit=0.0,
                unit="mm",
                hint="a part nearer to the axis, or a longer nozzle ([geometry] nozzle_length_mm)",
            )
        ]


def _first_below(lines: Lines, level: float) -> Array:
    """(N, 6): part of the run after which the cable is below ``level``; 1 or more if never."""
    drop = -lines.run[:, :, 2]
    return np.maximum(0.0, (lines.start[:, :, 2] - level) / drop)


def _evenly(points: Array) -> tuple[Array, Ints]:
    """Places about every half cell along the way, with both ends, and the samples they lead to."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.append(np.arange(0.0, way[-1], 0.5 * CELL), way[-1])
    places = np.column_stack([np.interp(at, way, axis) for axis in points.T])
    return places, np.minimum(np.searchsorted(way, at), len(points) - 1)
