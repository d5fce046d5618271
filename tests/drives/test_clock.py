import itertools
import time

import pytest

from cdhr_host.drives import MonotonicClock, PacedClock
from cdhr_host.drives.clock import CATCH_UP


class FakeTime:
    """Stands in for the time module's clock and sleep."""

    def __init__(self, monkeypatch):
        self.now = 100.0
        self.slept = []
        monkeypatch.setattr(time, "monotonic", lambda: self.now)
        monkeypatch.setattr(time, "sleep", self._sleep)

    def _sleep(self, duration):
        self.slept.append(duration)
        self.now += duration


@pytest.fixture
def real(monkeypatch):
    return FakeTime(monkeypatch)


def test_monotonic_clock_goes_on_at_its_speed(real):
    clock = MonotonicClock(speed=20.0)
    real.now += 0.5
    assert clock.now() == pytest.approx(10.0)
    clock.wait_until(30.0)
    assert real.slept == [pytest.approx(1.0)]
    clock.wait_until(5.0)
    assert len(real.slept) == 1


def test_paced_clock_stands_while_the_host_works(real):
    clock = PacedClock(2.0)
    real.now += 5.0
    assert clock.now() == 0.0
    assert clock.slip == 0.0


def test_paced_clock_keeps_its_pace(real):
    clock = PacedClock(2.0)
    for k in range(1, 11):
        real.now += 0.01
        clock.wait_until(0.1 * k)
    assert clock.now() == pytest.approx(1.0)
    assert real.now == pytest.approx(100.5)
    assert clock.slip == 0.0


def test_late_host_slips_beyond_what_can_be_caught_up(real):
    clock = PacedClock(1.0)
    real.now += 3.0
    clock.wait_until(1.0)
    assert clock.slip == pytest.approx(2.0 - CATCH_UP)
    clock.wait_until(2.0)
    assert real.now == pytest.approx(103.0 + 1.0 - CATCH_UP)
    assert clock.slip == pytest.approx(2.0 - CATCH_UP)


def test_infinite_speed_never_sleeps(real):
    clock = PacedClock(float("inf"))
    for when in itertools.accumulate([10.0] * 5):
        clock.wait_until(when)
    clock.wait_until(1.0)
    assert clock.now() == 50.0
    assert real.slept == []


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_speeds_that_are_none_are_refused(speed):
    for kind in (MonotonicClock, PacedClock):
        with pytest.raises(ValueError, match="positive"):
            kind(speed)


def test_only_paced_clocks_may_be_infinitely_fast():
    with pytest.raises(ValueError, match="paced"):
        MonotonicClock(float("inf"))
