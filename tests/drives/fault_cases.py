"""Every fault of the drives' fault list, how it is injected, and what must come of it.

``python tests/drives/fault_cases.py`` runs them and writes docs/faults.md.
"""

import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
from bench import Bench, MemoryWire, PtyWire
from trajectories import run_of

from cdhr_host.drives import LinkState
from cdhr_host.drives.canopen.port import transport_fault
from cdhr_host.drives.rows import joined
from cdhr_host.drives.sim.drive import State
from cdhr_host.errors import DriveError
from cdhr_host.plant.disturbances import Slipped, Stuck

ZERO = np.zeros(6)
WALL = time.time
ROWS = run_of(800, seed=5)
SPOILT_AFTER = 200
"""ticks of undisturbed motion"""


@dataclass(frozen=True)
class Case:
    """A fault while the machine moves; ``kinds`` empty: it must go on as if nothing were."""

    row: str
    fault: str
    injected: str
    spoil: Callable
    kinds: tuple[str, ...] = ()
    wire: type = MemoryWire
    settings: dict = field(default_factory=dict)
    lost: int = 0
    """ticks the far side may have had to guess"""


@dataclass(frozen=True)
class Outcome:
    detected_ms: float | None
    kind: str
    reaction: str


def once(bench, wanted, becomes):
    """The next frame with a COB-ID in ``wanted`` becomes what ``becomes`` makes of it."""
    left = list(wanted)

    def inbound(frame):
        if frame[0] in left:
            left.remove(frame[0])
            return becomes(frame)
        return (frame,)

    bench.far.inbound = inbound


def several(bench, sets):
    once(bench, [0x200 + n for n in range(1, 7)] * sets, lambda frame: ())


def reorder(bench):
    kept = []

    def inbound(frame):
        if 0x201 <= frame[0] <= 0x206:
            kept.append(frame)
            if frame[0] == 0x206:
                found, kept[:] = kept[::-1], []
                return found
            return ()
        return (frame,)

    bench.far.inbound = inbound


def burst(bench):
    """The wire holds everything for two cycles, then delivers at once."""
    kept, start = [], bench.clock.now()

    def inbound(frame):
        if bench.clock.now() - start < 0.009:
            kept.append(frame)
            return ()
        found, kept[:] = [*kept, frame], []
        return found

    bench.far.inbound = inbound


def outbound(bench, cob, becomes):
    bench.far.outbound = lambda frame: becomes(frame) if frame[0] == cob else (frame,)


def noise(bench):
    os.write(bench.wire._fd, b"\xff\x00t18\r\at1818ZZ\rt18")
    os.write(bench.wire._fd, b"\r")


def encoder_jump(bench):
    bench.far.drives[3].shift += 1_000_000


def dead_sensor(bench):
    bench.far.coupler.overridden_inputs[1] = -32768


def no_air_input(bench):
    bench.far.coupler.values[0x6000, 1] = 1


def power_off(node):
    def spoil(bench):
        node(bench).powered = False

    return spoil


def mute(what):
    return lambda bench: bench.far.drives[1].mute.add(what)


def broken(text):
    def spoil(bench):
        bench.link.machine.bus.port.broken = transport_fault(text)

    return spoil


def stall(duration):
    """From the moment a cycle is due."""
    return lambda bench: bench.clock.wait_until(bench.link.due + duration)


def starve(bench):
    bench.starved = True


def clock_step(bench):
    time.time = lambda: WALL() - 3600.0


def drive_fault(code):
    return lambda bench: bench.far.drives[2].fault(code)


def attribute(name, value):
    def spoil(bench):
        setattr(bench.far.drives[4], name, value)

    return spoil


STOPS = ("axis-lost-enable", "emergency", "setpoint-late", "feedback-lost")
CASES = [
    Case("1 T", "one RPDO lost", "wire drops it", lambda b: once(b, [0x203], lambda f: ()), lost=1),
    Case("1 T", "one SYNC lost", "wire drops it", lambda b: once(b, [0x80], lambda f: ()), lost=1),
    Case(
        "2 T",
        "two sets of RPDOs not sent",
        "host stands still for two cycles",
        stall(0.009),
        ("setpoint-late",),
    ),
    Case("2 T", "six sets of RPDOs lost", "wire drops them", lambda b: several(b, 6), ("emergency",)),
    Case("3 T", "RPDO twice", "wire doubles it", lambda b: once(b, [0x202], lambda f: (f, f))),
    Case("3 T", "SYNC twice", "wire doubles it", lambda b: once(b, [0x80], lambda f: (f, f))),
    Case("4 T", "RPDOs in reverse order", "wire turns them", reorder),
    Case("4 T", "burst of stale frames", "wire holds all for 9 ms", burst, (), lost=2),
    Case("5 T", "noise, half lines, refusals", "bytes on the terminal", noise, wire=PtyWire),
    Case(
        "6 T",
        "bus-off",
        "adapter's status byte 80",
        lambda b: setattr(b.wire.adapter, "flags", 0x80),
        ("transport",),
        PtyWire,
    ),
    Case(
        "6 T",
        "transmit queue full",
        "ENOBUFS from the bus",
        broken("No buffer space available"),
        ("transport",),
    ),
    Case("7 T", "adapter unplugged", "terminal closed", lambda b: b.wire.unplug(), ("transport",), PtyWire),
    *(
        Case("8 N", f"drive fault {code:04X}", "EMCY and fault state", drive_fault(code), ("emergency",))
        for code in (0x2310, 0x3210, 0x4310, 0x7300, 0x8611)
    ),
    Case(
        "9 N",
        "following error",
        "slider stuck",
        lambda b: b.far.disturb(Stuck(1, 0)),
        ("following-error", "emergency"),
    ),
    Case("10 N", "heartbeat lost, TPDO alive", "node silenced", mute("heartbeat"), ("heartbeat",)),
    Case("10 N", "TPDO lost, heartbeat alive", "node silenced", mute("tpdo"), ("feedback-lost",)),
    Case(
        "11 N",
        "node resets while running",
        "power glitch",
        lambda b: b.far.drives[1].reset(b.clock.now()),
        ("node-reset", "feedback-lost", "axis-lost-enable"),
    ),
    Case(
        "15 N",
        "STO",
        "switch-on disabled unasked",
        lambda b: b.far.drives[0].drop(State.SWITCH_ON_DISABLED),
        ("axis-lost-enable",),
    ),
    Case(
        "15 N",
        "drop to ready",
        "ready to switch on unasked",
        lambda b: b.far.drives[0].drop(State.READY),
        ("axis-lost-enable",),
    ),
    Case(
        "17 N",
        "TPDO of wrong length",
        "wire shortens it",
        lambda b: outbound(b, 0x182, lambda f: ((f[0], f[1][:6]),)),
        ("feedback-length",),
    ),
    Case(
        "17 N",
        "TPDO without bit 12",
        "status word masked",
        attribute("status_mask", 0xEFFF),
        ("not-following",),
    ),
    Case("17 N", "internal limit, bit 11", "status word", attribute("status_extra", 0x800)),
    Case(
        "19 P",
        "stuck slider",
        "plant",
        lambda b: b.far.disturb(Stuck(4, 0)),
        ("following-error", "emergency"),
    ),
    Case(
        "19 P",
        "slipped coupling",
        "plant",
        lambda b: b.far.disturb(Slipped(4, 0, 2e-3)),
        ("following-error", "emergency"),
    ),
    Case(
        "19 P", "limit switch: torque off at the drive", "drive faults", drive_fault(0x8612), ("emergency",)
    ),
    Case("19 P", "encoder jump", "encoder", encoder_jump, ("encoder-jump", "following-error", "emergency")),
    Case(
        "20 P",
        "pressure does not follow",
        "air supply shut",
        lambda b: setattr(b.far, "air", False),
        ("pressure-deviation",),
    ),
    Case("20 P", "sensor open circuit", "input reads -32768", dead_sensor, ("pressure-sensor",)),
    Case("20 P", "air lost", "digital input", no_air_input, ("air-lost",)),
    Case("21 H", "sender stalls 10 ms", "no cycles", stall(0.010), ("setpoint-late",)),
    Case("21 H", "sender stalls 50 ms", "no cycles", stall(0.050), STOPS),
    Case("21 H", "sender stalls 250 ms", "no cycles", stall(0.250), STOPS),
    Case("21 H", "sender stalls 1000 ms", "no cycles", stall(1.0), STOPS),
    Case("22 H", "ring runs dry", "feeder stops feeding", starve, ("underrun",)),
    Case("23 H", "wall clock set back an hour", "time.time", clock_step),
    Case("25 I/O", "coupler lost", "power off", power_off(lambda b: b.far.coupler), ("heartbeat",)),
    Case(
        "26",
        "emergency stop while running",
        "pressed",
        lambda b: b.far.press(True),
        ("axis-lost-enable", "emergency-stop"),
    ),
]


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
    link, rows, parts, spoilt_at = bench.link, ROWS, [], None
    bench.starved = False
    link.arm(ZERO)
    try:
        while len(rows) or link.buffered:
            if len(rows) and not bench.starved:
                rows = rows[link.feed(rows) :]
            bench.user.wait_until(bench.clock.now() + 0.02)
            parts.append(link.feedback())
            if spoilt_at is None and sum(map(len, parts)) >= SPOILT_AFTER:
                spoilt_at = bench.clock.now()
                case.spoil(bench)
    except DriveError as found:
        return _stopped(case, bench, parts, found, bench.clock.now() - spoilt_at)
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
    """A second later: nothing moves, no air, nothing enabled, arming refused."""
    far = bench.far
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


def matrix():
    """The rows of docs/faults.md."""
    for case in CASES:
        outcome = run(case)
        after = "-" if outcome.detected_ms is None else f"{outcome.detected_ms:.0f} ms"
        cells = (case.row, case.fault, case.injected, after, outcome.kind, outcome.reaction)
        yield f"| {' | '.join(cells)} |"


HEADER = """# What goes wrong, and what happens then

Generated by `python tests/drives/fault_cases.py` from runs on the simulated drives; the same cases are
tests (`tests/drives/test_faults.py`). Each fault is injected in the middle of a printing motion. "Detected
after" is in machine time, in steps of 20 ms, the interval at which the test asks. After every fault the test
waits another second: nothing is enabled again, the air stays off, and arming is refused until the drives
have been closed and opened by the operator.

| # | fault | injected how | detected after | problem | reaction |
|---|---|---|---|---|---|
"""
FOOTER = """
Faults that keep the drives from being armed at all (12-14, 16, 18, 22, 25) are tests of the same file:
wrong identity, product or serial, swapped and duplicate node ids, every configuration write refused,
read-back that differs, SDO timeout, mode not adopted, transitions that hang, nodes that boot late or start
by themselves, 0x1019 or 0x6007 absent, coupler with other modules. The framed link's (5, 24) are in
`tests/drives/test_bridge.py`, dying processes (21) in `tests/drives/test_sender.py`.
"""

if __name__ == "__main__":
    target = Path(__file__).resolve().parents[2] / "docs" / "faults.md"
    target.write_text(HEADER + "\n".join(matrix()) + "\n" + FOOTER, encoding="utf-8")
    print(target)
