"""Frames in batches over any bus of python-can."""

from collections.abc import Sequence
from typing import Protocol

import can

from cdhr_host.drives.slcan import BUS_ERROR, ERROR_PASSIVE, Frame, SlcanBus
from cdhr_host.errors import DriveError, Problem

ASK_EVERY = 10
"""receptions between two questions for an adapter's status"""


PASSIVE = "the controller is error-passive: nobody acknowledges its frames, or the bus is disturbed"


class Port(Protocol):
    """Where frames go in and out; raises DriveError of kind ``transport`` once it is unusable."""

    @property
    def trouble(self) -> str | None:
        """Why one should stop while frames still pass; None for a bus that is well."""
        ...

    def send(self, frames: Sequence[Frame]) -> None:
        """Send all, in order."""
        ...

    def receive(self) -> list[Frame]:
        """All that has arrived; never waits."""
        ...

    def close(self) -> None:
        """Give the bus back."""
        ...


def transport_fault(what: str) -> DriveError:
    """The bus is unusable."""
    return DriveError(
        Problem(
            "transport", what, hint="check the adapter, its cable and the bus; then open the drives again"
        )
    )


class SlcanPort:
    """A serial adapter."""

    def __init__(self, path: str, bitrate: int) -> None:
        try:
            self._bus = SlcanBus(path, bitrate)
        except can.CanError as error:
            raise transport_fault(str(error)) from error
        self._turn = 0
        self._rejected = 0

    @property
    def trouble(self) -> str | None:
        """An adapter that is error-passive."""
        return PASSIVE if self._bus.flags & ERROR_PASSIVE else None

    def send(self, frames: Sequence[Frame]) -> None:
        """One write for all."""
        try:
            self._bus.transmit(frames)
        except can.CanError as error:
            raise transport_fault(str(error)) from error

    def receive(self) -> list[Frame]:
        """One read for all; a bus-off or a refusing adapter is a fault."""
        try:
            frames = self._bus.receive()
            self._turn += 1
            if self._turn % ASK_EVERY == 0:
                self._check()
                self._bus.ask_status()
        except can.CanError as error:
            raise transport_fault(str(error)) from error
        return frames

    def close(self) -> None:
        """Close the channel."""
        self._bus.shutdown()

    def _check(self) -> None:
        refused, self._rejected = self._bus.rejected - self._rejected, self._bus.rejected
        if self._bus.flags & BUS_ERROR:
            raise transport_fault(f"the adapter reports bus errors (status 0x{self._bus.flags:02X})")
        if refused > ASK_EVERY:
            raise transport_fault(f"the adapter refused {refused} frames in {ASK_EVERY} cycles")


class CanPort:
    """Any other interface of python-can: ``socketcan``, ``virtual``, ..."""

    def __init__(self, interface: str, channel: str, bitrate: int | None = None) -> None:
        try:
            self._bus = can.Bus(interface=interface, channel=channel, bitrate=bitrate)
        except (can.CanError, OSError, ValueError) as error:
            raise transport_fault(f"cannot open {interface}:{channel}: {error}") from error
        self._turn = 0

    @property
    def trouble(self) -> str | None:
        """A controller that is error-passive, where the interface knows."""
        self._turn += 1
        return PASSIVE if self._turn % ASK_EVERY == 0 and self._state() is can.BusState.PASSIVE else None

    def _state(self) -> can.BusState:
        try:
            return self._bus.state
        except NotImplementedError:
            return can.BusState.ACTIVE

    def send(self, frames: Sequence[Frame]) -> None:
        """Send one by one."""
        try:
            for cob, data in frames:
                self._bus.send(can.Message(arbitration_id=cob, data=data, is_extended_id=False))
        except (can.CanError, OSError) as error:
            raise transport_fault(str(error)) from error

    def receive(self) -> list[Frame]:
        """All that has arrived; an error frame is a fault."""
        frames = []
        try:
            while (message := self._bus.recv(0.0)) is not None:
                if message.is_error_frame:
                    raise transport_fault(f"error frame {bytes(message.data).hex()} on the bus")
                frames.append((message.arbitration_id, bytes(message.data)))
        except (can.CanError, OSError) as error:
            raise transport_fault(str(error)) from error
        return frames

    def close(self) -> None:
        """Shut the interface down."""
        self._bus.shutdown()
