"""Processes die at random moments of a print: does the machine always come to rest, without air, for good?

    python benchmarks/chaos_drives.py --trials 100

Each trial is three real processes (two over the framed link): a host that streams with the air on, the
sender, and ``cdhr sim`` in front of the simulated machine. One of them is killed, stopped for a while,
kept busy, or the line between them is pulled. The far side's trace says what the machine did then.
"""

import argparse
import json
import os
import random
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from cdhr_host.drives import MonotonicClock, make_link
from cdhr_host.errors import DriveError
from cdhr_host.job import stream
from cdhr_host.profile import find, read_table, validate
from cdhr_host.values import Setpoints

REPOSITORY = Path(__file__).resolve().parents[1]
TICKS = 2500
FAULTS = {
    "slcan": [
        ("host", "kill"),
        ("host", "stop"),
        ("host", "hog"),
        ("sender", "kill"),
        ("sender", "stop"),
        ("far", "kill"),
        ("far", "stop"),
        ("line", "unplug"),
    ],
    "link": [
        ("host", "kill"),
        ("host", "stop"),
        ("host", "hog"),
        ("far", "kill"),
        ("far", "stop"),
        ("line", "unplug"),
    ],
}
PAUSES = (0.3, 2.0, 6.0)
"""s between SIGSTOP and SIGCONT; a sender's ring lasts 4 s, a bridge's watchdog a quarter"""
BEGIN = 90.0
"""s a print may take to begin"""
BUSY = 10
"""times a print may fail to begin on a busy computer"""
QUIET = 1.5
"""s a machine is watched after it came to rest"""
STILL = 5
"""position units in a period below which a slider stands: 0.5 µm"""
REST = 0.5
"""s without motion after which it counts as rest"""
ON_PATH = 0.2e-3
"""m beside the planned curve that servo lag and rounding may explain"""
WATCHDOG = 0.35
"""s: 250 ms watchdog, 50 ms of the simulated drives' grace, some cycles"""


def machine():
    """The paper's machine, for a computer that does other things besides."""
    profile, _ = validate(read_table(find("paper")))
    settings = {"jitter_test": 0.1, "setpoint_watchdog": 0.1}
    return profile.model_copy(update={"canopen": profile.canopen.model_copy(update=settings)})


def planned(profile):
    """TICKS rows from rest to rest, air on but for the ends."""
    period, unit = profile.drives.period, np.ones(TICKS)
    tick = np.arange(TICKS)
    z = np.clip(tick / (TICKS - 2), 0.0, 1.0)
    s = z - np.sin(2 * np.pi * z) / (2 * np.pi)
    along = 0.02 * np.sin(2 * np.pi * 3 * s)[:, None]
    across = 0.02 * np.sin(2 * np.pi * 2 * s)[:, None]
    nozzle = np.hstack([along, across, 0.3 * along])
    air = np.full(TICKS, 80e3)
    air[:10] = air[-10:] = 0.0
    return Setpoints(
        tick=tick,
        t=tick * period,
        line=tick * 0 + 1,
        nozzle_G=nozzle,
        upper=nozzle.copy(),
        slider=np.hstack([nozzle, 0.5 * nozzle - along]),
        tension=6.0 * np.ones((TICKS, 6)),
        flow=0.0 * unit,
        pressure=air,
    )


def be_host(url):
    """Stream until the end or a fault; SIGUSR1 makes a second thread busy."""
    profile = machine()
    link = make_link(url, profile, MonotonicClock())
    signal.signal(signal.SIGUSR1, lambda _n, _f: threading.Thread(target=_busy, daemon=True).start())
    told = []

    def moving(_rows, _feedback):
        if not told:
            told.append(True)
            print(f"moving {getattr(link, 'pid', None) or 0}", flush=True)

    try:
        link.open()
        stream(iter([planned(profile)]), link, MonotonicClock(), start=np.zeros(6), on_rows=moving)
        print("done", flush=True)
    except DriveError as error:
        print(f"fault {error.problems[0].kind}", flush=True)
    finally:
        link.close()


def _busy():
    while True:
        pass


class NotBegunError(Exception):
    """A computer too busy to begin a print in BEGIN s, or to print undisturbed up to the event."""


@dataclass(frozen=True)
class Outcome:
    """What came of a trial."""

    bus: str
    victim: str
    how: str
    host: str
    """what the host said last; empty for a host that was killed"""
    rest_s: float | None = None
    """between the event and the last motion"""
    beside_mm: float | None = None
    """greatest distance from the planned curve after the event"""
    air_s: float | None = None
    """between the last setpoint of the plan and the end of the air command; at most 0 is at once"""
    again: bool = False
    """whether anything moved, or the air came on, after the machine had come to rest"""
    ended: bool = True
    """whether all processes of the host's side ended"""

    @property
    def verdict(self):
        """Empty where everything is as it must be."""
        alive = self.victim in ("host",) or self.bus == "link"
        wrong = []
        if self.again:
            wrong.append("restarted")
        if not self.ended:
            wrong.append("a process lives on")
        if self.rest_s is not None:
            if self.rest_s > 12.0:
                wrong.append(f"rest after {self.rest_s:.1f} s")
            if alive and self.beside_mm > ON_PATH * 1e3:
                wrong.append(f"{self.beside_mm:.2f} mm beside the path")
            if self.air_s > WATCHDOG:
                wrong.append(f"air {self.air_s:.2f} s too long")
        return ", ".join(wrong)


class Trial:
    """One print that is spoilt."""

    def __init__(self, bus, victim, how, timing, folder):
        self.bus, self.victim, self.how = bus, victim, how
        self.moment, self.pause = timing
        self.trace = Path(folder) / "trace.csv"
        command = [sys.executable, "-m", "cdhr_host", "sim", "--bus", bus, "--trace", str(self.trace)]
        self.far = subprocess.Popen(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True)
        if not (url := _line(self.far, BEGIN)):
            self.far.kill()
            raise NotBegunError("the far side did not start")
        command = [sys.executable, str(Path(__file__).resolve()), "--host", url]
        environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
        self.host = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)

    def run(self):
        """The trial's outcome."""
        try:
            return self._run()
        finally:
            for process in (self.host, self.far):
                if process.poll() is None:
                    process.send_signal(signal.SIGCONT)
                    process.kill()
                process.wait()
                process.stdout.close()

    def _run(self):
        word, _, sender = _line(self.host, BEGIN).partition(" ")
        if word != "moving":
            raise NotBegunError(word)
        self.sender = int(sender)
        if early := _line(self.host, self.moment):
            raise NotBegunError(early)
        event = time.monotonic()
        self._spoil()
        if self.how == "stop":
            time.sleep(self.pause)
            self._signal(signal.SIGCONT)
        said = self._last_words()
        ended = self._ended()
        time.sleep(QUIET)
        if self.victim == "far" and self.how == "kill":
            return Outcome(self.bus, self.victim, self.how, said, ended=ended)
        self.far.send_signal(signal.SIGTERM)
        self.far.wait(30.0)
        return self._judged(event, said, ended)

    def _spoil(self):
        numbers = {
            "kill": signal.SIGKILL,
            "stop": signal.SIGSTOP,
            "hog": signal.SIGUSR1,
            "unplug": signal.SIGUSR1,
        }
        self._signal(numbers[self.how])

    def _signal(self, number):
        pids = {"host": self.host.pid, "sender": self.sender, "far": self.far.pid, "line": self.far.pid}
        try:
            os.kill(pids[self.victim], number)
        except ProcessLookupError:
            return

    def _last_words(self):
        if self.victim == "host" and self.how == "kill":
            self.host.wait()
            return ""
        return _line(self.host, 60.0)

    def _ended(self):
        """Whether host and sender end by themselves."""
        deadline = time.monotonic() + 20.0
        while time.monotonic() < deadline:
            if self.host.poll() is not None and not _lives(self.sender):
                return True
            time.sleep(0.05)
        return False

    def _judged(self, event, said, ended):
        table = np.loadtxt(self.trace, delimiter=",", skiprows=1)
        at, position, air, fresh = table[:, 0], table[:, 1:7], table[:, 7], table[:, 8] > 0
        after = at > event
        settled, again = _settled(at, position, event + (self.pause if self._far_stopped else 0.0))
        plan = planned(machine()).slider / machine().canopen.position_unit
        return Outcome(
            self.bus,
            self.victim,
            self.how,
            said,
            rest_s=float(settled - event),
            beside_mm=float(_beside(position[after], plan) * 1e-4),
            air_s=float(at[air > 0].max() - at[fresh].max()),
            again=again or bool((at[air > 0] > settled + WATCHDOG).any()),
            ended=ended,
        )

    @property
    def _far_stopped(self):
        """The machine itself stood still in time, and moves on with it."""
        return self.victim == "far" and self.how == "stop"


def _settled(at, position, since):
    """When the machine had come to rest after a moment, and whether it moved again after that."""
    moved = at[1:][np.abs(np.diff(position, axis=0)).max(axis=1) > STILL]
    moved = np.concatenate([[since], moved[moved > since]])
    pauses = np.flatnonzero(np.diff(moved) > REST)
    return (moved[pauses[0]], True) if len(pauses) else (moved[-1], False)


def _beside(points, plan):
    """Greatest distance of (M, 6) points from the chords of the (N, 6) plan."""
    begin, along = plan[:-1], np.diff(plan, axis=0)
    square = np.maximum((along**2).sum(axis=1), 1e-12)
    worst = 0.0
    for point in points[:: max(1, len(points) // 400)]:
        share = np.clip(((point - begin) * along).sum(axis=1) / square, 0.0, 1.0)
        worst = max(worst, np.linalg.norm(begin + share[:, None] * along - point, axis=1).min())
    return worst


def _line(process, patience=40.0):
    if not select.select([process.stdout], [], [], patience)[0]:
        return ""
    return process.stdout.readline().strip()


def _lives(pid):
    if not pid:
        return False
    try:
        return not Path(f"/proc/{pid}/stat").read_text().rsplit(") ", 1)[1].startswith("Z")
    except FileNotFoundError:
        return False


def one(bus, victim, how, moment, pause):
    """The outcome of one trial."""
    with tempfile.TemporaryDirectory() as folder:
        return Trial(bus, victim, how, (moment, pause), folder).run()


def begun(*trial):
    """The outcome of a trial, tried again where the computer was too busy to begin it."""
    for _ in range(BUSY):
        try:
            return one(*trial)
        except NotBegunError as word:
            print(json.dumps({"not begun": str(word)}), flush=True)
    raise SystemExit("this computer is too busy")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--host", metavar="URL", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.host is not None:
        be_host(arguments.host)
        return
    chance = random.Random(arguments.seed)
    bad = 0
    for k in range(arguments.trials):
        bus = chance.choice(list(FAULTS))
        victim, how = chance.choice(FAULTS[bus])
        outcome = begun(bus, victim, how, chance.uniform(0.8, 4.0), chance.choice(PAUSES))
        bad += bool(outcome.verdict)
        print(
            json.dumps({"trial": k + 1, "verdict": outcome.verdict or "as it must be"} | asdict(outcome)),
            flush=True,
        )
    print(f"{arguments.trials} trials, {bad} not as they must be")
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
