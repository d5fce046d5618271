"""Against the classic scheme: print time, peak acceleration and peak jerk, side by side.

    python benchmarks/peers.py [FILE ...]     the shipped programs, and FILEs

Both planners get the same programs, speeds and acceleration (profile ``paper-wide``). The
baseline (trapezoids.py) is a constant-acceleration planner whose velocity jumps by up to
5 mm/s at junctions; ours has no jumps, and jerk limited to ten times the acceleration. Peaks
are finite differences of the nozzle's position at 1 kHz, the same for both.
"""

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from paths import machine, program_text, read, real_files
from scipy.optimize import brentq
from trapezoids import Polyline, Trapezoids, drawn, trapezoids

from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner
from cdhr_host.motion.sampling import Timeline
from cdhr_host.units import MM
from cdhr_host.values import Array, Command

JUMP = 5.0 * MM
"""m/s, the baseline's greatest change of velocity at a junction"""
PERIOD = 1e-3
"""s between the positions that are differenced"""
STRAIGHT = 1e-9
"""Directions that differ by less are one."""
BLOCK = 100_000
SMOKE_FILES = ("paper_eq35.gcode", "cura_tile_volumetric.gcode")


@dataclass(frozen=True, slots=True)
class Motion:
    """What a planner makes of a program."""

    time_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float


class Peaks:
    """Greatest finite differences of positions that come in blocks."""

    def __init__(self) -> None:
        self.acceleration, self.jerk = 0.0, 0.0
        self._tail = np.empty((0, 3))

    def see(self, position: Array) -> None:
        """(N, 3) m, the next positions."""
        seen = np.concatenate((self._tail, position))
        self._tail = seen[-3:].copy()
        if len(seen) > 3:
            second = np.diff(seen, n=2, axis=0) / PERIOD**2
            self.acceleration = max(self.acceleration, _largest(second))
            self.jerk = max(self.jerk, _largest(np.diff(second, axis=0) / PERIOD))

    def motion(self, time: float) -> Motion:
        """With the print time."""
        return Motion(time, self.acceleration / MM, self.jerk / MM)


def _largest(vectors: Array) -> float:
    return float(np.sqrt(np.einsum("nk,nk->n", vectors, vectors).max()))


def ours(commands: Iterable[Command], limits: MotionLimits) -> Motion:
    """The planner's own stretches, sampled on its own timeline."""
    planner, timeline, peaks, total = Planner(limits, np.zeros(3)), Timeline(PERIOD), Peaks(), 0.0
    for command in commands:
        for stretch in planner.stretches(command):
            total += stretch.duration
            for track in timeline.lay(stretch).tracks():
                peaks.see(track.position_G)
    for stretch in planner.close():
        total += stretch.duration
        for track in timeline.lay(stretch).tracks():
            peaks.see(track.position_G)
    for track in timeline.rest(planner.standing).tracks():
        peaks.see(track.position_G)
    return peaks.motion(total)


def baseline(commands: Iterable[Command], limits: MotionLimits) -> Motion:
    """The classic scheme on the drawn moves."""
    peaks, total = Peaks(), 0.0
    for part in drawn(commands, limits):
        if isinstance(part, Polyline):
            law = trapezoids(part, limits.acceleration, JUMP)
            for block in _sampled(law):
                peaks.see(block)
            total += law.duration
        else:
            total += part
    return peaks.motion(total)


def _sampled(law: Trapezoids) -> Iterator[Array]:
    """Positions every PERIOD, with the standstills before and after."""
    ticks = int(np.ceil(law.duration / PERIOD)) + 4
    for first in range(-3, ticks, BLOCK):
        t = PERIOD * np.arange(first, min(first + BLOCK, ticks))
        yield law.at(np.clip(t, 0.0, law.duration))


def stops_cost(commands: Iterable[Command], limits: MotionLimits) -> float:
    """s: by how much starting and stopping alone takes longer with the jerk limit than without.

    A straight line between two stops: exactly, for both fastest motions are known. Elsewhere from rest to a
    speed v, at best: at v at once the way would take half the time that it does.
    """
    total = 0.0
    for part in drawn(commands, limits):
        if isinstance(part, Polyline) and _straight(part):
            way, v = float(np.linalg.norm(part.points[-1] - part.points[0])), float(part.feed[0])
            total += sum(sign * _there(way, v, rise) for sign, rise in _both(limits))
        elif isinstance(part, Polyline):
            total += sum(
                sign * rise(v) / 2 for v in part.feed[[0, -1]].tolist() for sign, rise in _both(limits)
            )
    return total


def others_cost(commands: Iterable[Command], limits: MotionLimits) -> float:
    """s that the baseline loses beside starting and stopping: at corners, and where the feed changes.

    More cannot be won back, but for what a path that cuts corners is shorter.
    """
    total = 0.0
    for part in drawn(commands, limits):
        if isinstance(part, Polyline) and not _straight(part):
            feed, way = part.feed, np.linalg.norm(np.diff(part.points, axis=0), axis=1)
            total += trapezoids(part, limits.acceleration, JUMP).duration - float((way / feed).sum())
            total -= float(feed[0] + feed[-1]) / limits.acceleration / 2
    return total


Rise = Callable[[float], float]


def _both(limits: MotionLimits) -> tuple[tuple[int, Rise], tuple[int, Rise]]:
    """Time from rest to a speed, with the jerk limit (counted +1) and without (-1)."""
    a, j = limits.acceleration, limits.jerk
    return (1, lambda v: v / a + a / j if v * j > a * a else 2 * math.sqrt(v / j)), (-1, lambda v: v / a)


def _straight(part: Polyline) -> bool:
    """Whether it is one straight line at one speed."""
    steps = np.diff(part.points, axis=0)
    direction = steps / np.linalg.norm(steps, axis=1)[:, None]
    return bool((part.feed == part.feed[0]).all() and np.abs(direction - direction[0]).max() < STRAIGHT)


def _there(way: float, v: float, rise: Rise) -> float:
    """s from rest to rest over a way, at a speed up to v: each rise and fall to u takes u rise(u)/2."""
    if v * rise(v) > way:
        v = float(brentq(lambda u: u * rise(u) - way, 0.0, v, xtol=1e-15))
    return 2 * rise(v) + (way - v * rise(v)) / v


@dataclass(frozen=True, slots=True)
class Pair:
    """One program, planned both ways."""

    name: str
    baseline: Motion
    ours: Motion
    stops_s: float
    others_s: float

    @property
    def ratio(self) -> float:
        """Our time by the baseline's."""
        return self.ours.time_s / self.baseline.time_s

    def cells(self) -> list[str]:
        """As a row of the table."""
        a, b = self.baseline, self.ours
        times = [f"{a.time_s:.2f}", f"{b.time_s:.2f}", f"{self.ratio:.4f}"]
        peaks = [(a.acceleration_mm_s2, b.acceleration_mm_s2), (a.jerk_mm_s3, b.jerk_mm_s3)]
        return [
            self.name,
            *times,
            f"{self.stops_s:.2f}",
            f"{self.others_s:.2f}",
            *(f"{value:.0f}" for pair in peaks for value in pair),
        ]


def pairs(files: Iterable[Path]) -> Iterator[Pair]:
    """Every program, one after the other."""
    profile, limits = machine()
    for path in files:
        commands = read(profile, program_text(path))
        both = baseline(commands, limits), ours(commands, limits)
        yield Pair(path.name, *both, stops_cost(commands, limits), others_cost(commands, limits))


HEAD = (
    "| program | baseline s | ours s | ratio | stops s | others s | baseline peak mm/s² | ours "
    "| baseline peak mm/s³ | ours |\n|---|---|---|---|---|---|---|---|---|---|"
)


def main() -> None:
    """Print the table, or one JSON list."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, help="further programs, plain or .gz")
    parser.add_argument("--smoke", action="store_true", help="two small programs")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    files = [path for path in real_files() if not options.smoke or path.name in SMOKE_FILES] + options.files
    found = []
    print(HEAD, file=sys.stderr if options.json else sys.stdout)
    for pair in pairs(files):
        print(f"| {' | '.join(pair.cells())} |", file=sys.stderr if options.json else sys.stdout, flush=True)
        found.append(asdict(pair))
    if options.json:
        print(json.dumps(found))


if __name__ == "__main__":
    main()
