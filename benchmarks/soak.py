"""A print under an impatient operator and a bad power supply, compared with the dry run.

    python benchmarks/soak.py --minutes 60 --seed 1

For so many minutes of machine time the file is printed again and again on the simulated machine.
At random moments the print is held and resumed, its feed changed, stopped by the emergency stop, or
its host is killed; after the last two a new host takes it up from its journal, as ``cdhr resume`` does.
At the end every millimetre of bead the far side executed is compared with the dry run's: laid once, or
named: laid twice within the overlap that was stated. Memory is measured all along.
"""

import argparse
import json
import resource
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from cdhr_host.drives import LinkState, Loopback
from cdhr_host.drives.rows import joined
from cdhr_host.job.journal import read_journal
from cdhr_host.job.printer import Printer
from cdhr_host.job.program import Program, ProgramFile, proven
from cdhr_host.job.recorder import Names, Recorder
from cdhr_host.job.recovery import Resuming
from cdhr_host.job.surface import JobState
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.rig import Rig
from cdhr_host.profile import Profile
from cdhr_host.units import MM
from cdhr_host.values import Array, Feedback, Setpoints

ROOT = Path(__file__).resolve().parents[1]
OVERLAP = 2.0 * MM
TURN = 0.05
BIN = 3.0 * MM
FULL = 0.9
"""share of a bin's clay from which on it is laid"""


class Time:
    """Machine time that passes as fast as it can be computed."""

    speed = 1.0

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def wait_until(self, when: float) -> None:
        self._now = max(self._now, when)


@dataclass
class Tally:
    prints: int = 0
    holds: int = 0
    overrides: int = 0
    stops: int = 0
    kills: int = 0
    lost_ticks: int = 0
    stated: float = 0.0
    once: float = 0.0
    twice: float = 0.0
    skipped: float = 0.0
    memory: list[int] = field(default_factory=list)


class Soak:
    def __init__(self, profile: Profile, program: Program, folder: Path, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.rig = Rig.from_profile(profile)
        self.program, self.folder, self.profile = program, folder, profile
        self.clock, self.tally = Time(), Tally()
        self.plan = joined(
            [rows for rows in Staircase(profile).setpoints(program.file.chunks()) if len(rows)]
        )
        self.ticks = 0

    def run(self, until: float) -> None:
        while self.clock.now() < until:
            self.one_print()
            self.tally.memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
            print(f"{self.clock.now():8.0f} s  {self.tally.prints} prints", file=sys.stderr)

    def one_print(self) -> None:
        self.link = Loopback(self.profile, self.clock)
        self.laid: list[Setpoints] = []
        stated: list[float] = []
        printer = self.host()
        printer.adopt(self.program)
        printer.start()
        while not self.interrupted(printer):
            if printer.state is JobState.DONE:
                break
        while printer.state is not JobState.DONE:
            printer, overlap = self.taken_up()
            stated.append(overlap)
            while not self.interrupted(printer) and printer.state is not JobState.DONE:
                pass
        printer.close()
        self.link.close()
        self.tally.prints += 1
        self.compare(stated)

    def host(self) -> Printer:
        if self.link.state is LinkState.CLOSED:
            self.link.open()
        printer = Printer(self.link, self.clock, recorder=Recorder(self.link, Names("-"), self.folder))
        self.last = -1
        printer.observe(self.executed)
        return printer

    def executed(self, rows: Setpoints, _: Feedback) -> None:
        if self.last >= 0 and int(rows.tick[0]) > self.last + 1:
            self.tally.lost_ticks += int(rows.tick[0]) - self.last - 1
        self.last = int(rows.tick[-1])
        if (rows.flow > 0.0).any():
            self.laid.append(rows[rows.flow > 0.0])

    def interrupted(self, printer: Printer) -> bool:
        """Let time pass, then do something to it; whether its host is gone."""
        self.go(printer, float(self.random.exponential(6.0)))
        if printer.state is not JobState.PRINTING:
            return False
        match self.random.integers(0, 10):
            case 0 | 1 | 2 | 3:
                self.held(printer)
            case 4 | 5 | 6 | 7:
                printer.override(feed=float(self.random.uniform(0.2, 2.0)))
                self.tally.overrides += 1
            case 8:
                printer.emergency_stop("soak")
                self.go(printer, 3.0)
                self.tally.stops += 1
                self.gone(printer)
                return True
            case 9:
                self.tally.kills += 1
                self.gone(None)
                return True
        return False

    def held(self, printer: Printer) -> None:
        printer.hold("soak")
        while printer.state is JobState.HOLDING:
            self.go(printer, TURN)
        self.go(printer, float(self.random.uniform(0.0, 3.0)))
        if printer.state is JobState.HELD:
            printer.resume()
            self.tally.holds += 1

    def gone(self, printer: Printer | None) -> None:
        """The host ends without a word; the far side comes to rest by itself."""
        if printer is not None:
            printer.close()
        self.link.stop()
        while self.link.state is LinkState.STOPPING:
            self.clock.wait_until(self.clock.now() + TURN)
            self.link.feedback()
        self.link.close()

    def taken_up(self) -> tuple[Printer, float]:
        printer = self.host()
        journal = read_journal(max(self.folder.glob("*.journal")))
        way = Resuming(self.program, self.rig)
        found = way.found(journal, printer.status().nozzle_G, self.link.stop_rows, OVERLAP)
        printer.adopt(self.program)
        printer.recover(found, goes_on=str(journal.path))
        printer.turn()
        printer.resume()
        return printer, found.overlap

    def go(self, printer: Printer, seconds: float) -> None:
        end = self.clock.now() + seconds
        while self.clock.now() < end and printer.state is not JobState.DONE:
            printer.turn()
            self.clock.wait_until(self.clock.now() + TURN)

    def compare(self, stated: list[float]) -> None:
        """Volumes in each millimetre of the program's bead against those laid."""
        clay = self.plan.flow > 0.0
        steps = np.linalg.norm(np.diff(self.plan.nozzle_G, axis=0, prepend=self.plan.nozzle_G[:1]), axis=1)
        place = np.cumsum(np.where(clay, steps, 0.0))[clay]
        bins = (place / BIN).astype(np.int64)
        wanted = volumes(bins, self.plan.flow[clay], bins[-1] + 1)
        laid = joined(self.laid)
        nearest = KDTree(self.plan.nozzle_G[clay]).query(laid.nozzle_G)[1]
        got = volumes(bins[nearest], laid.flow, bins[-1] + 1)
        share = got / np.where(wanted > 0.0, wanted, 1.0)
        self.tally.once += float((share >= FULL).sum()) * BIN
        self.tally.skipped += float((share < FULL).sum()) * BIN
        self.tally.twice += float(np.maximum(share - 1.0, 0.0)[share > 1.1].sum()) * BIN
        self.tally.stated += sum(stated)


def volumes(bins: Array, flow: Array, count: int) -> Array:
    return np.bincount(bins, weights=flow, minlength=count)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--smoke", action="store_true", help="three minutes")
    options.add_argument("--minutes", type=float, default=60.0)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--file", type=Path, default=ROOT / "gcode" / "paper_ring_double.gcode")
    options.add_argument("--profile", default="paper")
    asked = options.parse_args()
    profile = open_profile(asked.profile)
    program = proven(ProgramFile(asked.file), profile)
    with tempfile.TemporaryDirectory() as folder:
        soak = Soak(profile, program, Path(folder), asked.seed)
        soak.run(180.0 if asked.smoke else asked.minutes * 60.0)
    tally = soak.tally
    half = len(tally.memory) // 2
    print(
        json.dumps(
            {
                "machine_minutes": round(soak.clock.now() / 60.0, 1),
                "prints": tally.prints,
                "holds": tally.holds,
                "overrides": tally.overrides,
                "emergency_stops": tally.stops,
                "kills": tally.kills,
                "lost_ticks": tally.lost_ticks,
                "bead_laid_mm": round(tally.once / MM),
                "bead_skipped_mm": round(tally.skipped / MM),
                "bead_twice_mm": round(tally.twice / MM, 1),
                "overlap_stated_mm": round(tally.stated / MM, 1),
                "memory_growth_percent": round(100.0 * (tally.memory[-1] / tally.memory[half] - 1.0), 1),
            },
            indent=1,
        )
    )


if __name__ == "__main__":
    main()
