"""Objects of drives one by one, whatever is between host and drives."""

from collections.abc import Callable
from typing import Protocol

from cdhr_host.drives.address import port_of, split_rate
from cdhr_host.drives.bridge.line import BridgeLine
from cdhr_host.drives.bridge.objects import BridgeObjects
from cdhr_host.drives.canopen.bus import Bus
from cdhr_host.drives.clock import Clock


class ObjectAccess(Protocol):
    """Raises DriveError when a node is silent, ``canopen.bus.Abort`` when it refuses."""

    def nodes(self) -> list[int]:
        """Ids of the nodes that answer."""
        ...

    def upload(self, node: int, index: int, sub: int = 0) -> bytes:
        """The bytes of an object."""
        ...

    def read(self, node: int, index: int, sub: int = 0) -> int:
        """A number."""
        ...

    def write(self, node: int, index: int, sub: int, value: int, size: int | None = None) -> None:
        """Write a number; its size is the dictionary's unless given."""
        ...

    def until(self, done: Callable[[], bool], timeout: float) -> bool:
        """Listen until something is so, or ``timeout`` s are over; whether it is so."""
        ...

    def forget_fault(self) -> None:
        """Whatever stands between host and drives forgets its own fault."""
        ...

    def close(self) -> None:
        """Give the line back."""
        ...


def connect(url: str, clock: Clock) -> ObjectAccess:
    """The objects behind a drives URL; close it. Raises DriveError."""
    if url.partition(":")[0] == "link":
        path, baud = split_rate(url, "BAUD", 921_600)
        return BridgeObjects(clock, lambda: BridgeLine(path, baud))
    return Bus(port_of(url), clock)
