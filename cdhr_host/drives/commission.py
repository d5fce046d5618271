"""Looking at drives one by one, without a cycle: what an electrician needs."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cdhr_host.drives.access import ObjectAccess
from cdhr_host.drives.canopen.bus import COUPLER, NODES, Abort, check_number, node_name, object_name
from cdhr_host.drives.canopen.cia402 import DISABLE_VOLTAGE, FAULT_RESET, State, decoded
from cdhr_host.drives.canopen.emergencies import meaning
from cdhr_host.drives.canopen.verified import read, refused
from cdhr_host.drives.faults import fault
from cdhr_host.profile.schema import CanOpen

RESET: Final = 1.0
"""s a drive may take to leave its fault"""


@dataclass(frozen=True, slots=True)
class Node:
    """What answered to a node id."""

    id: int
    device_type: int
    vendor: int
    product: int
    serial: int

    @property
    def kind(self) -> str:
        """In words."""
        profile = self.device_type & 0xFFFF
        return {402: "servo drive (CiA 402)", 401: "coupler (CiA 401)"}.get(profile, f"CiA {profile}")


@dataclass(frozen=True, slots=True)
class AxisStatus:
    """One drive, at rest."""

    node: int
    state: State
    position: float
    """m, by the drive's own zero"""
    error: str
    mode: int


def scan(bus: ObjectAccess) -> list[Node]:
    """All nodes that answer."""
    return [_node(bus, node) for node in bus.nodes()]


def status(bus: ObjectAccess, settings: CanOpen) -> Iterator[AxisStatus]:
    """Each of the six drives."""
    for node in NODES[:6]:
        error = read(bus, node, 0x603F)
        yield AxisStatus(
            node,
            decoded(read(bus, node, 0x6041)),
            read(bus, node, 0x6064) * settings.position_unit,
            meaning(error) if error else "none",
            read(bus, node, 0x6061),
        )


def read_object(bus: ObjectAccess, node: int, index: int, sub: int) -> str:
    """``0x6065:00 Following error window = 10000 (0x2710)``; raises DriveError."""
    try:
        raw = bus.upload(node, index, sub)
        value = bus.read(node, index, sub) if len(raw) <= 4 else None
    except Abort as abort:
        raise refused(node, index, sub, f"cannot be read: {abort}") from abort
    name = object_name(node, index, sub)
    if value is None:
        return f"{name} = {raw.decode('ascii', 'replace')}"
    return f"{name} = {value} (0x{value & 0xFFFFFFFF:X})"


def write_object(bus: ObjectAccess, node: int, index: int, sub: int, value: int) -> str:
    """Write, then what is read back; raises DriveError."""
    check_number(node, index, sub, value)
    try:
        bus.write(node, index, sub, value)
    except Abort as abort:
        raise refused(node, index, sub, f"refuses {value}: {abort}") from abort
    return read_object(bus, node, index, sub)


def reset(bus: ObjectAccess, node: int) -> State:
    """Out of fault by a rising edge of bit 7, never further than switch-on disabled."""
    if node == COUPLER or node not in NODES:
        raise fault("node", f"{node_name(node)} is no drive")
    for word in (DISABLE_VOLTAGE, FAULT_RESET, DISABLE_VOLTAGE):
        bus.write(node, 0x6040, 0, word)
    left = bus.until(lambda: decoded(read(bus, node, 0x6041)) is not State.FAULT, RESET)
    if not left:
        error = meaning(read(bus, node, 0x603F))
        raise fault("drive-fault", f"{node_name(node)} stays in fault: {error}")
    bus.forget_fault()
    return decoded(read(bus, node, 0x6041))


def _node(bus: ObjectAccess, node: int) -> Node:
    identity = [read(bus, node, 0x1018, sub) for sub in (1, 2, 4)]
    return Node(node, read(bus, node, 0x1000), *identity)
