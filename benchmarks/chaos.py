"""Random holds, resumes and overrides of feed and flow in simulation, and what the machine then did.

    python benchmarks/chaos.py --count 10000

Programs are printed on the simulated drives while the operator's words come at random moments.
Every executed row is looked at: speed, acceleration and jerk of nozzle and sliders by finite
differences, forces against their windows, distance from the drawn path, clay laid line by line
against the dry run, and whether what was played at 100 % is the dry run's rows.
"""

import argparse
import json
import sys
import tempfile
import time
from concurrent.futures import Executor, Future
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from cdhr_host.drives.loopback import Loopback
from cdhr_host.errors import JobError
from cdhr_host.job.printer import Printer
from cdhr_host.job.program import ProgramFile, proven
from cdhr_host.job.surface import JobState
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.course import joined

NEIGHBOURS = 64
"""vertices whose chords are looked at: a curve may pass the same place often"""
APART = 1e-6
"""m of way between vertices; what is cut off where the path turns back is less"""
FINER = 10
"""ticks of the path the machine is compared with in one of the drives'"""
TURN = 0.02
"""s of machine time between two turns"""
OVERRIDES = (0.1, 0.25, 0.5, 0.8, 1.0, 1.0, 1.0, 1.3, 2.0, 3.0)
FLOWS = (0.5, 0.9, 1.0, 1.0, 1.1)
NAMES = tuple(f"{what} {of}" for what in ("nozzle", "slider") for of in ("speed", "acceleration", "jerk"))


class Clock:
    """Time passes by waiting only, and waiting takes no time."""

    speed = 1.0

    def __init__(self):
        self._now = 0.0

    def now(self):
        return self._now

    def wait_until(self, when):
        self._now = max(self._now, when)


class AtOnce(Executor):
    """Whatever is submitted is done at once."""

    def submit(self, task, /, *arguments, **named):
        done = Future()
        done.set_result(task(*arguments, **named))
        return done


@dataclass
class Figures:
    """Of one print, or of many."""

    events: int = 0
    ticks: int = 0
    same: int = 0
    """rows that are the dry run's, bit for bit"""
    worst: np.ndarray = field(default_factory=lambda: np.zeros(6))
    """greatest share of each limit in NAMES"""
    away: float = 0.0
    """m, greatest distance from the dry run's path"""
    margin: float = np.inf
    """N, least distance of a force from the ends of its window"""
    monotone: bool = True
    """whether no line was executed again after a later one"""
    clay: float = 0.0
    """greatest difference of a line's clay from the dry run's, in ticks of its flow; at 100 % flow only"""
    slowest: float = 0.0
    """s of processor time, the longest turn with a word in it"""

    def add(self, other):
        self.events += other.events
        self.ticks += other.ticks
        self.same += other.same
        self.worst = np.maximum(self.worst, other.worst)
        self.monotone = self.monotone and other.monotone
        self.away, self.clay = max(self.away, other.away), max(self.clay, other.clay)
        self.margin, self.slowest = min(self.margin, other.margin), max(self.slowest, other.slowest)

    def record(self):
        return {
            "events": self.events,
            "ticks": self.ticks,
            "rows_of_the_dry_run": self.same,
            "share_of_limits": dict(zip(NAMES, np.round(self.worst, 6).tolist(), strict=True)),
            "off_path_mm": self.away * 1e3,
            "force_margin_n": self.margin,
            "clay_off_ticks": self.clay,
            "lines_in_order": self.monotone,
            "slowest_word_s": self.slowest,
        }


def drawing(rng):
    """A program as nobody would write it: short moves, long ones, arcs, corners, travels, pauses for clay."""
    lines = ["G21", "G90", "M83", "G1 Z5 F3000"]
    at = np.zeros(2)
    for _ in range(int(rng.integers(6, 16))):
        feed, kind = rng.choice([600, 1800, 6000]), rng.random()
        if kind < 0.35:
            for _ in range(int(rng.integers(5, 40))):
                at = _inside(at + rng.normal(size=2) * rng.choice([0.5, 3.0, 15.0]))
                lines.append(f"G1 X{at[0]:.3f} Y{at[1]:.3f} E{rng.uniform(1, 30):.3f} F{feed}")
        elif kind < 0.6:
            radius = rng.uniform(2, 25)
            lines.append(f"G1 X{at[0]:.3f} Y{at[1]:.3f} F{feed}")
            lines.append(f"G3 X{at[0]:.3f} Y{at[1]:.3f} I{radius:.3f} J0 E{radius * 6:.3f}")
        elif kind < 0.8:
            at = _inside(rng.uniform(-60, 60, size=2))
            lines.append(f"G0 X{at[0]:.3f} Y{at[1]:.3f} F6000")
        else:
            lines.append(str(rng.choice(["G4 P200", "G1 E20 F600"])))
    return "\n".join([*lines, "G1 E0", "G28", ""])


def _inside(at):
    return at * min(1.0, 60.0 / max(float(np.linalg.norm(at)), 1e-9))


def chaotic(profile, path, rng, *, flows, spacing=1.0):
    """Print one file with words at random, ``flows`` among them; Figures, and the rows executed.

    Raises what the machine refuses.
    """
    clock = Clock()
    link = Loopback(profile, clock)
    link.open()
    printer = Printer(link, clock, executor=AtOnce())
    rows, figures = [], Figures()
    printer.observe(lambda batch, _: rows.append(batch))
    printer.adopt(proven(ProgramFile(path), profile))
    printer.start()
    due = clock.now() + rng.exponential(spacing)
    while printer.state not in {JobState.DONE, JobState.FAULT}:
        begun = time.process_time()
        said = clock.now() >= due and _say(printer, rng, flows=flows)
        printer.turn()
        if said:
            figures.events += 1
            figures.slowest = max(figures.slowest, time.process_time() - begun)
            due = clock.now() + rng.exponential(spacing)
        clock.wait_until(clock.now() + TURN)
    if printer.fault is not None:
        raise printer.fault
    executed = joined(rows)
    _judge(figures, executed, profile, path, flows=flows)
    return figures, executed


def _say(printer, rng, *, flows):
    """One word that is possible now; whether there was one."""
    kind = rng.random()
    if printer.state is JobState.HELD:
        if kind < 0.3:
            printer.override(feed=float(rng.choice(OVERRIDES)))
        else:
            printer.resume()
    elif printer.state in {JobState.PRINTING, JobState.RESUMING}:
        if kind < 0.4:
            printer.hold()
        elif kind < 0.9 or not flows:
            printer.override(feed=float(rng.choice(OVERRIDES)))
        else:
            with suppress(JobError):
                printer.override(flow=float(rng.choice(FLOWS)))
    else:
        return False
    return True


def _judge(figures, executed, profile, path, *, flows):
    """Everything that can be said of the rows that were executed."""
    period, forces = profile.drives.period, profile.forces
    dry, fine = (_dry(profile, path, rate) for rate in (1.0 / period, FINER / period))
    figures.ticks = len(executed)
    limits, sliders = profile.limits, profile.sliders
    shares = _demands(executed, period) / np.array(
        [
            limits.speed_max,
            limits.acceleration_max,
            limits.jerk_max,
            sliders.speed_max,
            sliders.acceleration_max,
            sliders.jerk_max,
        ]
    )
    figures.worst = shares
    low = np.array([forces.lower_min] * 3 + [forces.upper_min] * 3)
    high = np.array([forces.lower_max] * 3 + [forces.upper_max] * 3)
    figures.margin = float(min((executed.tension - low).min(), (high - executed.tension).min()))
    known = {row.tobytes() for row in dry.slider}
    figures.same = sum(row.tobytes() in known for row in executed.slider)
    figures.away = _away(executed.nozzle_G, fine.nozzle_G)
    figures.monotone = bool((np.diff(executed.line) >= 0).all())
    if not flows:
        figures.clay = _clay_off(executed, dry)


def _dry(profile, path, rate):
    """The dry run's rows at a rate in Hz."""
    return joined(
        [block for block in Staircase(profile, rate_hz=rate).setpoints([path.read_bytes()]) if len(block)]
    )


def _demands(rows, period):
    found, nozzle, slider = np.zeros(6), rows.nozzle_G, rows.slider
    for k in range(3):
        nozzle, slider = np.diff(nozzle, axis=0) / period, np.diff(slider, axis=0) / period
        found[k] = np.linalg.norm(nozzle, axis=1).max()
        found[3 + k] = np.abs(slider).max()
    return found


def _clay_off(executed, dry):
    """Greatest difference of the clay of a line from the dry run's, in ticks of the line's greatest flow."""
    lines = int(max(dry.line.max(), executed.line.max())) + 1
    laid = [np.bincount(rows.line, rows.flow, lines) for rows in (executed, dry)]
    most = np.zeros(lines)
    for rows in (executed, dry):
        np.maximum.at(most, rows.line, rows.flow)
    return float((np.abs(laid[0] - laid[1]) / np.maximum(most, 1e-15)).max())


def _away(points, curve):
    """Greatest distance of points from the chords about the vertices of a curve next to them."""
    curve = _thinned(curve)
    _, nearest = cKDTree(curve).query(points, k=NEIGHBOURS)
    best = np.full(len(points), np.inf)
    for near in nearest.T:
        for offset in (-1, 0):
            a = np.clip(near + offset, 0, len(curve) - 2)
            along, way = curve[a + 1] - curve[a], points - curve[a]
            share = np.clip(np.sum(way * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-300), 0, 1)
            best = np.minimum(best, np.linalg.norm(way - share[:, None] * along, axis=1))
    return float(best.max())


def _thinned(curve):
    """First vertex in every APART of a curve: where it rests or creeps, none hide its other passes."""
    way = np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))
    piece = np.floor(np.append(0.0, way) / APART)
    return curve[np.append(True, np.diff(piece) > 0)]


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--count", type=int, default=200, help="words")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--smoke", action="store_true", help="a few words only")
    arguments.add_argument("--profile", default="paper-wide")
    arguments.add_argument("--material", help="a clay whose air is led")
    asked = arguments.parse_args()
    if asked.smoke:
        asked.count = 10
    profile, total, seed, began = (
        open_profile(asked.profile, asked.material),
        Figures(),
        asked.seed,
        time.process_time(),
    )
    with tempfile.TemporaryDirectory() as folder:
        while total.events < asked.count:
            rng = np.random.default_rng(seed)
            path = Path(folder) / "drawing.gcode"
            path.write_text(drawing(rng))
            try:
                figures, _ = chaotic(profile, path, rng, flows=seed % 2 == 0)
            except Exception as error:
                path.rename(kept := Path(tempfile.gettempdir()) / f"chaos-{seed}.gcode")
                print(
                    json.dumps(
                        {"seed": seed, "program": str(kept), "error": f"{type(error).__name__}: {error}"}
                    )
                )
                raise
            total.add(figures)
            if total.worst.max() > 1.02 or figures.away > 1e-5:
                print(seed, figures.record(), file=sys.stderr)
            seed += 1
    print(
        json.dumps(
            {"prints": seed - asked.seed, "cpu_s": time.process_time() - began, **total.record()}, indent=2
        )
    )


if __name__ == "__main__":
    main()
