"""Path and law together: the fastest motion of all around a few corners, beside ours and the classic scheme.

    python benchmarks/corners.py           (needs the extra: pip install -e .[bench])

The free motion knows no path, only the limits on speed, acceleration and jerk, and that it must
stay within the tolerance of the drawn moves and pass each corner by no more than that. It is
found by an interior-point method from the planner's own motion; a local optimum, so the true one
may be faster still. All start and stop at rest, which costs a motion with a jerk limit a/j more.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise

import casadi
import numpy as np
from paths import drawn_program, machine, planned_runs, read
from peers import JUMP
from trapezoids import Polyline, trapezoids

from cdhr_host.motion.limits import MotionLimits
from cdhr_host.units import MM
from cdhr_host.values import Array

STEPS = 60
"""of constant jerk for each move"""
FEED = 60.0
"""mm/s of all moves"""
LONG = 30.0
"""mm, first and last moves"""
SAMPLES = 4000
"""of the planner's motion, from which the search begins"""
SMOKE = 1
"""corners looked at by a short run"""
STRATEGIES = ("adaptive", "monotone")
"""of lowering the barrier, tried one after the other"""


def turned(*legs: tuple[float, float]) -> Array:
    """(N, 2) mm: points reached from (0, 0) by legs of a turn to the left (degrees) and a length (mm)."""
    heading = np.radians(np.cumsum([turn for turn, _ in legs]))
    length = np.array([length for _, length in legs])
    return np.cumsum(length[:, None] * np.column_stack((np.cos(heading), np.sin(heading))), axis=0)


CASES = {
    "one corner of 45°": turned((0, LONG), (45, LONG)),
    "one corner of 90°": turned((0, LONG), (90, LONG)),
    "one corner of 135°": turned((0, LONG), (135, LONG)),
    "up 5 mm, between corners of 90°": turned((0, LONG), (90, 5.0), (-90, LONG)),
    "up 2.5 mm, between corners of 90°": turned((0, LONG), (90, 2.5), (-90, LONG)),
    "infill of 6 mm, 45° and 135°": turned(
        (0, LONG), (45, 6.0), (135, 6.0), (-135, 6.0), (135, 6.0), (0, LONG)
    ),
    "0.9 mm to the side, between corners of 63°": turned((0, LONG), (63, 0.9), (-63, LONG)),
    "0.8 mm between corners of 90°": turned((0, LONG), (90, 0.8), (90, LONG)),
}


@dataclass(frozen=True, slots=True)
class Row:
    """One case; times in s."""

    name: str
    free: float
    ours: float
    classic: float
    stops: float
    """s that starting and stopping take longer with a jerk limit"""


@dataclass(frozen=True, slots=True)
class Guess:
    """The planner's motion in a plane: (N,) s, and places, velocities and accelerations (N, 2)."""

    t: Array
    place: Array
    velocity: Array
    acceleration: Array

    @classmethod
    def of(cls, points: Array, limits: MotionLimits) -> "Guess":
        """Of a program through points (K, 2) mm."""
        profile, _ = machine()
        (run,) = planned_runs(read(profile, drawn_program(points, FEED)), limits, np.zeros(3))
        t = np.linspace(0.0, run.planned, SAMPLES)
        s, rate, change = (each[:, None] for each in run.plan_at(t))
        q, slope, bend, _ = (each[:, :2] for each in run.at(s[:, 0]))
        return cls(t, q, slope * rate, bend * rate**2 + slope * change)


class Problem:
    """The nonlinear program: states at the ends of steps of constant jerk, and one duration for each move."""

    def __init__(self, points: Array, limits: MotionLimits, guess: Guess) -> None:
        self._limits, self._guess = limits, guess
        self._drawn = np.vstack((np.zeros(2), points)) * MM
        self._vars, self._from, self._held = [], [], []
        self._scale = np.repeat([MM, limits.speed, limits.acceleration], 2)

    def duration(self) -> float:
        """s of the fastest motion found."""
        state, total = casadi.DM.zeros(6), 0
        corners = [self._nearest(corner) for corner in self._drawn[1:-1]]
        when = [0, *corners, SAMPLES - 1]
        for move, (first, last) in enumerate(pairwise(when)):
            lasting = self._variable(1, [self._guess.t[last] - self._guess.t[first]])
            total += lasting
            for step in range(STEPS):
                at = first + (last - first) * (step + 1) // STEPS
                state = self._step(state, lasting / STEPS, move, at)
            if move < len(corners):
                self._within(state[:2] * MM - self._drawn[move + 1], self._limits.deviation)
        end = np.concatenate((self._drawn[-1] / MM, np.zeros(4)))
        self._equal(state - end)
        return self._solved(total)

    def _nearest(self, corner: Array) -> int:
        return int(np.argmin(np.linalg.norm(self._guess.place - corner, axis=1)))

    def _step(self, state: casadi.SX, h: casadi.SX, move: int, at: int) -> casadi.SX:
        """The state after one step, within the limits, the move's speed and the tolerance."""
        jerk = self._variable(2, [0.0, 0.0])
        here = np.concatenate((self._guess.place[at], self._guess.velocity[at], self._guess.acceleration[at]))
        after = self._variable(6, here / self._scale)
        x, v, a = (state[i : i + 2] * self._scale[i] for i in (0, 2, 4))
        j = jerk * self._limits.jerk
        found = (x + h * (v + h * (a / 2 + h / 6 * j)), v + h * (a + h / 2 * j), a + h * j)
        self._equal(after - casadi.vertcat(*found) / self._scale)
        self._within(jerk, 1.0)
        self._within(after[2:4] * self._limits.speed, FEED * MM)
        self._within(after[4:6], 1.0)
        begin, end = self._drawn[move : move + 2]
        length = float(np.linalg.norm(end - begin))
        (cosine, sine), away = (end - begin) / length, after[:2] * MM - begin
        along, across = cosine * away[0] + sine * away[1], cosine * away[1] - sine * away[0]
        beyond = casadi.fmax(along - length, 0.0) + casadi.fmax(-along, 0.0)
        self._within(casadi.vertcat(beyond, across), self._limits.deviation)
        return after

    def _variable(self, count: int, begin: Array | list[float]) -> casadi.SX:
        found = casadi.SX.sym(f"x{len(self._vars)}", count)
        self._vars.append(found)
        self._from.extend(begin)
        return found

    def _equal(self, vector: casadi.SX) -> None:
        for each in casadi.vertsplit(vector):
            self._held.append((each, 0.0))

    def _within(self, vector: casadi.SX, radius: float) -> None:
        self._held.append((casadi.dot(vector, vector) / radius**2 - 1.0, -casadi.inf))

    def _solved(self, total: casadi.SX) -> float:
        variables, held = casadi.vertcat(*self._vars), casadi.vertcat(*(each for each, _ in self._held))
        problem = {"x": variables, "f": total, "g": held}
        for strategy in STRATEGIES:
            ipopt = {"print_level": 0, "sb": "yes", "max_iter": 1500, "tol": 1e-7, "mu_strategy": strategy}
            solver = casadi.nlpsol("free", "ipopt", problem, {"print_time": False, "ipopt": ipopt})
            answer = solver(x0=self._from, lbg=[least for _, least in self._held], ubg=0.0)
            if solver.stats()["success"]:
                return float(answer["f"])
        raise SystemExit(f"no free motion found: {solver.stats()['return_status']}")


def rows(count: int) -> Iterator[Row]:
    """The first cases, measured."""
    _, limits = machine()
    for name, points in list(CASES.items())[:count]:
        guess = Guess.of(points, limits)
        line = np.column_stack((np.vstack((np.zeros(2), points)), np.zeros(len(points) + 1))) * MM
        classic = trapezoids(Polyline(line, np.full(len(points), FEED * MM)), limits.acceleration, JUMP)
        free = Problem(points, limits, guess).duration()
        stops = limits.acceleration / limits.jerk
        yield Row(name, free, float(guess.t[-1]), classic.duration, stops)


def main() -> None:
    """Print the table, or one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="one corner")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    found = rows(SMOKE if options.smoke else len(CASES))
    if options.json:
        print(json.dumps([asdict(row) for row in found]))
        return
    print(
        "| moves of 30 mm at 60 mm/s, with | free s | ours s | classic s | stops s |\n|---|---|---|---|---|"
    )
    for row in found:
        print(
            f"| {row.name} | {row.free:.3f} | {row.ours:.3f} | {row.classic:.3f} | {row.stops:.3f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
