"""Poses over UDP: what a bridge to a motion capture system sends, and the ``PoseSource`` that hears it.

One datagram a frame, ASCII, fields separated by spaces:

    cdhr-pose 1 FRAME AGE_MS X_MM Y_MM Z_MM

``1`` is the version, FRAME a number that grows with every frame, AGE_MS how long ago the frame
was taken when it was sent (the system's own latency), X Y Z the nozzle in program coordinates.
A bridge of a few lines, for any SDK that calls back with a rigid body:

    def on_frame(frame, age_s, x, y, z):
        sock.sendto(f"cdhr-pose 1 {frame} {age_s * 1e3} {x} {y} {z}".encode(), ("127.0.0.1", 5801))

Anything else is counted in ``rejected`` and changes nothing.
"""

import math
import socket
from typing import Final

import numpy as np

from cdhr_host.control import PoseSample
from cdhr_host.errors import JobError, Problem
from cdhr_host.units import MM, MS
from cdhr_host.values import Array

WORD: Final = "cdhr-pose"
VERSION: Final = "1"
PORT: Final = 5801
LONGEST: Final = 512
"""bytes of a datagram that are looked at"""
MOST: Final = 10_000
"""datagrams taken in one call"""


class UdpPose:
    """A ``PoseSource`` on a loopback socket; it is read when asked, nothing runs in between."""

    def __init__(self, reference_G: Array, *, port: int = PORT, host: str = "127.0.0.1") -> None:
        """Port 0 takes a free one. Raises JobError when the port cannot be had."""
        self.rejected = 0
        self._reference_G = reference_G
        self._newest: PoseSample | None = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise JobError(
                Problem(
                    "pose",
                    f"cannot listen for poses on {host}:{port}: {error.strerror}",
                    hint="another program listens there; give another port",
                )
            ) from error
        self.port: int = self._socket.getsockname()[1]

    def latest(self, now: float) -> PoseSample | None:
        """The newest frame among all datagrams that have come; ``now`` is their time of arrival."""
        for _ in range(MOST):
            try:
                datagram = self._socket.recv(LONGEST + 1)
            except BlockingIOError:
                break
            self._take(datagram, now)
        return self._newest

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def _take(self, datagram: bytes, now: float) -> None:
        read = parsed(datagram)
        if read is None or (self._newest is not None and read[0] <= self._newest.frame):
            self.rejected += 1
            return
        frame, age, position_G = read
        self._newest = PoseSample(now - age, position_G - self._reference_G, frame)


def parsed(datagram: bytes) -> tuple[int, float, Array] | None:
    """Frame, age in s and (3,) m in program coordinates; None for anything that is no such datagram."""
    if len(datagram) > LONGEST:
        return None
    words = datagram.decode("ascii", errors="replace").split()
    if len(words) != 7 or words[:2] != [WORD, VERSION]:
        return None
    try:
        frame, numbers = int(words[2]), [float(word) for word in words[3:]]
    except ValueError:
        return None
    if frame < 0 or not all(math.isfinite(number) for number in numbers) or numbers[0] < 0.0:
        return None
    return frame, numbers[0] * MS, np.array(numbers[1:]) * MM


def datagram(frame: int, age: float, position_G: Array) -> bytes:
    """What a bridge sends: age in s, (3,) m in program coordinates."""
    numbers = " ".join(f"{value:.6f}" for value in (age / MS, *(position_G / MM).tolist()))
    return f"{WORD} {VERSION} {frame} {numbers}".encode("ascii")
