"""Streaming over the loopback: exact echo, summary, stops, errors while moving."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from trajectories import PAPER, PERIOD, ManualClock, changed, cut, loopback, run_of, setpoints

from cdhr_host.drives import LinkState, PacedClock
from cdhr_host.drives.loopback import Loopback
from cdhr_host.drives.rows import joined
from cdhr_host.errors import DriveError, JobError
from cdhr_host.job import stream
from cdhr_host.motion.hold import path_true_stop
from cdhr_host.plant.disturbances import Slipped, Stuck

ZERO = np.zeros(6)


class Seen:
    """An observer that keeps everything, as the run log does."""

    def __init__(self):
        self.rows, self.feedback = [], []

    def __call__(self, rows, feedback):
        assert (rows.tick == feedback.tick).all()
        self.rows.append(rows)
        self.feedback.append(feedback)

    def all(self):
        return joined(self.rows), joined(self.feedback)


class After:
    """True once ``ticks`` rows were seen."""

    def __init__(self, seen, ticks):
        self._seen, self._ticks = seen, ticks

    def __call__(self):
        return sum(map(len, self._seen.rows)) >= self._ticks


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(1, 700), min_size=1, max_size=6), st.sampled_from([1.0, 20.0, float("inf")]))
def test_log_equals_tick_by_tick_what_the_drives_received(sizes, speed):
    link, clock = loopback(speed)
    rows, seen = run_of(2000, seed=5), Seen()
    summary = stream(cut(rows, sizes), link, clock, start=ZERO, on_rows=seen)
    logged, feedback = seen.all()
    for name in ("tick", "t", "line", "nozzle_G", "upper", "slider", "tension", "flow", "pressure"):
        assert (getattr(logged, name) == getattr(rows, name)).all()
    assert (feedback.setpoint == rows.slider).all()
    assert (feedback.tick == rows.tick).all()
    assert summary.ticks == 2000
    assert not summary.interrupted
    assert link.state is LinkState.STOPPED


def test_summary_is_of_all_rows():
    link, clock = loopback()
    seen = Seen()
    summary = stream(cut(run_of(2000), [300]), link, clock, start=ZERO, on_rows=seen)
    rows, feedback = seen.all()
    away = np.abs(feedback.slider - rows.slider)
    assert summary.following_max == pytest.approx(away.max(axis=0))
    assert summary.following_rms == pytest.approx(np.sqrt(np.mean(away**2, axis=0)))
    assert summary.torque_max == pytest.approx(np.abs(feedback.torque).max(axis=0))
    assert summary.pressure_deviation_max == pytest.approx(np.abs(feedback.pressure - rows.pressure).max())
    assert summary.duration == pytest.approx(2000 * PERIOD)
    assert (summary.last_tick, summary.last_line) == (1999, rows.line[-1])


def test_nothing_to_stream():
    link, clock = loopback()
    summary = stream(iter([]), link, clock, start=ZERO)
    assert (summary.ticks, summary.last_tick, summary.last_line) == (0, None, None)
    assert link.state is LinkState.STOPPED


def test_segments_follow_each_other():
    link, clock = loopback()
    for first in (0, 1000):
        rows = run_of(1000, first_tick=first)
        assert stream(cut(rows, [256]), link, clock, start=rows.slider[0]).ticks == 1000


def test_empty_batches_are_passed_over():
    link, clock = loopback()
    rows = run_of(500)
    assert stream(iter([rows[:0], rows[:200], rows[:0], rows[200:]]), link, clock, start=ZERO).ticks == 500


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2500), st.sampled_from([1.0, 20.0]))
def test_interruption_stops_on_the_path_and_is_logged_to_the_end(ticks, speed):
    link, clock = loopback(speed)
    plan, seen = run_of(3000, seed=5), Seen()
    stop = After(seen, ticks)
    summary = stream(cut(plan, [400]), link, clock, start=ZERO, on_rows=seen, should_stop=stop)
    assert summary.interrupted
    assert link.state is LinkState.STOPPED
    if not seen.rows:
        return
    rows, feedback = seen.all()
    first = link.stop_tick
    assert (rows.slider[:first] == plan.slider[:first]).all()
    expected = path_true_stop(plan[first:], PAPER)
    assert (rows.nozzle_G[first:] == expected.nozzle_G).all()
    assert (feedback.setpoint == rows.slider).all()
    assert not rows.pressure[first:].any()
    assert (rows.slider[-1] == rows.slider[-2]).all()


def test_interruption_before_the_first_tick():
    link, clock = loopback()
    summary = stream(cut(run_of(500), [100]), link, clock, start=ZERO, should_stop=lambda: True)
    assert summary.interrupted
    assert summary.ticks == 0
    assert link.state is LinkState.STOPPED


def test_fault_is_raised_at_rest_with_the_stop_logged():
    link, clock = loopback(disturbance=Stuck(3, 500))
    plan, seen = run_of(3000, seed=5), Seen()
    with pytest.raises(DriveError, match=r"slider 4 is .* mm away from its setpoint at tick"):
        stream(cut(plan, [400]), link, clock, start=ZERO, on_rows=seen)
    assert link.state is LinkState.FAULT
    rows, _ = seen.all()
    assert (np.diff(rows.tick) == 1).all()
    assert rows.tick[-1] > link.stop_tick
    assert (rows.slider[-1] == rows.slider[-2]).all()


def test_fault_while_an_interruption_stops_is_raised():
    link, clock = loopback(disturbance=Slipped(0, 640, 2e-3))
    seen = Seen()
    with pytest.raises(DriveError, match=r"slider 1 is .* at tick 640 "):
        stream(
            cut(run_of(3000, seed=5), [400]),
            link,
            clock,
            start=ZERO,
            on_rows=seen,
            should_stop=After(seen, 600),
        )
    assert link.state is LinkState.FAULT
    assert seen.all()[0].tick[-1] > 640


def test_error_of_the_generator_is_raised_at_rest():
    def planned():
        yield run_of(3000)[:1500]
        raise ArithmeticError("cannot plan")

    link, clock = loopback()
    seen = Seen()
    with pytest.raises(ArithmeticError, match="cannot plan"):
        stream(planned(), link, clock, start=ZERO, on_rows=seen)
    assert link.state is LinkState.STOPPED
    assert link.stop_tick is not None
    rows, _ = seen.all()
    assert (rows.slider[-1] == rows.slider[-2]).all()


def test_error_of_the_observer_is_raised_at_rest():
    link, clock = loopback()
    calls = []

    def full(rows, feedback):
        calls.append(rows)
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        stream(cut(run_of(3000), [400]), link, clock, start=ZERO, on_rows=full)
    assert link.state is LinkState.STOPPED
    assert len(calls) > 1


def test_keyboard_interrupt_out_of_the_planner_stops_too():
    def planned():
        yield run_of(3000)[:1500]
        raise KeyboardInterrupt

    link, clock = loopback()
    with pytest.raises(KeyboardInterrupt):
        stream(planned(), link, clock, start=ZERO)
    assert link.state is LinkState.STOPPED


@pytest.mark.parametrize("count", [1, 40, 1500])
def test_setpoints_that_end_while_moving_are_refused_at_rest(count):
    link, clock = loopback()
    rows = run_of(3000)[700:]
    rows = changed(rows, tick=rows.tick - 700, slider=rows.slider - rows.slider[0] + 2e-5)
    with pytest.raises(JobError, match="end while the machine is"):
        stream(cut(rows[:count], [400]), link, clock, start=ZERO)
    assert link.state is LinkState.STOPPED


def test_setpoints_that_end_with_the_air_on_are_refused_at_rest():
    link, clock = loopback()
    rows = setpoints(np.zeros((300, 3)))[:-10]
    with pytest.raises(JobError, match="with the air on"):
        stream(cut(rows, [100]), link, clock, start=ZERO)
    assert link.state is LinkState.STOPPED


def test_wrong_start_is_refused_before_anything_is_planned():
    link, clock = loopback()

    def planned():
        raise AssertionError("planned in vain")
        yield

    with pytest.raises(DriveError, match="stands at"):
        stream(planned(), link, clock, start=np.full(6, 0.01))
    assert link.state is LinkState.OPEN


class Garbling(Loopback):
    """A far side that receives something else."""

    def feedback(self):
        rows = super().feedback()
        if len(rows) and rows.tick[-1] >= 700:
            setpoint = rows.setpoint.copy()
            setpoint[-1, 2] += 1e-9
            return changed(rows, setpoint=setpoint)
        return rows


class Repeating(Loopback):
    """A far side that reports rows twice."""

    def feedback(self):
        rows = super().feedback()
        return joined([rows] * 50) if len(rows) else rows


@pytest.mark.parametrize(
    ("kind", "said"),
    [(Garbling, r"executed slider 3 = .* at tick \d+, sent was"), (Repeating, "more rows than were sent")],
)
def test_far_side_that_got_something_else_is_an_error(kind, said):
    clock = ManualClock()
    link = kind(PAPER, clock)
    link.open()
    with pytest.raises(DriveError, match=said):
        stream(cut(run_of(3000), [400]), link, clock, start=ZERO)
    assert link.state is LinkState.STOPPED


class SlowHost:
    """Real time in which every batch takes the planner ten seconds."""

    def __init__(self, monkeypatch):
        self.now = 0.0
        monkeypatch.setattr(time, "monotonic", lambda: self.now)
        monkeypatch.setattr(time, "sleep", self.pass_by)

    def pass_by(self, duration):
        self.now += duration

    def plan(self, batches):
        for batch in batches:
            self.now += 10.0
            yield batch


def test_slow_planner_does_not_starve_a_paced_machine(monkeypatch):
    host = SlowHost(monkeypatch)
    clock = PacedClock(1.0)
    link = Loopback(PAPER, clock)
    link.open()
    summary = stream(host.plan(cut(run_of(2000), [250])), link, clock, start=ZERO)
    assert summary.ticks == 2000
    assert clock.slip == pytest.approx(80.0, abs=3.0)


@pytest.mark.parametrize("speed", [0.5, 1.0, 20.0])
def test_interruptions_are_asked_for_every_fifty_milliseconds(speed):
    link, clock = loopback(speed)
    asked = []
    stream(
        cut(run_of(2000), [500]),
        link,
        clock,
        start=ZERO,
        should_stop=lambda: asked.append(clock.now()) or False,
    )
    assert np.diff(asked).max() <= 0.05 * speed + 1e-9


class Reluctant(Loopback):
    """A far side that takes only every other batch it has credit for."""

    _asked = 0

    def feed(self, setpoints):
        self._asked += 1
        return super().feed(setpoints) if self._asked % 2 else 0


def test_rows_not_taken_are_fed_again():
    clock = ManualClock()
    link = Reluctant(PAPER, clock)
    link.open()
    assert stream(cut(run_of(1000), [100]), link, clock, start=ZERO).ticks == 1000
