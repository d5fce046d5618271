"""Every fault that must keep the drives from being opened or armed, and the words that must say why."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from bench import Bench, BridgeBench
from trajectories import PAPER, changed, run_of

from cdhr_host.drives import LinkState
from cdhr_host.drives.bridge.messages import config
from cdhr_host.drives.sim.bridge import Bridge
from cdhr_host.drives.sim.drive import Drive, State
from cdhr_host.drives.sim.station import Station
from cdhr_host.errors import DriveError

ZERO = np.zeros(6)


@dataclass(frozen=True)
class Refusal:
    """A fault before anything moves; ``at`` says which call refuses it."""

    row: str
    fault: str
    injected: str
    spoil: Callable
    said: str
    at: str = "open"
    settings: dict = field(default_factory=dict)
    far: type | None = None


def fixed(node, key, value):
    return lambda bench: bench.far.nodes[node - 1].dictionary.fixed(key, value)


def several(*spoils):
    return lambda bench: [spoil(bench) for spoil in spoils]


def attribute(node, name, value):
    return lambda bench: setattr(bench.far.nodes[node - 1], name, value)


def altered(node, key, value):
    return lambda bench: bench.far.nodes[node - 1].sdo.altered.update({key: value})


def without(node, key):
    return lambda bench: bench.far.nodes[node - 1].dictionary.entries.pop(key)


def stubborn(node, state):
    return lambda bench: bench.far.nodes[node - 1].stubborn.add(state)


def refusing(bench):
    bench.far.drives[0].sdo.refused[0x6065, 0] = 0x08000022


def silent_sdo(bench):
    bench.far.drives[1].sdo.silent = True


def ignored_mode(bench):
    bench.far.drives[3].ignored_modes.add(8)


def faulted(bench):
    bench.far.drives[2].fault(0x2310)


def faults_when_enabled(bench):
    drive = bench.far.drives[2]
    plain = drive._control

    def control():
        plain()
        if drive.drive_state is State.SWITCHED_ON:
            drive.fault(0x3220)

    drive._control = control


class Twins(Station):
    @property
    def nodes(self):
        return [*super().nodes, self.__dict__.setdefault("twin", Drive(4, self.period))]


def other_config(bench):
    bench.far._config = config(PAPER)[:-1] + b"\xff"


def reboot(bench):
    bench.far = Bridge(PAPER, bench.clock.now())


def pressed(bench):
    bench.far.estop = True
    bench.user.wait_until(bench.clock.now() + 0.1)


IDENTITY = "the profile says"
REFUSALS = [
    Refusal("12 N", "vendor", "0x1018:01 = 0xDEAD", fixed(3, (0x1018, 1), 0xDEAD), "Vendor-ID is 0xDEAD"),
    Refusal("12 N", "product", "0x1018:02 = 7", fixed(3, (0x1018, 2), 7), "Product code is 0x7"),
    Refusal("12 N", "serial", "0x1018:04 = 9", fixed(3, (0x1018, 4), 9), "Serial number is 9"),
    Refusal("12 N", "no drive", "0x1000 = 401", fixed(3, (0x1000, 0), 0x191), "is not a CiA 402 device"),
    Refusal(
        "12 N",
        "node ids swapped",
        "serials of 1 and 2",
        several(fixed(1, (0x1018, 4), 102), fixed(2, (0x1018, 4), 101)),
        "Serial number is 102",
    ),
    Refusal("12 N", "a node id twice", "a second drive 4", lambda b: None, "answers twice", far=Twins),
    Refusal("12 N", "node missing", "power off", attribute(5, "powered", False), "no answer from drive 5"),
    Refusal("13 N", "SDO write refused", "abort 0x08000022", refusing, "0x6065:00 .*refuses"),
    Refusal("13 N", "read-back differs", "0x6065", altered(6, (0x6065, 0), 5), "reads back 5, written was"),
    Refusal("13 N", "SDO server silent", "no answer", silent_sdo, "drive 2 does not answer"),
    Refusal("14 N", "mode not adopted", "0x6061 stays 0", ignored_mode, "mode 8 was not adopted"),
    Refusal(
        "14 N", "no CSP", "0x6502 = 0x60", fixed(3, (0x6502, 0), 0x60), r"mode 8 \(csp\) is not supported"
    ),
    Refusal("8 N", "drive in fault", "2310 before arming", faulted, "0x2310", at="arm"),
    Refusal(
        "8 N", "drive faults while enabled", "3220 when switched on", faults_when_enabled, "0x3220", at="arm"
    ),
    Refusal(
        "15 N", "transition hangs", "ready", stubborn(6, State.READY), "drive 6 did not become", at="arm"
    ),
    Refusal(
        "19 P",
        "brake does not open",
        "bit 12 never comes",
        attribute(2, "status_mask", 0xEFFF),
        "drive 2 did not follow its target",
        at="arm",
    ),
    Refusal(
        "18 N",
        "no 0x6007",
        "object absent, no bench test",
        without(4, (0x6007, 0)),
        "drive 4 has no 0x6007:00 .*nothing is known",
    ),
    Refusal(
        "25 I/O", "error value not kept", "0x6443", altered(7, (0x6443, 1), 0), "reads back 0, written was 1"
    ),
    Refusal(
        "25 I/O", "other modules", "0x1000 = 0x30191", fixed(7, (0x1000, 0), 0x30191), "no analogue inputs"
    ),
    Refusal(
        "26", "emergency stop pressed", "before arming", lambda b: b.far.press(True), "drive 1", at="arm"
    ),
    Refusal("24 B", "other CONFIG stored", "its CRC", other_config, "does not arm", "arm", far=Bridge),
    Refusal("24 B", "bridge rebooted", "session lost", reboot, "does not arm", "arm", far=Bridge),
    Refusal("26", "emergency stop pressed", "at the bridge", pressed, "is pressed", "arm", far=Bridge),
]


def refuse(case):
    """Inject and be refused; the first words of the refusal."""
    bench = BridgeBench() if case.far is Bridge else Bench(far=case.far, **case.settings)
    if case.at == "open":
        case.spoil(bench)
        call = bench.link.open
    else:
        bench.link.open()
        case.spoil(bench)
        call = lambda: bench.link.arm(ZERO)  # noqa: E731 - what is expected to refuse
    with pytest.raises(DriveError, match=case.said) as caught:
        call()
    bench.user.wait_until(bench.clock.now() + 0.2)
    assert bench.link.state is (LinkState.CLOSED if case.at == "open" else LinkState.OPEN)
    if case.far is not Bridge:
        assert not any(drive.following for drive in bench.far.drives)
    bench.close()
    return re.sub(r"\s+", " ", str(caught.value))


@dataclass(frozen=True)
class Row:
    """Rows that must never reach the wire."""

    fault: str
    spoil: Callable
    said: str


def _spoilt(name, where, value):
    def spoil(rows):
        column = getattr(rows, name).copy()
        column[where] = value
        return changed(rows, **{name: column})

    return spoil


BAD_ROWS = [
    Row("a number that is none", _spoilt("slider", 57, np.nan), "not a finite number"),
    Row("tick out of order", _spoilt("tick", 21, 20), "tick 20 came where tick 21 is due"),
    Row("beyond the travel", _spoilt("slider", slice(100, None), 1.1), "beyond its travel"),
    Row("faster than a slider", _spoilt("slider", slice(100, None), 0.05), "a step of"),
    Row("pressure beyond the supply", _spoilt("pressure", 50, 1e6), "is not within 0 to"),
    Row("force beyond 0x60B2", _spoilt("tension", 50, 1e9), "does not fit 0x60B2"),
]


def reject(case):
    """Feed spoilt rows to an armed link; the words of the refusal, nothing of them on the wire."""
    bench = Bench().opened()
    bench.link.arm(ZERO)
    with pytest.raises(DriveError, match=case.said) as caught:
        bench.link.feed(case.spoil(run_of(200)))
    assert bench.link.buffered == 0
    bench.close()
    return str(caught.value)
