"""The shapes of corners that the planner chooses from: the fastest ways around a corner, found once.

    python benchmarks/corner_shapes.py              some of the table's shapes, looked for again
    python benchmarks/corner_shapes.py --out FILE   the whole table (both need pip install -e .[bench])

Six pieces of constant jerk, three before the corner's middle and three after it, lead from a straight
passed at one speed to one passed at another. Each shape is the solution of a nonlinear program: least time
less the way at these speeds, within the tolerance of both straights and the limits. Lengths, times and
speeds are in units that make acceleration and jerk 1. What is found here needs not be exact: the planner
closes each shape and scales it until it keeps every limit (``motion.swings``).
"""

import argparse
import multiprocessing
import sys
from collections.abc import Iterator
from itertools import islice, product
from pathlib import Path

import casadi
import numpy as np

from cdhr_host.motion import shapes
from cdhr_host.values import Array

ANGLES = (15.0, *np.arange(22.5, 180.0, 7.5), 178.0)
"""degrees"""
RIGHT = ANGLES.index(90)
"""from which the others are looked for"""
SPEEDS = tuple(np.geomspace(0.12, 2.6, 18))
"""of acceleration²/jerk"""
WORTHS = (0.6, 0.06)
"""What a way is worth beyond the time it takes at its speed, of that time: with little room, and with much"""
TOLERANCE = 0.05
"""of acceleration³/jerk²: 0.25 mm with 500 mm/s² and 5000 mm/s³"""
HALF = 3
"""pieces before the middle"""
SAMPLES = 8
"""of each piece, at which limits are kept"""
STARTS = 3
"""guesses from which one is looked for where no neighbour is known"""
SOME_ANGLES = (45.0, 90.0, 135.0)
SOME_PAIRS = (((9, 0), (9, 0)), ((11, 1), (6, 0)), ((12, 1), (12, 1)), ((13, 0), (8, 1)))
"""angles and states of both sides that are looked for again"""
SMOKE = 4
"""of them in a short run"""
SAME = 0.06
"""by which worths may differ (optima are local, the table in half precision): 6 ms at 500 and 5000 mm/s³"""
LONGEST, HARDEST, FARTHEST = 8.0, 60.0, 80.0
"""bounds of what is looked for"""


class ShapeProgram:
    """The nonlinear program of one shape.

    Its parameters are angle, two speeds, two worths, and whether it may swing out.
    """

    def __init__(self) -> None:
        self._held, self._least, self._most = [], [], []
        n = 2 * HALF
        self._lasting, self._jerk = casadi.SX.sym("t", n), casadi.SX.sym("j", n, 2)
        self._reach, given = casadi.SX.sym("r"), casadi.SX.sym("p", 6)
        self._angle, self._speed, self._swings = given[0], (given[1], given[2]), given[5]
        after = self._way()
        total, ways = casadi.sum1(self._lasting), (self._reach, after)
        worth = sum(way * (given[3 + i] - 1) / self._speed[i] for i, way in enumerate(ways))
        variables = casadi.vertcat(self._lasting, casadi.vec(self._jerk), self._reach)
        problem = {"x": variables, "f": 10 * (total + worth), "g": casadi.vertcat(*self._held), "p": given}
        ipopt = {"print_level": 0, "sb": "yes", "max_iter": 150, "tol": 1e-5}
        onwards = ipopt | {"mu_init": 1e-3, "warm_start_init_point": "yes"}
        self._solvers = [
            casadi.nlpsol("shape", "ipopt", problem, {"print_time": False, "ipopt": options})
            for options in (ipopt, onwards)
        ]
        self._lower = [0.0] * n + [-HARDEST] * (2 * n) + [0.0]
        self._upper = [LONGEST] * n + [HARDEST] * (2 * n) + [FARTHEST]

    def _keep(self, value: casadi.SX, least: float, most: float) -> None:
        self._held.append(value)
        self._least.append(least)
        self._most.append(most)

    def _size(self, pair: list[casadi.SX]) -> casadi.SX:
        """Square of a vector's length, of its parts along both straights."""
        return pair[0] ** 2 + pair[1] ** 2 + 2 * pair[0] * pair[1] * casadi.cos(self._angle)

    def _way(self) -> casadi.SX:
        """All pieces, within the limits; the way after the corner."""
        x, v, a = [-self._reach, 0.0], [self._speed[0], 0.0], [0.0, 0.0]
        for piece in range(2 * HALF):
            jerk = [self._jerk[piece, 0], self._jerk[piece, 1]]
            self._keep(self._size(jerk), -np.inf, 1.0)
            for sample in range(1, SAMPLES + 1):
                u = self._lasting[piece] * sample / SAMPLES
                place = [x[i] + v[i] * u + a[i] * u**2 / 2 + jerk[i] * u**3 / 6 for i in (0, 1)]
                speed = [v[i] + a[i] * u + jerk[i] * u**2 / 2 for i in (0, 1)]
                if (piece, sample) != (2 * HALF - 1, SAMPLES):
                    self._beside(place, speed, piece // HALF)
            x, v, a = place, speed, [a[i] + jerk[i] * self._lasting[piece] for i in (0, 1)]
            if piece < 2 * HALF - 1:
                self._keep(self._size(a), -np.inf, 1.0)
            if piece == HALF - 1:
                self._keep(self._size(x) / TOLERANCE**2, -np.inf, 1.0)
        for left in (*a, v[0], x[0], v[1] - self._speed[1]):
            self._keep(left, 0.0, 0.0)
        return x[1]

    def _beside(self, place: list[casadi.SX], speed: list[casadi.SX], side: int) -> None:
        """No faster than on the straight of this side, near it, and on its inside if it must not swing."""
        self._keep(self._size(speed) / self._speed[side] ** 2, -np.inf, 1.0)
        self._keep(place[1 - side] * casadi.sin(self._angle) / TOLERANCE, -1.0, 1.0)
        self._keep(speed[1 - side] + FARTHEST * self._swings, 0.0, np.inf)
        foot = place[side] + place[1 - side] * casadi.cos(self._angle)
        self._keep((foot if side == 0 else -foot) / TOLERANCE, -np.inf, 0.0)

    def solve(self, given: Array, start: Array, *, near: bool) -> tuple[float, Array] | None:
        """Value, and durations, jerks and reach (19,), from a start, ``near`` or not; or None."""
        solver = self._solvers[near]
        bounds = {"lbx": self._lower, "ubx": self._upper, "lbg": self._least, "ubg": self._most}
        found = solver(x0=start, p=given, **bounds)
        return (float(found["f"]), np.array(found["x"]).ravel()) if solver.stats()["success"] else None


def guessed(speed: float, rng: np.random.Generator) -> Array:
    """(19,) to begin with: at random, half of it the other backwards."""
    lasting = rng.uniform(0.2, 1.2, 2 * HALF)
    first, second = rng.uniform(-0.7, 0.3, HALF), rng.uniform(-0.5, 0.7, HALF)
    along, across = np.append(first, second[::-1]), np.append(second, first[::-1])
    return np.concatenate((lasting, along, across, [0.8 * speed + 1.0]))


def backwards(shape: Array) -> Array:
    """(19,) the same driven backwards: jerk and directions change their signs, straights their places."""
    rows = shape[:-1].reshape(3, -1)[[0, 2, 1]][:, ::-1]
    return np.append(rows.ravel(), 0.8 * shape[-1])


STATES = list(product(range(len(SPEEDS)), range(len(WORTHS))))
"""What a straight may be passed with, on either side"""


Pair = tuple[tuple[int, int], tuple[int, int]]
"""States of both sides"""


class Angle:
    """All shapes of one angle, each looked for from a neighbour's: so what lies between them is one, too."""

    def __init__(self, degrees: float, swings: bool, beside: "Angle | None" = None) -> None:
        self._angle, self._swings, self._program = np.radians(degrees), swings, ShapeProgram()
        self._rng = np.random.default_rng(int(degrees))
        self._beside = {} if beside is None else beside.found
        self.found: dict[Pair, Array] = {}
        for pair in sorted(product(STATES, STATES), key=lambda pair: (pair[0][1] + pair[1][1], pair)):
            if pair[0] <= pair[1]:
                self._solve(pair)

    def table(self) -> Array:
        """(S, S, 18) durations and jerks by the states of both sides."""
        found = np.full((len(STATES), len(STATES), 6 * HALF), np.nan)
        for i, j in product(range(len(STATES)), repeat=2):
            shape = self.found.get((STATES[i], STATES[j]))
            if shape is not None:
                found[i, j] = shape[:-1]
        return _filled(found)

    def _solve(self, pair: Pair) -> None:
        """Look for the shape of a pair of states, and have it backwards, too."""
        (v0, w0), (v1, w1) = one, other = pair
        given = np.array([self._angle, SPEEDS[v0], SPEEDS[v1], WORTHS[w0], WORTHS[w1], self._swings])
        best = None
        for start in self._near(pair):
            best = best or self._program.solve(given, start, near=True)
        if best is None:
            starts = [guessed(SPEEDS[v0], self._rng) for _ in range(STARTS)]
            found = [self._program.solve(given, start, near=False) for start in starts]
            best = min((each for each in found if each is not None), key=lambda each: each[0], default=None)
        if best is not None:
            self.found[other, one], self.found[one, other] = backwards(best[1]), best[1]

    def _near(self, pair: Pair) -> Iterator[Array]:
        """Shapes to begin with."""
        (v0, w0), (v1, w1) = one, other = pair
        if pair in self._beside:
            yield self._beside[pair]
        near = (
            ((v0, w0 - 1), (v1, w1 - 1)),
            ((v0, w0 - 1), other),
            (one, (v1, w1 - 1)),
            ((v0 - 1, w0), (v1 - 1, w1)),
            ((v0 - 1, w0), other),
            (one, (v1 - 1, w1)),
        )
        for each in near:
            if each in self.found:
                yield self.found[each]


def _chain(of: tuple[tuple[float, ...], bool]) -> list[Array]:
    """Tables of angles, each from the one before, of shapes that swing or do not."""
    beside, tables = None, []
    angles, swings = of
    for degrees in angles:
        beside = Angle(degrees, swings, beside)
        tables.append(beside.table())
        print(f"{degrees}°", file=sys.stderr, flush=True)
    return tables


def _filled(found: Array) -> Array:
    """With the nearest pair of states' shape where none was found."""
    known = np.argwhere(np.isfinite(found[:, :, 0]))
    for pair in np.argwhere(np.isnan(found[:, :, 0])):
        nearest = known[np.abs(known - pair).sum(axis=1).argmin()]
        found[tuple(pair)] = found[tuple(nearest)]
    return found


def again() -> Iterator[tuple[bool, float, Pair, float, float]]:
    """Of some shapes, what they are, and their worth in the table and looked for again from there."""
    program = ShapeProgram()
    for swings, degrees, pair in product((False, True), SOME_ANGLES, SOME_PAIRS):
        i, j = (STATES.index(state) for state in pair)
        held = shapes.table().rows[int(swings), ANGLES.index(degrees), i, j]
        (v0, w0), (v1, w1) = pair
        given = np.array([np.radians(degrees), SPEEDS[v0], SPEEDS[v1], WORTHS[w0], WORTHS[w1], swings])
        shape = shapes.measured(shapes.Shapes.of(held), given[0], np.bool_(True))
        found = program.solve(given, np.append(held, shape.reach[0]), near=True)
        worth = float(shape.duration + (shape.reach * (given[3:5] - 1) / given[1:3]).sum())
        yield swings, degrees, pair, worth, np.inf if found is None else found[0] / 10


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
    print("| swings out | angle | states | worth in the table | found again |\n|---|---|---|---|---|")
    for swings, degrees, pair, held, found in islice(again(), SMOKE if options.smoke else None):
        print(f"| {swings} | {degrees:g}° | {pair} | {held:.4f} | {found:.4f} |", flush=True)
        worst = max(worst, abs(found - held))
    if worst > SAME:
        raise SystemExit(f"what was found differs by {worst:.3f}")


def write(out: Path) -> None:
    """Look for all shapes, and write the table."""
    with multiprocessing.Pool(2) as pool:
        work = product((False, True), (ANGLES[RIGHT::-1], ANGLES[RIGHT:]))
        chains = pool.map(_chain, [(angles, swings) for swings, angles in work], chunksize=1)
    # The others are these backwards.
    upper = np.triu_indices(len(STATES))
    both = [np.stack(less[:0:-1] + more)[:, *upper] for less, more in (chains[:2], chains[2:])]
    rows = np.stack(both).astype(np.float16)
    np.savez_compressed(out, angle=np.radians(ANGLES), rows=rows)


if __name__ == "__main__":
    main()
