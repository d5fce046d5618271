"""Nodes that are odd and well: they are armed all the same, and what is odd is noted."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from bench import Bench


@dataclass(frozen=True)
class Odd:
    """``note`` is how the bring-up's note begins; empty where there is nothing to note."""

    row: str
    fault: str
    injected: str
    spoil: Callable
    note: str = ""
    settings: dict = field(default_factory=dict)


def starts_by_itself(bench):
    bench.far.drives[0].autostart = True


def boots_late(bench):
    bench.far.drives[0].boot_delay = 4.0


def emergency_at_boot(bench):
    drive = bench.far.drives[2]
    plain = drive._booted
    drive._booted = lambda now: (plain(now), drive.emergency(0x8140))


def without(key):
    return lambda bench: bench.far.drives[3].dictionary.entries.pop(key)


def refuses_the_counter(bench):
    """It takes 0x1019 and answers SYNC with EMCY 0x8240."""
    drive = bench.far.drives[3]
    plain = drive.sync_accepted
    drive.sync_accepted = lambda data: plain(data[:0]) if not data else (drive.emergency(0x8240), False)[1]


ODD = [
    Odd("16 N", "starts OPERATIONAL by itself", "autostart", starts_by_itself),
    Odd("16 N", "boots late", "4 s after power", boots_late),
    Odd("16 N", "EMCY at boot", "0x8140", emergency_at_boot, "drive 3 sent EMCY 0x8140 at boot"),
    Odd(
        "18 N",
        "no 0x1019",
        "object absent",
        without((0x1019, 0)),
        "drive 4 has no 0x1019:00",
        {"sync_counter": True},
    ),
    Odd(
        "18 N",
        "SYNC with a counter rejected",
        "EMCY 0x8240",
        refuses_the_counter,
        "a node sent EMCY 0x8240",
        {"sync_counter": True},
    ),
    Odd(
        "18 N",
        "no 0x6007",
        "object absent, bench test passed",
        without((0x6007, 0)),
        "drive 4 has no 0x6007:00",
        {"link_loss_tested": True},
    ),
]


def tolerate(case):
    """Open and arm, without a counter in SYNC; what was noted."""
    bench = Bench(**case.settings)
    case.spoil(bench)
    bench.opened()
    try:
        notes = bench.link.notes
        assert notes[0].startswith(case.note) if case.note else not notes
        assert not bench.link.machine.found.sync_counter
        bench.link.arm(np.zeros(6))
        return notes[0] if notes else "-"
    finally:
        bench.close()
