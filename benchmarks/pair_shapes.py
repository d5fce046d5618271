"""The shapes of two right angles in a row that the planner chooses from: the fastest ways, found once.

    python benchmarks/pair_shapes.py              some of the table's shapes, looked for again
    python benchmarks/pair_shapes.py --out FILE   the whole table (both need pip install -e .[bench])

A way from one straight over a second to a third, both corners right angles: a hop of the nozzle, or the end
of a line of infill. Pieces of constant jerk, of one duration before the first corner, one between them
and one after the second, lead from one speed to another. For given durations what the way gains is linear in
the jerks, and limits and tolerance are convex: a second-order cone program, whose optimum is the only one.
The duration between the corners is looked for by Brent's method. Lengths, times and speeds are in units that
make acceleration and jerk 1; the planner closes what it blends, and slows it down until it keeps every
limit (``motion.pairs``).
"""

import argparse
import multiprocessing
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, product
from pathlib import Path

import clarabel
import numpy as np
from scipy import optimize, sparse

from cdhr_host.motion import pair_shapes
from cdhr_host.motion.pair_shapes import ENDS, PIECES
from cdhr_host.values import Array

ANGLES = tuple(np.arange(0.0, 181.0, 45.0))
"""degrees between the first direction and the third, for a way that must not lead below the first;"""
FLAT = (0.0, 180.0)
"""for one that may swing out, which is flat"""
LENGTHS = (0.15, 0.25, 0.4, 0.6, 0.85, 1.15, 1.5, 1.95, 2.5)
"""between the corners, of acceleration³/jerk²"""
SPEEDS = (0.04, 0.12, 0.25, 0.42, 0.62, 0.85, 1.1, 1.45, 2.0)
"""of acceleration²/jerk, before and after"""
TOLERANCE = 0.047
"""of acceleration³/jerk²; 0.25 mm with 500 mm/s² and 5000 mm/s³ are 0.05, the rest is for blending"""
PART, OVERLAP = 0.75, 0.35
"""The way before the first corner lasts as long as slowing down to rest, less what goes on while the second
straight is begun: this part of it, or all but so much. The same after the second. More gains less than 2 %,
and needs more room."""
SMOOTH = 1e-4
"""Worth of a jerk's square for a unit of time: of ways as fast that with the least of it is taken."""
SHORTEST, LONGEST, NEAR = 0.35, 0.95, 0.008
"""of the time of a hop from rest to rest with no other limit than jerk; and how near it is found"""
SOME = ((0, 3, 4, 6), (1, 6, 2, 5), (1, 2, 6, 6))
"""angles, lengths and speeds that are looked for again"""
SMOKE = 2
"""of them in a short run"""
SAME = 0.02
"""by which times may differ (the table is in half precision): 2 ms at 500 and 5000 mm/s³"""
LOST = 100.0
"""instead of the time of what is not possible"""


@dataclass(frozen=True, slots=True)
class Way:
    """What is looked for."""

    angle: float
    """rad between the first direction and the third"""
    speeds: tuple[float, float]
    length: float
    """of the second straight"""
    floor: bool
    """whether the nozzle must not be below the first straight"""

    @property
    def directions(self) -> Array:
        """(3, 3)"""
        return np.array([[1, 0, 0], [0, 0, 1], [np.cos(self.angle), np.sin(self.angle), 0.0]])

    def durations(self, between: float) -> Array:
        """(3,) of all pieces before, between and after both corners."""
        rests = (min(2 * np.sqrt(v), v + 1) for v in self.speeds)
        before, after = (max(PART * rest, rest - OVERLAP) for rest in rests)
        return np.array([before, between, after])


class Program:
    """The cone program for one way and durations (3,); its variables are (3 N,) jerks and both reaches.

    Rows of ``states`` are places, speeds and accelerations, as what they are without jerk and by which jerks.
    """

    def __init__(self, way: Way, durations: Array) -> None:
        self.way, self.durations = way, durations
        self.pieces = np.repeat(durations / PIECES, PIECES)
        self.count = len(self.pieces)
        self.size = 3 * self.count + 2
        self._rows: tuple[list[Array], ...] = ([], [], [])
        self._cones: list[int] = []
        self._state()

    def _state(self) -> None:
        """(N + 1, 3, size + 1) places, speeds and accelerations at the ends of pieces.

        By which variables, and in the last column what they are without these.
        """
        shape = self.count + 1, 3, self.size + 1
        self.place, self.speed, self.bend = (np.zeros(shape) for _ in range(3))
        first = self.way.directions[0]
        self.speed[0, :, -1] = self.way.speeds[0] * first
        self.place[0, :, -3] = -first
        for k, t in enumerate(self.pieces):
            jerk = np.zeros(shape[1:])
            jerk[np.arange(3), 3 * k + np.arange(3)] = 1.0
            self.bend[k + 1] = self.bend[k] + t * jerk
            self.speed[k + 1] = self.speed[k] + t * self.bend[k] + t**2 / 2 * jerk
            self.place[k + 1] = self.place[k] + t * self.speed[k] + t**2 / 2 * self.bend[k] + t**3 / 6 * jerk

    def _positive(self, row: Array) -> None:
        self._rows[1].append(row)

    def _within(self, rows: Array, most: float) -> None:
        bound = np.zeros((1, self.size + 1))
        bound[0, -1] = most
        self._rows[2].append(np.vstack((bound, rows)))
        self._cones.append(len(rows) + 1)

    def _limits(self) -> None:
        jerk = np.eye(3 * self.count, self.size + 1).reshape(self.count, 3, -1)
        for k in range(self.count):
            self._within(jerk[k], 1.0)
            self._within(self.bend[k], 1.0)

    def _sides(self) -> None:
        """Near the straight that each piece belongs to, and no faster than it was begun or is to end."""
        side = np.repeat(np.arange(3), PIECES)
        for k in range(self.count):
            for point in self._between(k):
                self._beside(point, side[k])
            if k in ENDS:
                self._within(self.place[k] - self._corner(side[k]), TOLERANCE)
            elif k:
                self._beside(self.place[k], side[k])
            if k and side[k] != 1:
                self._within(self.speed[k], self.way.speeds[side[k] // 2])
            if k and self.way.floor:
                self._above(k)

    def _between(self, k: int) -> Iterator[Array]:
        """Two places on a piece."""
        jerk = np.zeros_like(self.place[k])
        jerk[np.arange(3), 3 * k + np.arange(3)] = 1.0
        for t in self.pieces[k] * np.array([1 / 3, 2 / 3]):
            yield self.place[k] + t * (self.speed[k] + t * (self.bend[k] / 2 + t / 6 * jerk))

    def _beside(self, place: Array, side: int) -> None:
        along, way = self.way.directions[side], place - self._corner(side)
        self._within(way - np.outer(along, along @ way), TOLERANCE)
        self._positive((along if side else -along) @ way)
        if side == 1:
            self._positive(along @ (self._corner(2) - place))

    def _above(self, k: int) -> None:
        """Begin and control points of a piece (Bernstein's form) are not below the first straight."""
        t, (x, v, a) = self.pieces[k], (each[k] for each in (self.place, self.speed, self.bend))
        for control in (x, x + t / 3 * v, x + 2 * t / 3 * v + t**2 / 6 * a):
            self._positive(self.way.directions[1] @ control)

    def _corner(self, side: int) -> Array:
        """(3, size + 1) the corner from which a straight leads."""
        corner = np.zeros((3, self.size + 1))
        if side == 2:
            corner[:, -1] = self.way.length * self.way.directions[1]
        return corner

    def _ends(self) -> None:
        last = self.way.directions[2]
        rows = [self.bend[-1].copy(), self.speed[-1].copy(), self.place[-1].copy()]
        rows[1][:, -1] -= self.way.speeds[1] * last
        rows[2][:, -1] -= self.way.length * self.way.directions[1]
        rows[2][:, -2] -= last
        self._rows[0].extend(rows)

    def solve(self) -> tuple[float, Array]:
        """Time that is lost, and (88,) durations, reach before the first corner and jerks; or LOST."""
        self._limits()
        self._sides()
        self._ends()
        equal, positive, cones = (np.vstack(rows) for rows in self._rows)
        rows = np.vstack((equal, positive, cones))
        kinds = [clarabel.ZeroConeT(len(equal)), clarabel.NonnegativeConeT(len(positive))]
        kinds += [clarabel.SecondOrderConeT(size) for size in self._cones]
        worth = np.zeros(self.size)
        worth[-2:] = -1 / np.array(self.way.speeds)
        even = sparse.diags(np.append(np.repeat(SMOOTH * self.pieces, 3), (0.0, 0.0)), format="csc")
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        left = sparse.csc_matrix(-rows[:, :-1])
        found = clarabel.DefaultSolver(even, worth, left, rows[:, -1], kinds, settings).solve()
        if found.status not in {clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved}:
            return LOST, np.full(self.count * 3 + 4, np.nan)
        x = np.array(found.x)
        return float(self.durations.sum() + worth @ x), np.concatenate((self.durations, x[[-2]], x[:-2]))


def fastest(way: Way) -> tuple[float, Array]:
    """Time that is lost, and the shape."""
    root = np.cbrt(32 * way.length)

    def lost(part: float) -> float:
        found = Program(way, way.durations(part * root)).solve()[0]
        return found if found < LOST else LOST - part

    part = optimize.minimize_scalar(
        lost, bounds=(SHORTEST, LONGEST), method="bounded", options={"xatol": NEAR}
    ).x
    return Program(way, way.durations(part * root)).solve()


def _row(of: tuple[float, float, bool]) -> Array:
    """(V, V, 88) of one angle and length, by both speeds."""
    degrees, length, floor = of
    ways = (Way(np.radians(degrees), speeds, length, floor) for speeds in product(SPEEDS, SPEEDS))
    found = np.array([fastest(way)[1] for way in ways])
    print(of, np.isnan(found[:, 0]).sum(), flush=True)
    return found.reshape(len(SPEEDS), len(SPEEDS), -1)


def write(out: Path) -> None:
    """Look for all shapes, and write the table."""
    work = [list(product(angles, LENGTHS, (floor,))) for angles, floor in ((ANGLES, True), (FLAT, False))]
    with multiprocessing.Pool(2) as pool:
        floor, flat = (pool.map(_row, each, chunksize=1) for each in work)
    shape = -1, len(LENGTHS), len(SPEEDS), len(SPEEDS), 3 * sum(PIECES) + 4
    np.savez_compressed(
        out,
        angle=np.radians(ANGLES),
        length=LENGTHS,
        speed=SPEEDS,
        floor=np.reshape(floor, shape).astype(np.float16),
        flat=np.reshape(flat, shape).astype(np.float16),
    )


def again() -> Iterator[tuple[Way, float, float]]:
    """Of some shapes, what they are, and the time they lose in the table and looked for again."""
    held = pair_shapes.table()
    for floor, (angle, length, before, after) in product((True, False), SOME):
        speeds = SPEEDS[before], SPEEDS[after]
        way = Way(np.radians((ANGLES if floor else FLAT)[angle]), speeds, LENGTHS[length], floor)
        row = (held.floor if floor else held.flat)[angle, length, before, after]
        yield way, lost(way, row), fastest(way)[0]


def lost(way: Way, row: Array) -> float:
    """Time of a row (88,) of the table, less that of its first and last straight at their speeds."""
    end = Program(way, row[:3]).place[-1] @ np.concatenate((row[4:], row[3:4], (0.0, 1.0)))
    reach = np.array([row[3], way.directions[2] @ end])
    return float(row[:3].sum() - (reach / way.speeds).sum())


def main() -> None:
    """Write the table, or compare some of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, help="write the whole table here, 20 minutes on two processors")
    parser.add_argument("--smoke", action="store_true", help="a few shapes")
    options = parser.parse_args()
    if options.out is not None:
        write(options.out)
        return
    worst = 0.0
    print("| floor | angle | length | speeds | lost in the table | found again |\n|---|---|---|---|---|---|")
    for way, held, found in islice(again(), SMOKE if options.smoke else None):
        degrees = np.degrees(way.angle)
        print(f"| {way.floor} | {degrees:.0f}° | {way.length} | {way.speeds} | {held:.4f} | {found:.4f} |")
        worst = max(worst, abs(found - held))
    if worst > SAME:
        raise SystemExit(f"what was found differs by {worst:.3f}")


if __name__ == "__main__":
    main()
