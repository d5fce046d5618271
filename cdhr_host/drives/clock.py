"""Clocks: the only place that reads the time and sleeps."""

import math
import time
from typing import Final, Protocol

CATCH_UP: Final = 0.25
"""s of real time a paced clock makes good after its host was late; beyond that it slips"""


class Clock(Protocol):
    """Machine time, s, never going back."""

    @property
    def speed(self) -> float:
        """Seconds of this clock in one second of real time; infinite when waiting costs nothing."""
        ...

    def now(self) -> float:
        """S since some fixed moment."""
        ...

    def wait_until(self, when: float) -> None:
        """Return when ``now() >= when``."""
        ...


def _positive(speed: float) -> float:
    if not speed > 0.0:
        raise ValueError(f"a clock's speed must be positive, not {speed}")
    return speed


class MonotonicClock:
    """Real time, or real time sped up: goes on whatever the host does. For real drives."""

    def __init__(self, speed: float = 1.0) -> None:
        if math.isinf(speed):
            raise ValueError("only a paced clock can be infinitely fast")
        self.speed = _positive(speed)
        self._zero = time.monotonic()

    def now(self) -> float:
        """S since the clock was made."""
        return (time.monotonic() - self._zero) * self.speed

    def wait_until(self, when: float) -> None:
        """Sleep until ``when``."""
        while (left := when - self.now()) > 0.0:
            time.sleep(left / self.speed)


class PacedClock:
    """Simulated time: passes only while the host waits, never faster than ``speed``.

    A host that is late makes simulated time late instead of starving the simulated
    drives; ``slip`` says by how many real seconds so far. With an infinite speed waiting
    takes no time at all.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = _positive(speed)
        self.slip = 0.0
        self._now = 0.0
        self._real = time.monotonic()

    def now(self) -> float:
        """S of simulated time waited so far."""
        return self._now

    def wait_until(self, when: float) -> None:
        """Let simulated time pass until ``when``."""
        if when <= self._now:
            return
        due = self._real + (when - self._now) / self.speed
        self._now = when
        if math.isinf(self.speed):
            return
        late = time.monotonic() - due
        if late < 0.0:
            time.sleep(-late)
        slipped = max(late - CATCH_UP, 0.0)
        self.slip += slipped
        self._real = due + slipped
