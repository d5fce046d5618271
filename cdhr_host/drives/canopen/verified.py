"""Objects written and read back; a refusal names the object."""

from typing import Final, Protocol

from cdhr_host.drives.canopen.bus import Abort, Bus, node_name, object_name
from cdhr_host.errors import DriveError, Problem

NO_OBJECT: Final = 0x06020000
NO_SUB_INDEX: Final = 0x06090011
ABSENT: Final = (NO_OBJECT, NO_SUB_INDEX)


class ObjectReader(Protocol):
    """Who can read an object: the bus itself, or a bridge."""

    def read(self, node: int, index: int, sub: int = 0) -> int:
        """A number; raises Abort."""
        ...


def refused(node: int, index: int, sub: int, what: str, hint: str | None = None) -> DriveError:
    """A node is not as it must be; says which object."""
    return DriveError(
        Problem(
            "configuration",
            f"{node_name(node)}: {object_name(node, index, sub)} {what}",
            key=f"node{node}.0x{index:04X}:{sub:02X}",
            hint=hint or "compare the drive's manual and parameters with the profile's [canopen]",
        )
    )


def verified(
    bus: Bus,
    node: int,
    index: int,
    sub: int,
    value: int,
    *,
    mask: int = 0xFFFFFFFF,
    size: int | None = None,
) -> None:
    """Write, read back, compare; raises DriveError."""
    try:
        bus.write(node, index, sub, value, size)
    except Abort as abort:
        raise refused(node, index, sub, f"refuses {value}: {abort}") from abort
    found = read(bus, node, index, sub)
    if (found ^ value) & mask:
        raise refused(node, index, sub, f"reads back {found}, written was {value}")


def read(bus: ObjectReader, node: int, index: int, sub: int = 0) -> int:
    """Read; raises DriveError where the node refuses."""
    try:
        return bus.read(node, index, sub)
    except Abort as abort:
        raise refused(node, index, sub, f"cannot be read: {abort}") from abort


def optional(bus: Bus, node: int, index: int, sub: int, value: int) -> list[str]:
    """As ``verified`` where the object exists; a note where it does not."""
    try:
        bus.read(node, index, sub)
    except Abort as abort:
        if abort.code in ABSENT:
            return [f"{node_name(node)} has no {object_name(node, index, sub)}"]
    verified(bus, node, index, sub, value)
    return []
