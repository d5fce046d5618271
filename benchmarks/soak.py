"""A print under an impatient operator and a bad power supply, with real processes over a serial CAN adapter.

    python benchmarks/soak.py --minutes 60          holds, overrides, faults, stops, kills, and resumes
    python benchmarks/soak.py --kills 200           nothing but kill -9, at any moment

The far side is a process of its own, and so is each host: ``cdhr stream``, then ``cdhr resume`` as often
as it takes. Keys are pressed at its terminal, drives trip, the emergency stop is pressed, hosts are killed.
At the end every setpoint that the far side executed is compared with the dry run: each millimetre of bead
laid once, or named: laid twice within the overlap that was told. Memory is measured all along.
"""

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from far_side import RECORD
from hosts import PATIENCE, FarSide, Host, LateError, environment, resident, tolerant, until
from laid import Bead, Seam

from cdhr_host.pipeline import open_profile
from cdhr_host.units import MM

RADIUS, LAYER, FEED = 60.0, 1.25, 1200
"""mm, mm, mm/min of the rings that are printed"""
DRIVES = 6
"""exit code of a host whose drives did not answer: it is started again"""
SETTLED = 20.0
"""s of a host's life from which on its memory is compared"""
LIFE = 30
"""seconds after that in which it must have lived on"""
HOURLY = {"hold": 40, "override": 40, "interrupt": 5, "fault": 4, "stop": 4, "kill": 7}
"""how often each happens"""


def rings(count):
    """A program: rings of short chords and arcs in turn, one above the other, and back to the middle."""
    chords = np.linspace(0.0, 2.0 * np.pi, 121)
    lines = ["G21", "G90", "M83", f"G0 Z{LAYER + 5:g} F3000", f"G0 X{RADIUS:g} Y0"]
    clay = 2.0 * np.pi * RADIUS * 5.0 * LAYER
    for layer in range(count):
        lines += [f";LAYER:{layer}", f"G0 Z{(layer + 1) * LAYER:.3f}"]
        if layer % 2:
            lines += [f"G3 X{-RADIUS:g} Y0 I{-RADIUS:g} J0 E{clay / 2:.4f} F{FEED}"]
            lines += [f"G3 X{RADIUS:g} Y0 I{RADIUS:g} J0 E{clay / 2:.4f}"]
        else:
            x, y = RADIUS * np.cos(chords[1:]), RADIUS * np.sin(chords[1:])
            lines += [f"G1 X{a:.4f} Y{b:.4f} E{clay / 120:.4f} F{FEED}" for a, b in zip(x, y, strict=True)]
    return "\n".join([*lines, f"G0 Z{count * LAYER + 20:g} F3000", "G28", ""])


@dataclass
class Tally:
    """What happened."""

    events: dict = field(default_factory=dict)
    prints: int = 0
    bead_mm: float = 0.0
    once_mm: float = 0.0
    skipped_mm: float = 0.0
    twice_mm: float = 0.0
    told_mm: float = 0.0
    beyond_mm: float = 0.0
    astray: int = 0
    astray_um: float = 0.0
    wrong: list = field(default_factory=list)
    seams: list = field(default_factory=list)
    reactions_ms: list = field(default_factory=list)
    """from the key to the first slower setpoint, of holds in a steady bead"""


class Memory(threading.Thread):
    """kB of the far side and of the host, each second."""

    def __init__(self, soak):
        super().__init__(daemon=True)
        self._soak, self.far, self.hosts = soak, [], {}

    def run(self):
        while True:
            time.sleep(1.0)
            now, host = time.monotonic(), self._soak.host
            if (far := resident(self._soak.far.process.pid)) is not None:
                self.far.append((now, far))
            if host is not None and now - host.began > SETTLED and (kb := host.resident) is not None:
                self.hosts.setdefault(host, []).append((now, kb))


def grown(hosts):
    """Of hosts that lived long enough, the greatest growth from their own first to last third, in percent."""
    lives = [[kb for _, kb in samples] for samples in hosts.values() if len(samples) >= LIFE]
    if not lives:
        return None
    thirds = [(np.median(kb[: len(kb) // 3]), np.median(kb[-(len(kb) // 3) :])) for kb in lives]
    mb = [round(float(np.median(kb)) / 1024, 1) for kb in lives]
    worst = max((last / first - 1.0 for first, last in thirds), key=abs)
    return {"hosts": len(lives), "mb": [min(mb), max(mb)], "growth_percent": round(100 * worst, 2)}


def growth(samples, parts=10):
    """Medians of tenths of the time, MB, and how far one is from their middle, in percent."""
    if len(samples) < 3 * parts:
        return None
    medians = [float(np.median([kb for _, kb in part])) for part in np.array_split(np.array(samples), parts)]
    middle = float(np.median(medians))
    spread = max(abs(each / middle - 1.0) for each in medians[1:])
    return {"mb": [round(each / 1024, 1) for each in medians], "spread_percent": round(100 * spread, 2)}


class Soak:
    """One far side, and the hosts that come and go before it."""

    def __init__(self, folder, asked):
        self.folder, self.random = folder, np.random.default_rng(asked.seed)
        self.profile = tolerant(folder, "paper", period_ms=asked.period)
        self.machine = open_profile(str(self.profile))
        self.file = folder / "rings.gcode"
        self.file.write_text(rings(asked.layers))
        self.bead = Bead(self.machine, iter([self.file.read_bytes()]))
        self.pause, self.weights = asked.pause, HOURLY
        self.most = asked.kills
        if asked.kills:
            self.weights = {"kill": 1}
        self.far, self.tally = FarSide(folder, self.profile, asked.bus), Tally()
        self.host, self.number, self.forks = None, 0, bool(asked.kills)
        self.memory = Memory(self)
        if not self.forks:
            self.memory.start()
        self.end = time.monotonic() + asked.minutes * 60.0

    @property
    def over(self):
        if self.most:
            return self.tally.events.get("kill", 0) >= self.most
        return time.monotonic() > self.end

    def run(self):
        while not self.over:
            self.one_print()
        return self.far.end()

    def one_print(self):
        """Until it is done; a time that is over ends it with Ctrl-C, and what is laid is judged."""
        first, seams, self.feed = self.far.written, [], 1.0
        fresh = "stream", self.file, "--profile", self.profile, "--drives", self.far.url
        self.start(*fresh)
        while (code := self.life()) != 0:
            if self.over and not self.most:
                break
            self.start("resume", "--drives", self.far.url)
            if (seam := self.host.seam()) is not None:
                seams.append(Seam(self.bead.begin(seam[0]), seam[1]))
            elif "begins it anew" in self.host.said and not seams:
                self.host.gone()
                self.start(*fresh)
            elif self.host.ended == DRIVES:
                self.tally.events["not opened"] = self.tally.events.get("not opened", 0) + 1
            else:
                raise SystemExit(f"no resume: {self.host.said}")
        self.judge(first, seams, whole=code == 0)
        self.tally.prints += 1
        print(json.dumps(self.summary(), default=str), file=sys.stderr, flush=True)
        if not self.over:
            self.home()

    def start(self, *arguments):
        self.number += 1
        self.host = Host(self.folder, self.number, [*arguments, "--yes"], forked=self.forks)
        self.host.begun(under_way=not self.most or self.random.random() < 0.7)

    def life(self):
        """One host, until it is gone; its exit code."""
        while self.host.ended is None:
            time.sleep(min(float(self.random.exponential(self.pause)), 4.0 * self.pause))
            if self.over and not self.most:
                self.interrupt()
            elif self.host.ended is None and self.host.journal.state != "done":
                what = str(self.random.choice(list(self.weights), p=self.shares))
                self.tally.events[what] = self.tally.events.get(what, 0) + 1
                self.happens(what)
        code = self.host.gone()
        self.say(code)
        return code

    def happens(self, what):
        """An event; one that nothing follows is a fault of ours, and the host is killed for it."""
        try:
            getattr(self, what)()
        except LateError as error:
            self.tally.wrong.append({"host": self.number, "hung": str(error)})
            self.kill()

    @property
    def shares(self):
        weights = np.array(list(self.weights.values()), dtype=float)
        return weights / weights.sum()

    def hold(self):
        pressed = time.monotonic()
        self.host.press(b" ")
        self.host.becomes("held", "done", "fault")
        if (waited := self.reaction(pressed)) is not None:
            self.tally.reactions_ms.append(round(1e3 * waited))
        time.sleep(float(self.random.uniform(0.0, 3.0)))
        if self.host.ended is None and self.host.journal.state == "held":
            self.host.press(b" ")

    def reaction(self, pressed):
        """s from a key to the first slower setpoint; None where the bead was not steady before."""
        size = RECORD.itemsize
        first = max(self.far.written // size - 5000, 0)
        record = np.fromfile(self.far.file, RECORD, offset=first * size)
        step = np.linalg.norm(np.diff(record["told"], axis=0), axis=1)
        at = record["at"][1:]
        before, after = step[(at > pressed - 0.5) & (at <= pressed)], at > pressed
        if not len(before) or before.min() < 0.98 * before.max() or not before.min():
            return None
        slower = np.flatnonzero(after & (step < 0.97 * before.min()))
        return float(at[slower[0]] - pressed) if len(slower) else None

    def override(self):
        wanted = float(self.random.uniform(0.6, 1.8))
        steps = round((wanted - self.feed) * 10)
        self.feed = round(self.feed + steps / 10, 1)
        self.host.press((b"+" if steps > 0 else b"-") * abs(steps))

    def interrupt(self):
        self.host.process.send_signal(signal.SIGINT)
        self.host.process.wait(PATIENCE)
        self.feed = 1.0

    def fault(self):
        self.far.say("fault")
        self.host.process.wait(PATIENCE)
        self.feed = 1.0

    def stop(self):
        self.far.say("stop")
        self.host.process.wait(PATIENCE)
        time.sleep(1.5)
        self.feed = 1.0

    def kill(self):
        self.host.process.kill()
        self.host.process.wait(PATIENCE)
        self.feed = 1.0

    def home(self):
        """By hand, with the part taken off: G28 by the console."""
        where = ["--profile", str(self.profile), "--drives", self.far.url]
        command = [sys.executable, "-m", "cdhr_host", "jog", *where]
        subprocess.run(command, input=b"G28\n", env=environment(), check=True, stdout=subprocess.DEVNULL)

    def judge(self, first, seams, *, whole):
        """The part of the record that is this print's."""
        until("the record", lambda: True if self.far.written > first else None)
        count = (self.far.written - first) // RECORD.itemsize
        record = np.fromfile(self.far.file, RECORD, count=count, offset=first)
        found = self.bead.judged(record, self.machine.canopen.position_unit, seams, whole=whole)
        tally = self.tally
        tally.bead_mm += (found.once + found.twice) / MM
        tally.once_mm += found.once / MM
        tally.skipped_mm += found.skipped / MM
        tally.twice_mm += found.twice / MM
        tally.beyond_mm += found.beyond / MM
        tally.told_mm += sum(seam.stated for seam in seams) / MM
        tally.astray += found.astray
        tally.astray_um = max(tally.astray_um, found.astray_m * 1e6)
        tally.seams += [(round(twice / MM, 2), round(stated / MM, 2)) for twice, stated in found.seams]
        if found.skipped or found.beyond or found.astray:
            tally.wrong.append({"print": tally.prints, "host": self.number, **asdict(found)})
            print(json.dumps(tally.wrong[-1]), file=sys.stderr, flush=True)

    def summary(self):
        """So far."""
        record = asdict(self.tally)
        return {
            **record,
            "seams": len(record["seams"]),
            "memory_far": growth(self.memory.far),
            "memory_hosts": grown(self.memory.hosts),
        }

    def say(self, code):
        minutes = (self.end - time.monotonic()) / 60.0
        events = " ".join(f"{what} {count}" for what, count in sorted(self.tally.events.items()))
        last = self.host.said.strip().splitlines()[-1:] if code not in (0, -9) else []
        text = f"{minutes:6.1f} min left, host {self.number} ended with {code}: {events} {last}"
        print(text, file=sys.stderr, flush=True)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--smoke", action="store_true", help="half a minute")
    options.add_argument("--minutes", type=float, default=60.0)
    options.add_argument("--kills", type=int, default=0, help="so many kill -9, and nothing else")
    options.add_argument("--bus", choices=("slcan", "link"), default="slcan")
    options.add_argument("--period", type=float, default=4.0, help="ms of a cycle of the drives")
    options.add_argument("--layers", type=int, default=100)
    options.add_argument("--pause", type=float, default=6.0, help="s between two events, on average")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--folder", type=Path, help="to keep what was written")
    asked = options.parse_args()
    if asked.smoke:
        asked.minutes, asked.layers, asked.pause = 0.5, 1, 3.0
    with tempfile.TemporaryDirectory() as folder:
        where = asked.folder or Path(folder)
        where.mkdir(parents=True, exist_ok=True)
        soak = Soak(where, asked)
        lost = soak.run()
    print(json.dumps({**soak.summary(), "cycles_guessed": lost}, indent=1))
    sys.exit(bool(soak.tally.wrong))


if __name__ == "__main__":
    main()
