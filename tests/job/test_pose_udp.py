"""Poses over UDP on the loopback interface."""

import socket
from collections.abc import Iterator

import numpy as np
import pytest

from cdhr_host.errors import JobError
from cdhr_host.job.pose_udp import LONGEST, UdpPose, datagram, parsed

AT = np.array([0.012345, -0.2, 0.1])
REFERENCE = np.array([0.0, 0.0, 0.05])


@pytest.fixture
def source() -> Iterator[UdpPose]:
    made = UdpPose(REFERENCE, port=0)
    yield made
    made.close()


def send(source: UdpPose, *datagrams: bytes) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for each in datagrams:
            out.sendto(each, ("127.0.0.1", source.port))


def test_what_is_sent_is_heard(source: UdpPose) -> None:
    assert source.latest(0.0) is None
    send(source, datagram(7, 0.02, AT))
    sample = source.latest(1.5)
    assert sample is not None
    assert (sample.frame, sample.t) == (7, pytest.approx(1.48))
    assert np.abs(sample.position - (AT - REFERENCE)).max() < 1e-9


def test_the_newest_frame_counts_and_stays(source: UdpPose) -> None:
    send(source, datagram(1, 0.0, AT), datagram(3, 0.0, AT), datagram(2, 0.0, AT))
    first = source.latest(1.0)
    assert first is not None
    assert first.frame == 3
    assert source.rejected == 1
    assert source.latest(2.0) is first


@pytest.mark.parametrize(
    "wrong",
    [
        b"",
        b"hello",
        b"cdhr-pose 2 1 0 0 0 0",
        b"cdhr-pose 1 1 0 0 0",
        b"cdhr-pose 1 one 0 0 0 0",
        b"cdhr-pose 1 1 0 nan 0 0",
        b"cdhr-pose 1 1 -5 0 0 0",
        b"cdhr-pose 1 -1 0 0 0 0",
        b"cdhr-pose 1 1 0 \xff 0 0",
        b"cdhr-pose 1 1 0 0 0 0" + b" " * LONGEST,
    ],
)
def test_anything_else_is_counted_and_changes_nothing(source: UdpPose, wrong: bytes) -> None:
    assert parsed(wrong) is None
    send(source, wrong, datagram(1, 0.0, AT))
    sample = source.latest(0.0)
    assert sample is not None
    assert sample.frame == 1
    assert source.rejected == 1


def test_a_port_that_is_taken_is_refused(source: UdpPose) -> None:
    with pytest.raises(JobError, match="cannot listen for poses"):
        UdpPose(REFERENCE, port=source.port)
