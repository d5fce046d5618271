"""Runs the fault cases; ``python tests/drives/fault_runs.py`` writes docs/faults.md from them."""

import sys
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from bench import Bench
from bridge_cases import BRIDGE_CASES, run_bridge
from fault_cases import CASES, ROWS, SPOILT_AFTER, WALL, ZERO
from odd_cases import ODD, tolerate
from refusal_cases import BAD_ROWS, REFUSALS, refuse, reject
from trajectories import PERIOD

from cdhr_host.drives import LinkState
from cdhr_host.drives.rows import joined
from cdhr_host.errors import DriveError


@dataclass(frozen=True)
class Outcome:
    detected_ms: float | None
    kind: str
    reaction: str


def run(case):
    """Print, spoil, see it through to rest, and for a second more."""
    bench = Bench(wire=case.wire, **case.settings).opened()
    try:
        return _run(case, bench)
    finally:
        time.time = WALL
        bench.far.inbound = bench.far.outbound = lambda frame: (frame,)
        bench.close()


def _run(case, bench):
    link, rows, parts = bench.link, ROWS, []
    bench.starved, bench.spoilt_at = False, None
    link.arm(ZERO)
    try:
        while len(rows) or link.buffered:
            if len(rows) and not bench.starved:
                rows = rows[link.feed(rows) :]
            bench.user.wait_until(bench.clock.now() + (0.02 if bench.spoilt_at is None else PERIOD))
            parts.append(link.feedback())
            if bench.spoilt_at is None and sum(map(len, parts)) >= SPOILT_AFTER:
                bench.spoilt_at = bench.clock.now()
                case.spoil(bench)
    except DriveError as found:
        return _stopped(case, bench, parts, found, bench.clock.now() - bench.spoilt_at)
    assert not case.kinds, f"nothing noticed {case.fault}"
    assert bench.far.lost <= case.lost
    _in_order(bench, skips=case.lost, whole=True)
    link.stop()
    return Outcome(None, "-", "goes on" + ("; noted: " + link.notes[-1] if link.notes else ""))


def _stopped(case, bench, parts, found, after):
    link, kind = bench.link, found.problems[0].kind
    assert kind in case.kinds, f"{kind}: {found}"
    for _ in range(200):
        if link.state is LinkState.FAULT:
            break
        bench.user.wait_until(bench.clock.now() + 0.02)
        parts.append(link.feedback())
    assert link.state is LinkState.FAULT
    _at_rest_for_good(bench)
    rows = joined([part for part in parts if len(part)])
    assert (np.diff(rows.tick) == 1).all()
    reaction = "drives' own watchdogs stop, air off" if kind == "transport" else "path-true stop, air off"
    if link.stop_tick is not None:
        assert np.abs(np.diff(rows.setpoint[-2:], axis=0)).max() <= link.resolution
        _in_order(bench, skips=1000)
    return Outcome(1e3 * after, kind, reaction)


def _at_rest_for_good(bench):
    """A second later: nothing moves, no air, nothing enabled, arming refused, whatever is released."""
    far = bench.far
    if far.estop:
        far.press(False)
    bench.user.wait_until(bench.clock.now() + 1.0)
    bench.clock.stall(0.0)
    assert far.coupler.output == 0 or not far.coupler.powered
    assert far.resting
    assert not any(drive.following for drive in far.drives)
    try:
        bench.link.arm(ZERO)
    except DriveError:
        return
    raise AssertionError("armed again after a fault")


def _in_order(bench, skips, whole=False):
    """The far side played the planned rows once each, in order, but for ``skips``."""
    planned = [tuple(row) for row in np.rint(ROWS.slider / bench.link.resolution).astype(int).tolist()]
    at = skipped = 0
    for row in (tuple(row[:6]) for row in bench.far.received):
        ahead = planned[at : at + 3]
        if row in ahead:
            skipped += ahead.index(row)
            at += ahead.index(row) + 1
    assert skipped <= skips
    assert not whole or at == len(planned)


def table(heads, rows):
    """A table of the page."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"


def _after(milliseconds):
    return "-" if milliseconds is None else f"{milliseconds:.0f} ms"


def moving():
    """Faults of CANopen drives that move."""
    for case in CASES:
        outcome = run(case)
        yield case.row, case.fault, case.injected, _after(outcome.detected_ms), outcome.kind, outcome.reaction


def bridged():
    """Faults of the framed link."""
    for case in BRIDGE_CASES:
        after, kind, reaction = run_bridge(case)
        yield case.row, case.fault, case.injected, _after(after), kind, reaction


def refusals():
    """Faults that keep the machine from being opened or armed."""
    for case in REFUSALS:
        yield case.row, case.fault, case.injected, f"refused to {case.at}", refuse(case)
    for case in BAD_ROWS:
        yield "22 H", case.fault, "a row fed", "refused before the wire", reject(case)


def tolerated():
    """Odd nodes that are armed all the same."""
    for case in ODD:
        yield case.row, case.fault, case.injected, tolerate(case)


STOP = "path-true stop, air off, fault"
WATCHED = (
    ("a cable slack, by its force sensor", "slack_force_n", "force_settling_ms", "slack", STOP),
    ("cable force away from the plan", "force_deviation_n", "force_settling_ms", "force-deviation", STOP),
    ("motor torque away from the plan", "torque_deviation_nm", "force_settling_ms", "torque-deviation", STOP),
    (
        "following error in proportion to speed",
        "following_floor_mm, following_lag_ms",
        "following_settling_ms",
        "following-error",
        STOP,
    ),
    (
        "pressure away from its command",
        "pressure_deviation_kpa",
        "pressure_settling_ms",
        "pressure-deviation",
        "hold",
    ),
    ("the sender's cycles late too often", "late_share_percent", "10 s", "late", "hold"),
    ("no new setpoint although the link waits", "feeder_silence_s", "-", "feeder", "hold"),
    ("the journal's disk nearly full", "disk_free_mb", "-", "disk", "hold"),
)
"""what ``job.watchdogs`` looks for"""
HEADS = ["#", "fault", "injected how", "detected after", "problem", "reaction"]
PAGE = """# What goes wrong, and what happens then

Generated by `python tests/drives/fault_runs.py` from runs on the simulated drives; the same cases are
tests (`tests/drives/test_faults.py`). "Detected after" is in machine time, in cycles of 4 ms. After every
fault the test waits another second and releases what was pressed: nothing is enabled again, the air stays
off, and arming is refused until the drives have been closed and opened by the operator.

## While the machine moves: CANopen

{moving}
## While the machine moves: framed link

{bridged}
## Before anything moves

{refusals}
## Tolerated

Armed all the same, and noted; where one node refuses it, SYNC has no counter for anybody.

{tolerated}
## What the host watches

It knows the plan, so it sees what drives cannot. Thresholds are in `[watch]`; each is a test
(`tests/job/test_watchdogs.py`, `tests/job/test_records.py`), and a stop leaves a black box.

{watched}
## Processes that die

Host, sender and far side as real processes, killed, stopped, kept busy or unplugged (21, 7):
`tests/drives/test_processes.py`, `tests/drives/test_sender.py`, and a hundred times at random by
`python benchmarks/chaos_drives.py`. Figures: [drives](drives.md).
"""

if __name__ == "__main__":
    target = Path(__file__).resolve().parents[2] / "docs" / "faults.md"
    text = PAGE.format(
        moving=table(HEADS, moving()),
        bridged=table(HEADS, bridged()),
        watched=table(["fault", "threshold", "lasting", "problem", "reaction"], WATCHED),
        tolerated=table(["#", "oddity", "injected how", "noted"], tolerated()),
        refusals=table(["#", "fault", "injected how", "reaction", "said"], refusals()),
    )
    target.write_text(text, encoding="utf-8")
    print(target)
