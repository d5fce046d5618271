"""Faults of the framed link and of the machine behind it while it prints."""

import random
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from bench import BridgeBench
from trajectories import PAPER, run_of

from cdhr_host.drives import LinkState
from cdhr_host.drives.bridge.frames import Frame, Type, encoded
from cdhr_host.drives.bridge.messages import SETPOINTS, tick
from cdhr_host.drives.canopen.port import transport_fault
from cdhr_host.drives.rows import joined
from cdhr_host.errors import DriveError
from cdhr_host.plant.disturbances import Stuck

ZERO = np.zeros(6)
ROWS = run_of(900, seed=5)


@dataclass(frozen=True)
class BridgeCase:
    """``kinds`` empty: it must go on as if nothing were."""

    row: str
    fault: str
    injected: str
    spoil: Callable
    kinds: tuple[str, ...] = ()


def garbled(side):
    def spoil(bench):
        chance = random.Random(3)

        def garble(data):
            if not data or chance.random() > 0.1:
                return data
            spoilt = bytearray(data)
            spoilt[chance.randrange(len(spoilt))] ^= 0x41
            return bytes(spoilt)

        setattr(bench, side, garble)

    return spoil


def lose(bench):
    """The next 300 bytes to the bridge are gone."""
    left = [300]

    def cut(data):
        gone = min(left[0], len(data))
        left[0] -= gone
        return data[gone:]

    bench.inbound = cut


def twice(bench):
    bench.inbound = lambda data: data + data


def sent(bench, start, shift, session=0):
    """SETPOINTS past the host's own checks: stored ticks, ``shift`` units beside."""
    store = bench.far.store
    rows = [store.ticks[min(max(start - store.tick, 0), len(store.ticks) - 1)]] * 2
    body = b"".join(tick(np.array(row[:6]) + shift, np.zeros(6, dtype=np.int64), 0.0) for row in rows)
    payload = SETPOINTS.pack(start, len(rows), 6, 0, 0) + body
    number = bench.link.session.number ^ session
    bench.far.exchange(bench.clock.now(), encoded(Frame(Type.SETPOINTS, 1, 0, number, payload)))


def gap(bench):
    sent(bench, bench.far.store.expected + 5, 0)


def overlap(bench):
    sent(bench, bench.far.store.tick + 20, 7)


def stale(bench):
    sent(bench, bench.far.store.expected, 0, session=1)


def violation(bench):
    sent(bench, bench.far.store.expected, 50_000)


def silent(bench):
    bench.clock.stall(0.3)


def starve(bench):
    bench.starved = True


def stuck(bench):
    motors = bench.far._motors
    motors._machine = type(motors._machine)(PAPER, Stuck(2, motors._outputs))


def press(bench):
    bench.far.estop = True


def press_in_a_hold(bench):
    bench.link.set_rate(0.0, 0.2)
    bench.user.wait_until(bench.clock.now() + 0.5)
    assert bench.link.held
    bench.spoilt_at = bench.clock.now()
    bench.far.estop = True


def late(bench):
    work, bench.clock.work = bench.clock.work, lambda now: None
    bench.clock.wait_until(bench.clock.now() + 0.02)
    bench.clock.work = work


def gone(bench):
    def broken(*_):
        raise transport_fault("the terminal is gone")

    bench.line.write = bench.line.read = broken


BRIDGE_CASES = [
    BridgeCase("5 T", "garbled bytes to the bridge", "one frame in ten", garbled("inbound")),
    BridgeCase("5 T", "garbled bytes to the host", "one frame in ten", garbled("outbound")),
    BridgeCase("24 B", "frames lost: a gap", "300 bytes dropped", lose),
    BridgeCase("24 B", "gap", "a frame five ticks too far", gap),
    BridgeCase("24 B", "every frame twice", "line doubles it", twice),
    BridgeCase("24 B", "stale session", "a frame of another session", stale),
    BridgeCase("24 B", "overlap with other content", "a stored tick, other numbers", overlap, ("overlap",)),
    BridgeCase("24 B", "tick beyond the limits", "a step of 5 mm", violation, ("step",)),
    BridgeCase("24 B", "underrun", "feeder stops feeding", starve, ("underrun",)),
    BridgeCase("24 B", "bridge late itself", "no outputs for 20 ms", late, ("setpoint-late",)),
    BridgeCase("7 T", "line unplugged", "terminal closed", gone, ("transport",)),
    BridgeCase("9 N", "following error", "slider stuck", stuck, ("following-error",)),
    BridgeCase("21 H", "host silent for 300 ms", "no frames", silent, ("link-lost",)),
    BridgeCase("26", "emergency stop while running", "pressed and released", press, ("emergency-stop",)),
    BridgeCase(
        "26", "emergency stop in a hold", "pressed and released", press_in_a_hold, ("emergency-stop",)
    ),
]


def run_bridge(case):
    """Print, spoil, see it through to rest and for two seconds more; ms to the problem, and its kind."""
    bench = BridgeBench()
    bench.starved = False
    bench.link.open()
    bench.link.arm(ZERO)
    rows, parts = ROWS, []
    bench.spoilt_at, found = None, None
    try:
        while len(rows) or bench.link.buffered:
            if len(rows) and not bench.starved:
                rows = rows[bench.link.feed(rows) :]
            bench.user.wait_until(bench.clock.now() + 0.01)
            parts.append(bench.link.feedback())
            if bench.spoilt_at is None and sum(map(len, parts)) >= 200:
                bench.spoilt_at = bench.clock.now()
                case.spoil(bench)
    except DriveError as error:
        found = error
    if found is not None:
        after, kind = 1e3 * (bench.clock.now() - bench.spoilt_at), found.problems[0].kind
        assert kind in case.kinds, f"{kind}: {found}"
        return after, kind, _rested(case, bench, parts)
    assert not case.kinds, f"nothing noticed {case.fault}"
    _as_planned(bench, len(ROWS))
    return None, "-", "goes on"


def _as_planned(bench, count):
    wanted = np.rint(ROWS.slider / bench.link.resolution).astype(int)
    assert (np.array(bench.far.received)[:count, :6] == wanted[:count]).all()


def _rested(case, bench, parts):
    """At rest, without air, and so it stays when the cause is over; what the far side did."""
    far = bench.far
    bench.inbound = bench.outbound = lambda data: data
    for _ in range(300):
        bench.clock.wait_until(bench.clock.now() + 0.01)
        bench.link.poll()
        parts.append(bench.link.feedback())
    played = len(far.received)
    far.estop = False
    bench.clock.stall(2.0)
    assert len(far.received) == played
    assert (far.state.name, far.air) == ("FAULT", 0)
    assert bench.link.state is LinkState.FAULT
    if "hold" in case.fault:
        return "stays at rest, air off"
    received = np.array(far.received)
    off = int(np.flatnonzero(received[50:, 6] == 0)[0]) + 50
    _as_planned(bench, off)
    stop = bench.link.stop_rows(ROWS[off:])
    wanted = np.rint(stop.slider / bench.link.resolution)
    assert (received[off:, :6] == wanted[: len(received) - off]).all()
    if case.row != "7 T":
        feedback = joined([part for part in parts if len(part)])
        assert (np.diff(feedback.tick) == 1).all()
    return "path-true stop, air off"
