"""The slcan bus on real pseudo-terminals."""

import os
import select
import tty

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.drives.slcan import SlcanBus, decoded, encoded


class Adapter:
    """The other end of the line."""

    def __init__(self):
        self.fd, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self._slave = slave

    def read(self):
        return os.read(self.fd, 65536) if select.select([self.fd], [], [], 1.0)[0] else b""

    def write(self, data):
        os.write(self.fd, data)

    def vanish(self):
        os.close(self._slave)
        os.close(self.fd)
        self.fd = None


@pytest.fixture
def line():
    adapter = Adapter()
    bus = SlcanBus(adapter.path)
    assert adapter.read() == b"C\rS8\rO\r"
    yield adapter, bus
    bus.shutdown()
    if adapter.fd is not None:
        os.close(adapter.fd)
        os.close(adapter._slave)


def test_a_batch_is_one_piece_of_text(line):
    adapter, bus = line
    bus.transmit([(0x80, b""), (0x201, bytes(range(8)))])
    assert adapter.read() == b"t0800\rt20180001020304050607\r"


def test_frames_arrive_in_bulk_and_in_halves(line):
    adapter, bus = line
    adapter.write(b"t1812AABB\rt70110")
    assert bus.receive(1.0) == [(0x181, b"\xaa\xbb")]
    adapter.write(b"5\rz\rt0801")
    assert bus.receive(1.0) == [(0x701, b"\x05")]
    adapter.write(b"07\r")
    assert bus.receive(1.0) == [(0x80, b"\x07")]
    assert bus.receive() == []
    assert bus.dropped == 0


def test_noise_is_dropped_counted_and_left_behind_at_the_next_end(line):
    adapter, bus = line
    adapter.write(b"\xff\x00t18\rt1812AA\rt1812AAB\rt18129AABB\rtXYZ0\r\at1811AA\r" + b"q" * 100)
    assert bus.receive(1.0) == [(0x181, b"\xaa")]
    assert (bus.dropped, bus.rejected) == (6, 1)
    adapter.write(b"\rt1811BB\r")
    assert bus.receive(1.0) == [(0x181, b"\xbb")]


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), min_size=1, max_size=30))
def test_text_and_back(frames):
    lines = encoded(frames).split(b"\r")
    assert lines.pop() == b""
    assert [decoded(text) for text in lines] == frames


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=40))
def test_no_noise_breaks_the_reader(noise):
    frame = decoded(noise)
    assert frame is None or len(frame[1]) <= 8


def test_status_byte(line):
    adapter, bus = line
    bus.ask_status()
    assert adapter.read() == b"F\r"
    adapter.write(b"F8")
    bus.receive(1.0)
    adapter.write(b"4\rFzz\r")
    bus.receive(1.0)
    assert (bus.flags, bus.dropped) == (0x84, 1)


def test_dead_adapter_is_noticed_by_reading_alone(line):
    adapter, bus = line
    adapter.vanish()
    with pytest.raises(can.CanOperationError, match="is gone"):
        bus.receive(1.0)


def test_dead_adapter_is_noticed_by_writing_alone(line):
    adapter, bus = line
    adapter.vanish()
    with pytest.raises(can.CanOperationError, match="is gone"):
        bus.transmit([(0x80, b"")])


def test_full_adapter_is_a_fault_not_a_wait(line):
    _, bus = line
    with pytest.raises(can.CanOperationError, match="takes no more"):
        bus.transmit([(0x201, bytes(8))] * 60_000)


def test_second_host_is_refused(line):
    adapter, _ = line
    with pytest.raises(can.CanInitializationError, match="cannot open"):
        SlcanBus(adapter.path)


def test_bit_rates_of_the_protocol_only():
    with pytest.raises(can.CanInitializationError, match="123 is not one of"):
        SlcanBus("/dev/null", bitrate=123)


def test_missing_path_is_named():
    with pytest.raises(can.CanInitializationError, match="/dev/nowhere"):
        SlcanBus("/dev/nowhere")


def test_python_can_sends_and_receives(line):
    adapter, bus = line
    bus.send(can.Message(arbitration_id=0x123, data=b"\x01", is_extended_id=False))
    assert adapter.read() == b"t123101\r"
    adapter.write(b"t1230\rt1240\r")
    assert [bus.recv(1.0).arbitration_id, bus.recv(1.0).arbitration_id] == [0x123, 0x124]
    assert bus.recv(0) is None


@pytest.mark.parametrize("kind", ["is_extended_id", "is_remote_frame", "is_fd"])
def test_other_frames_are_refused(line, kind):
    _, bus = line
    with pytest.raises(can.CanOperationError, match="11-bit"):
        bus.send(can.Message(arbitration_id=1, **{"is_extended_id": False, kind: True}))
