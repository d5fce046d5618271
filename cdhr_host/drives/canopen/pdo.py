"""Writes PDO mappings in the order strict stacks demand, and reads every entry back."""

from dataclasses import dataclass
from typing import Final

from cdhr_host.drives.canopen.bus import COUPLER, NODES, Bus
from cdhr_host.drives.canopen.verified import optional, verified
from cdhr_host.profile.schema import CanOpen
from cdhr_host.units import MS

OFF: Final = 1 << 31
ON_CHANGE: Final = 255
EVENT_TIMER: Final = 5
INHIBIT: Final = 3


@dataclass(frozen=True, slots=True)
class Map:
    """One PDO of one node."""

    parameters: int
    """0x1400.. or 0x1800.."""
    cob: int
    type: int
    objects: tuple[tuple[int, int, int], ...]
    """index, sub-index, bits"""
    event_ms: int = 0
    inhibit_ms: int = 0

    @property
    def mapping(self) -> int:
        """0x1600.. or 0x1A00.."""
        return self.parameters + 0x200

    @property
    def bytes(self) -> int:
        """Length of the data."""
        return sum(bits for _, _, bits in self.objects) // 8


def drive_maps(node: int, settings: CanOpen) -> tuple[Map, ...]:
    """PDOs of an axis: control word, target, torque feed-forward; status word, position, torque; slow."""
    target = (0x607A, 0, 32) if settings.mode == "csp" else (0x60C1, 1, 32)
    watchdog = round(settings.setpoint_watchdog / MS)
    return (
        Map(0x1400, 0x200 + node, 1, ((0x6040, 0, 16), target, (0x60B2, 0, 16)), event_ms=watchdog),
        Map(
            0x1800, 0x180 + node, settings.feedback_every, ((0x6041, 0, 16), (0x6064, 0, 32), (0x6077, 0, 16))
        ),
        Map(
            0x1801,
            0x280 + node,
            ON_CHANGE,
            ((0x603F, 0, 16), (0x6061, 0, 8), (0x60FD, 0, 32)),
            event_ms=100,
            inhibit_ms=20,
        ),
    )


def coupler_maps(settings: CanOpen) -> tuple[Map, ...]:
    """PDOs of the coupler: pressure out, pressure and forces in, digital inputs."""
    outputs = tuple((0x6411, k, 16) for k in range(1, 5))
    inputs = tuple((0x6401, k, 16) for k in range(1, 5))
    return (
        Map(0x1401, 0x300 + COUPLER, 1, outputs),
        Map(0x1400, 0x200 + COUPLER, ON_CHANGE, ((0x6200, 1, 8),)),
        Map(0x1801, 0x280 + COUPLER, settings.feedback_every, inputs),
        Map(0x1800, 0x180 + COUPLER, ON_CHANGE, ((0x6000, 1, 8),), event_ms=100),
    )


def maps(node: int, settings: CanOpen) -> tuple[Map, ...]:
    """All PDOs of a node."""
    return coupler_maps(settings) if node == COUPLER else drive_maps(node, settings)


def all_maps(settings: CanOpen) -> dict[int, tuple[Map, ...]]:
    """Node -> its PDOs."""
    return {node: maps(node, settings) for node in NODES}


def write_map(bus: Bus, node: int, pdo: Map) -> list[str]:
    """Off, type, no entries, entries, their number, on; what an optional timer was refused by name."""
    notes: list[str] = []
    parameters, mapping = pdo.parameters, pdo.mapping
    bus_off = pdo.cob | OFF
    verified(bus, node, parameters, 1, bus_off, mask=OFF | 0x7FF)
    verified(bus, node, parameters, 2, pdo.type)
    verified(bus, node, mapping, 0, 0)
    for k, (index, sub, bits) in enumerate(pdo.objects, start=1):
        verified(bus, node, mapping, k, index << 16 | sub << 8 | bits)
    verified(bus, node, mapping, 0, len(pdo.objects))
    if pdo.inhibit_ms:
        notes += optional(bus, node, parameters, INHIBIT, 10 * pdo.inhibit_ms)
    if pdo.event_ms:
        notes += optional(bus, node, parameters, EVENT_TIMER, pdo.event_ms)
    verified(bus, node, parameters, 1, pdo.cob, mask=OFF | 0x7FF)
    return notes
