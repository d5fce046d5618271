"""Every fault of the drives' fault list, how it is injected, and what must come of it."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from bench import MemoryWire, PtyWire
from trajectories import run_of

from cdhr_host.drives.canopen.port import transport_fault
from cdhr_host.drives.sim.drive import State
from cdhr_host.motion.hold import path_true_stop
from cdhr_host.plant.disturbances import Slipped, Stuck

ZERO = np.zeros(6)
WALL = time.time
ROWS = run_of(700, seed=5)
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


def delayed(late):
    """From now on the wire takes ``late`` s longer to the drives and as long back."""

    def spoil(bench):
        there, back = [], []
        plain, port = bench.far.exchange, bench.wire.port

        def work(now):
            there.append((now + late, port.sent))
            port.sent = []
            due = [frame for when, frames in there if when <= now + 1e-9 for frame in frames]
            there[:] = [entry for entry in there if entry[0] > now + 1e-9]
            back.append((now + late, plain(now, due)))
            port.arrived += [frame for when, frames in back if when <= now + 1e-9 for frame in frames]
            back[:] = [entry for entry in back if entry[0] > now + 1e-9]

        bench.wire.work = work

    return spoil


def hold_and_press(bench):
    """The print is held by a revision; the emergency stop is pressed while the machine stands."""
    first = bench.link.revisable
    bench.link.revise(path_true_stop(ROWS[first : first + bench.link.buffered], bench.profile))
    bench.starved = True
    bench.user.wait_until(bench.clock.now() + 2.0)
    assert bench.link.buffered == 0
    bench.link.feedback()
    bench.spoilt_at = bench.clock.now()
    bench.far.press(True)


def outbound(bench, cob, becomes):
    bench.far.outbound = lambda frame: becomes(frame) if frame[0] == cob else (frame,)


def noise(bench):
    bench.wire.say(b"\xff\x00t18\r\at1818ZZ\rt18")
    bench.wire.say(b"\r")


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
    Case("2 T", "two sets of RPDOs lost", "wire drops them", lambda b: several(b, 2), ("setpoint-late",)),
    Case("2 T", "six sets of RPDOs lost", "wire drops them", lambda b: several(b, 6), ("setpoint-late",)),
    Case("3 T", "RPDO twice", "wire doubles it", lambda b: once(b, [0x202], lambda f: (f, f))),
    Case("3 T", "SYNC twice", "wire doubles it", lambda b: once(b, [0x80], lambda f: (f, f))),
    Case("4 T", "RPDOs in reverse order", "wire turns them", reorder),
    Case("4 T", "burst of stale frames", "wire holds all for 9 ms", burst, (), lost=2),
    Case("4 T", "all frames 1 ms late", "wire delays", delayed(0.001)),
    Case("4 T", "all frames 3 ms late", "wire delays", delayed(0.003)),
    Case(
        "4 T",
        "all frames 10 ms late",
        "wire delays",
        delayed(0.010),
        ("setpoint-late", "feedback-lost"),
        lost=3,
    ),
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
        "error-passive",
        "adapter's status byte 20",
        lambda b: setattr(b.wire.adapter, "flags", 0x20),
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
    Case("26", "emergency stop in a hold", "pressed", hold_and_press, ("axis-lost-enable", "emergency-stop")),
]
