"""What each watchdog lets pass, what it tells, and when."""

from dataclasses import replace

import numpy as np
import pytest

from cdhr_host.drives.timing import CycleTiming
from cdhr_host.job.watchdogs import Alarm, Reaction, Watchdogs
from cdhr_host.pipeline import open_profile
from cdhr_host.plant import Machine
from cdhr_host.units import KPA, MM
from cdhr_host.values import Array, Feedback, Setpoints

PROFILE = open_profile("paper")
PERIOD = PROFILE.drives.period
WATCH = PROFILE.watch
COUNT = 500
MIDDLE = 250


def moving(speed: float = 0.0) -> Setpoints:
    """All sliders at one speed, 6 N in each cable."""
    tick = np.arange(COUNT)
    slider = np.repeat((speed * PERIOD * tick)[:, None], 6, axis=1)
    nothing = np.zeros((COUNT, 3))
    flow = np.zeros(COUNT)
    return Setpoints(
        tick,
        tick * PERIOD,
        tick // 10,
        nothing,
        nothing.copy(),
        slider,
        np.full((COUNT, 6), 6.0),
        flow,
        flow.copy(),
    )


def as_planned(rows: Setpoints) -> Feedback:
    """The machine does what it was told, force sensors included."""
    per_newton = PROFILE.sliders.screw_lead / (2 * np.pi * PROFILE.drives.screw_efficiency)
    return Feedback(
        rows.tick,
        rows.slider,
        rows.slider,
        np.zeros((COUNT, 6), np.int64),
        rows.tension * per_newton,
        rows.pressure,
        rows.tension[:, :3],
    )


def spoilt(values: Array, axis: int, by: float, lasting: float) -> Array:
    """One column off from MIDDLE on for so many seconds."""
    changed = values.copy()
    changed[MIDDLE : MIDDLE + round(lasting / PERIOD), axis] += by
    return changed


def told(rows: Setpoints, feedback: Feedback, batch: int = 37) -> Alarm | None:
    dogs = Watchdogs(PROFILE)
    for first in range(0, COUNT, batch):
        part = slice(first, first + batch)
        columns = (
            getattr(feedback, name)[part] for name in ("tick", "setpoint", "slider", "counts", "torque")
        )
        alarm = dogs.executed(rows[part], Feedback(*columns, feedback.pressure[part], feedback.force[part]))
        if alarm is not None:
            return alarm
    return None


def test_a_healthy_machine_is_left_alone() -> None:
    for speed in (0.0, 0.05, 0.1):
        rows = moving(speed)
        assert told(rows, as_planned(rows)) is None


def test_the_simulated_servos_lag_is_allowed_for() -> None:
    machine = Machine(PROFILE)
    t = np.arange(COUNT) * PERIOD
    way = 0.1 * np.sin(2 * np.pi * 0.25 * t)  # up to 157 mm/s
    rows = replace(moving(), slider=np.repeat(way[:, None], 6, axis=1))
    _, feedback = machine.step(machine.standing(np.zeros(6)), rows)
    away = np.abs(feedback.slider - rows.slider).max()
    assert away > WATCH.following_floor
    assert told(rows, feedback) is None


@pytest.mark.parametrize("batch", [1, 37, COUNT])
@pytest.mark.parametrize(
    ("name", "axis", "by", "settling", "kind", "reaction"),
    [
        ("slider", 4, 1.0 * MM, WATCH.following_settling, "following-error", Reaction.STOP),
        ("torque", 2, 0.7, WATCH.force_settling, "torque-deviation", Reaction.STOP),
        ("force", 1, -5.8, WATCH.force_settling, "slack", Reaction.STOP),
        ("force", 0, 9.0, WATCH.force_settling, "force-deviation", Reaction.STOP),
    ],
)
def test_what_lasts_is_told_and_what_does_not_is_not(
    name: str, axis: int, by: float, settling: float, kind: str, reaction: Reaction, batch: int
) -> None:
    rows = moving()
    good = as_planned(rows)
    short = replace(good, **{name: spoilt(getattr(good, name), axis, by, settling - 2 * PERIOD)})
    assert told(rows, short, batch) is None
    long = replace(good, **{name: spoilt(getattr(good, name), axis, by, settling + 2 * PERIOD)})
    alarm = told(rows, long, batch)
    assert alarm is not None
    assert (alarm.problem.kind, alarm.reaction) == (kind, reaction)
    assert str(axis + 1) in alarm.problem.message
    assert alarm.problem.line is not None
    assert MIDDLE // 10 <= alarm.problem.line <= (MIDDLE + settling / PERIOD) // 10 + 1


def test_pressure_that_does_not_follow_holds_the_print() -> None:
    rows = moving()
    good = as_planned(rows)
    pressure = good.pressure.copy()
    pressure[MIDDLE:] += 50 * KPA
    alarm = told(rows, replace(good, pressure=pressure))
    assert alarm is not None
    assert (alarm.problem.kind, alarm.reaction) == ("pressure-deviation", Reaction.HOLD)
    assert alarm.problem.value == pytest.approx(50.0)
    assert alarm.problem.limit == pytest.approx(40.0)


def test_following_error_is_allowed_in_proportion_to_speed() -> None:
    for speed, excess, wrong in ((0.1, 0.9, False), (0.1, 1.1, True), (0.02, 1.1, True)):
        rows = moving(speed)
        allowed = WATCH.following_floor + WATCH.following_lag * speed
        feedback = as_planned(rows)
        alarm = told(rows, replace(feedback, slider=spoilt(feedback.slider, 3, -excess * allowed, 0.5)))
        assert (alarm is not None) == wrong


def timing(cycles: int, late: int) -> CycleTiming:
    return CycleTiming(cycles, 0.0, 0.0, 0.0, 0.0, 0, late, real_time=False)


def test_late_cycles_are_counted_over_ten_seconds() -> None:
    dogs = Watchdogs(PROFILE)
    assert dogs.cycles(0.0, None) is None
    for second in range(1, 60):
        assert dogs.cycles(float(second), timing(250 * second, 4 * second)) is None
    alarm = dogs.cycles(60.0, timing(250 * 60, 4 * 59 + 120))
    assert alarm is not None
    assert (alarm.problem.kind, alarm.reaction) == ("late", Reaction.HOLD)


def test_a_feeder_that_falls_silent_is_told_only_while_the_link_waits() -> None:
    dogs = Watchdogs(PROFILE)
    for second in range(20):
        assert dogs.fed(float(second), 100, waiting=False) is None
    for second in range(20, 25):
        assert dogs.fed(float(second), 100 + second, waiting=True) is None
    assert dogs.fed(29.0, 124, waiting=True) is None
    alarm = dogs.fed(29.1, 124, waiting=True)
    assert alarm is not None
    assert (alarm.problem.kind, alarm.reaction) == ("feeder", Reaction.HOLD)


def test_a_disk_that_runs_full_is_told() -> None:
    dogs = Watchdogs(PROFILE)
    assert dogs.disk(10**9) is None
    alarm = dogs.disk(10**7)
    assert alarm is not None
    assert (alarm.problem.kind, alarm.problem.value, alarm.reaction) == ("disk", 10.0, Reaction.HOLD)


def test_an_old_answer_is_no_following_error() -> None:
    rows = moving(0.02)
    told = as_planned(rows)
    silent = slice(MIDDLE, MIDDLE + round(0.09 / PERIOD))
    old = {
        name: np.array(getattr(told, name)) for name in ("slider", "setpoint", "torque", "pressure", "force")
    }
    for values in old.values():
        values[silent] = values[MIDDLE - 1]
    assert Watchdogs(PROFILE).executed(rows, replace(told, **old)) is None
    turning = old["torque"] + 1e-4 * np.arange(COUNT)[:, None]
    alarm = Watchdogs(PROFILE).executed(rows, replace(told, **{**old, "torque": turning}))
    assert alarm is not None
    assert alarm.problem.kind == "following-error"
