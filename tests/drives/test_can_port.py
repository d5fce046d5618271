"""Other interfaces of python-can, and what becomes of them when the bus is ill."""

import can
import pytest
from trajectories import PAPER

from cdhr_host.drives import make_link
from cdhr_host.drives.address import port_of
from cdhr_host.drives.canopen.port import ASK_EVERY, CanPort
from cdhr_host.errors import DriveError


@pytest.fixture
def pair():
    other = can.Bus(interface="virtual", channel="cdhr-test")
    port = port_of("virtual:cdhr-test")
    yield port, other
    port.close()
    other.shutdown()


def test_frames_pass_both_ways_over_virtual(pair):
    port, other = pair
    port.send([(0x201, b"\x01\x02"), (0x80, b"")])
    received = [other.recv(1.0) for _ in range(2)]
    assert [(m.arbitration_id, bytes(m.data), m.is_extended_id) for m in received] == [
        (0x201, b"\x01\x02", False),
        (0x80, b"", False),
    ]
    other.send(can.Message(arbitration_id=0x181, data=b"\x07", is_extended_id=False))
    frames = []
    while not frames:
        frames = port.receive()
    assert frames == [(0x181, b"\x07")]
    assert port.trouble is None


def test_error_frame_is_a_transport_fault(pair):
    port, other = pair
    other.send(can.Message(is_error_frame=True, data=b"\x00\x04"))
    with pytest.raises(DriveError, match="error frame 0004 on the bus") as caught:
        port.receive()
    assert caught.value.problems[0].kind == "transport"


def test_error_passive_is_trouble_while_frames_still_pass(pair, monkeypatch):
    port, _ = pair
    monkeypatch.setattr(type(port._bus), "state", can.BusState.PASSIVE)
    found = {port.trouble for _ in range(ASK_EVERY)}
    assert any(text is not None and "error-passive" in text for text in found)


def test_full_queue_is_a_fault_and_not_tried_again(pair, monkeypatch):
    port, _ = pair
    tried = []

    def full(message, timeout=None):
        tried.append(message)
        raise can.CanOperationError("No buffer space available")

    monkeypatch.setattr(port._bus, "send", full)
    with pytest.raises(DriveError, match="No buffer space available"):
        port.send([(0x201, b""), (0x202, b"")])
    assert len(tried) == 1


def test_absent_interface_is_refused_with_what_the_system_says():
    with pytest.raises(DriveError, match="cannot open socketcan:nowhere0") as caught:
        CanPort("socketcan", "nowhere0")
    assert caught.value.problems[0].hint.startswith("check the adapter")


def test_interface_without_channel_is_refused():
    with pytest.raises(DriveError, match="name no channel") as caught:
        port_of("socketcan:")
    assert caught.value.problems[0].hint == "socketcan:can0"


def test_any_interface_of_python_can_is_a_link():
    assert make_link("virtual:cdhr-test", PAPER, None).profile is PAPER
