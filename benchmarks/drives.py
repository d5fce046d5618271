"""The cyclic sender on a pseudo-terminal: lateness, skipped cycles, CPU of the sender.

    python benchmarks/drives.py --minutes 30 --rate 250
    python benchmarks/drives.py --minutes 5 --rate 500
    python benchmarks/drives.py --stops 20 --rate 250

At 500 Hz the drives answer every fourth SYNC. Needs an otherwise idle machine and permission for
SCHED_FIFO. Beside the sender runs a bare timer loop of the same rate and higher priority: cycles
that it loses too were taken by the computer (the other guests of a hypervisor, ``stolen_s``), not
by the sender. ``--stops`` stops that many runs on the path, at random, and tells the lateness of
the cycles around each stop.
"""

import argparse
import gc
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from cdhr_host.drives import MonotonicClock
from cdhr_host.drives.sender import SenderLink
from cdhr_host.job import stream
from cdhr_host.profile import find, read_table, validate
from cdhr_host.values import Setpoints

REPOSITORY = Path(__file__).resolve().parents[1]
PRIORITY = 60
PATIENT = 200.0
"""ms the drives wait for a setpoint: what the computer takes away is to be measured, not to end the run"""
TICK = os.sysconf("SC_CLK_TCK")


def profile_at(hz, folder):
    """Path of a profile with this rate; at more than 250 Hz with reduced feedback."""
    text = find("paper").read_text(encoding="utf-8")
    text = text.replace("period_ms = 4.0", f"period_ms = {1e3 / hz:g}")
    text = text.replace("setpoint_watchdog_ms = 20.0", f"setpoint_watchdog_ms = {PATIENT:g}")
    if hz > 250:
        text = text.replace("feedback_every = 1", "feedback_every = 4")
    path = folder / "bench.toml"
    path.write_text(text, encoding="utf-8")
    return path


def rows(count, period):
    """A slow wave from rest to rest on all sliders, in batches."""
    duration = (count - 2) * period
    for first in range(0, count, 250):
        tick = np.arange(first, min(first + 250, count))
        z = np.clip(tick * period / duration, 0.0, 1.0)
        s = z - np.sin(2 * np.pi * z) / (2 * np.pi)
        turns = max(1, int(duration / 20.0))
        nozzle = 0.02 * np.sin(2 * np.pi * turns * s)[:, None] * np.array([1.0, 0.7, 0.4])
        slider = np.hstack([nozzle, -nozzle])
        size = len(tick)
        yield Setpoints(
            tick=tick,
            t=tick * period,
            line=np.ones(size, dtype=np.int64),
            nozzle_G=nozzle,
            upper=nozzle.copy(),
            slider=slider,
            tension=np.full((size, 6), 6.0),
            flow=np.zeros(size),
            pressure=np.zeros(size),
        )


def cpu(pid):
    """S of processor time of a process."""
    values = Path(f"/proc/{pid}/stat").read_text().rsplit(") ", 1)[1].split()
    return (int(values[11]) + int(values[12])) / TICK


@contextmanager
def opened(hz):
    """An open link to simulated drives, the profile, and where their report will be."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = profile_at(hz, folder)
        profile, _ = validate(read_table(path))
        record = folder / "received.csv"
        command = [sys.executable, "-m", "cdhr_host", "sim", "--profile", str(path), "--record", str(record)]
        far = subprocess.Popen(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True)
        url = far.stdout.readline().strip()
        link = SenderLink(url, profile, folder / "references.json")
        try:
            link.open()
            yield link, profile, far, record.with_suffix(".json")
        finally:
            ended(link, far)


def ended(link, far):
    """Close both sides; harmless when done already."""
    link.close()
    far.send_signal(signal.SIGTERM)
    far.wait()
    far.stdout.close()


def stolen():
    """S the hypervisor had this machine's processors for others."""
    return int(Path("/proc/stat").read_text().split("\n", 1)[0].split()[8]) / TICK


def bare(hz, pipe):
    """A loop of the same rate and a higher priority that does nothing: what this computer can at best."""
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY + 1))
    gc.freeze()
    gc.disable()
    period, late, skipped, worst = 1.0 / hz, 0.0, 0, 0.0
    due = time.monotonic() + period
    while not pipe.poll():
        time.sleep(max(due - time.monotonic(), 0.0))
        late = time.monotonic() - due
        worst = max(worst, late)
        lost = int(late / period)
        skipped += lost
        due += (1 + lost) * period
    pipe.send({"bare_max_ms": round(worst * 1e3, 3), "bare_skipped": skipped})


@contextmanager
def beside(hz, found):
    """A bare loop runs meanwhile; what it saw goes to ``found``."""
    context = multiprocessing.get_context("spawn")
    near, far = context.Pipe()
    process = context.Process(target=bare, args=(hz, far), daemon=True)
    process.start()
    before = stolen()
    yield
    found["stolen_s"] = round(stolen() - before, 2)
    near.send(None)
    found |= near.recv()
    process.join()


def stops(count, hz):
    """Runs that are stopped at random; a record."""
    chance, found, start = np.random.default_rng(1), [], np.zeros(6)
    with opened(hz) as (link, profile, _, _):
        for _ in range(count):
            timing, start = stopped(link, profile, start, chance.uniform(1.0, 2.0))
            found.append(timing)
    return {
        "hz": hz,
        "stops": count,
        "real_time": found[-1].real_time,
        "worst_p999_ms": round(max(timing.p999 for timing in found) * 1e3, 3),
        "worst_ms": round(max(timing.max for timing in found) * 1e3, 3),
        "skipped": sum(timing.skipped for timing in found),
    }


def stopped(link, profile, start, after):
    """A run from ``start`` that is stopped ``after`` s: its timing, and where it stands."""
    at, end = [start], time.monotonic() + after
    summary = stream(
        ahead(start, 4000, profile.drives.period),
        link,
        MonotonicClock(),
        start=start,
        on_rows=lambda executed, _: at.append(executed.slider[-1]),
        should_stop=lambda: time.monotonic() > end,
    )
    return summary.timing, at[-1]


def ahead(start, count, period):
    """``rows`` that begin where the sliders stand."""
    for batch in rows(count, period):
        yield replace(batch, slider=batch.slider + start)


def measure(seconds, hz):
    """One run; a record."""
    with opened(hz) as (link, profile, far, report):
        count = int(seconds * hz)
        before = cpu(link.pid)
        found = {}
        with beside(hz, found):
            summary = stream(rows(count, profile.drives.period), link, MonotonicClock(), start=np.zeros(6))
        used = cpu(link.pid) - before
        ended(link, far)
        timing = summary.timing
        return {
            "hz": hz,
            "cycles": timing.cycles,
            "real_time": timing.real_time,
            "p50_ms": round(timing.p50 * 1e3, 3),
            "p99_ms": round(timing.p99 * 1e3, 3),
            "p999_ms": round(timing.p999 * 1e3, 3),
            "max_ms": round(timing.max * 1e3, 3),
            "skipped": timing.skipped,
            "sender_cpu_percent": round(100 * used / summary.duration, 1),
            "lost_ticks": json.loads(report.read_text())["lost_ticks"],
            "load": round(os.getloadavg()[1], 1),
            **found,
        }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--rate", type=int, default=250, help="Hz")
    parser.add_argument("--stops", type=int, default=0)
    parser.add_argument("--smoke", action="store_true", help="three seconds")
    arguments = parser.parse_args()
    if arguments.stops:
        print(json.dumps(stops(arguments.stops, arguments.rate)))
    else:
        print(json.dumps(measure(3.0 if arguments.smoke else 60.0 * arguments.minutes, arguments.rate)))


if __name__ == "__main__":
    main()
