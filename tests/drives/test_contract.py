"""What every link promises, over all links."""

import numpy as np
import pytest
from links import drained, fed_all, same
from trajectories import PAPER, PERIOD, changed, cut, run_of

from cdhr_host.drives import LinkState
from cdhr_host.drives.rows import joined
from cdhr_host.errors import DriveError

ZERO = np.zeros(6)
LATENCY = 3
"""ticks after which the outcome of a row must have come back"""


def test_life_from_closed_to_closed(far):
    link, clock = far
    assert link.state is LinkState.OPEN
    link.arm(ZERO)
    assert link.state is LinkState.ARMED
    rows = run_of(200)
    assert link.feed(rows) == 200
    assert link.buffered == 200
    assert link.state is LinkState.RUNNING
    drained(link, clock, lambda: link.buffered == 0)
    assert link.state is LinkState.RUNNING
    link.stop()
    assert link.state is LinkState.STOPPED
    assert link.stop_tick is None
    link.close()
    assert link.state is LinkState.CLOSED


def test_everything_fed_comes_back_exactly_once_in_order(far):
    link, clock = far
    link.arm(ZERO)
    rows = run_of(1500)
    parts = [part for batch in cut(rows, [1, 250, 37]) for part in fed_all(link, clock, batch)]
    feedback = joined([*parts, drained(link, clock, lambda: link.buffered == 0)])
    assert (feedback.tick == rows.tick).all()
    assert same(feedback.setpoint, rows.slider, link)
    assert np.abs(feedback.slider - rows.slider).max() < 1e-4


def test_it_says_where_the_sliders_stand(far):
    link, clock = far
    assert np.abs(link.slider).max() < 1e-6
    link.arm(ZERO)
    link.feed(run_of(1500))
    clock.wait_until(clock.now() + 0.3)
    link.stop()
    found = drained(link, clock, lambda: link.state is LinkState.STOPPED)
    clock.wait_until(clock.now() + 0.2)
    link.feedback()
    assert np.abs(found.setpoint[-1]).max() > 1e-4
    assert np.abs(link.slider - found.setpoint[-1]).max() < 2e-6
    link.close()
    link.open()
    assert np.abs(link.slider - found.setpoint[-1]).max() < 2e-6


def test_credit_is_what_feed_accepts(far):
    link, _ = far
    assert link.free == 0
    link.arm(ZERO)
    rows = run_of(link.free + 500)
    free = link.free
    assert link.feed(rows) == free
    assert link.free == 0
    assert link.feed(rows[free:]) == 0
    assert link.feed(rows[:0]) == 0


def test_nothing_moves_before_time_passes(far):
    link, clock = far
    link.arm(ZERO)
    link.feed(run_of(200))
    assert len(link.feedback()) == 0
    clock.wait_until(clock.now() + 10 * PERIOD)
    assert 10 - LATENCY <= len(link.feedback()) <= 10


def test_second_run_begins_where_the_first_ended(far):
    link, clock = far
    for first in (0, 200):
        link.arm(ZERO)
        link.feed(run_of(200, first_tick=first))
        drained(link, clock, lambda: link.buffered == 0)
        link.stop()
    assert link.state is LinkState.STOPPED


@pytest.mark.parametrize("spoilt", ["slider", "tension", "pressure"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused_with_their_line(far, spoilt, value):
    link, _ = far
    link.arm(ZERO)
    rows = run_of(200)
    column = getattr(rows, spoilt).copy()
    column[57] = value
    with pytest.raises(DriveError, match=f"{spoilt} at tick 57 is not a finite number") as caught:
        link.feed(changed(rows, **{spoilt: column}))
    assert caught.value.problems[0].line == rows.line[57]
    assert link.buffered == 0


def test_gaps_and_repeats_are_refused_within_and_between_batches(far):
    link, _ = far
    link.arm(ZERO)
    rows = run_of(200)
    tick = rows.tick.copy()
    tick[20:] += 1
    with pytest.raises(DriveError, match="tick 21 came where tick 20 is due"):
        link.feed(changed(rows, tick=tick))
    link.feed(rows[:50])
    with pytest.raises(DriveError, match="tick 51 came where tick 50 is due"):
        link.feed(rows[51:])
    with pytest.raises(DriveError, match="tick 49 came where tick 50 is due"):
        link.feed(rows[49:])
    assert link.buffered == 50
    assert link.feed(rows[50:]) == 150


def test_ticks_before_the_start_are_refused(far):
    link, _ = far
    link.arm(ZERO)
    with pytest.raises(DriveError, match="tick -3 came where tick 0 is due"):
        link.feed(run_of(50, first_tick=-3))


def test_travel_is_refused_with_axis_number_and_limit(far):
    link, _ = far
    link.arm(ZERO)
    rows = run_of(200)
    slider = rows.slider.copy()
    slider[100:, 4] = PAPER.sliders.travel_max + 1e-6
    with pytest.raises(
        DriveError, match=r"slider 5 at tick 100: 1000\.001 mm is beyond its travel"
    ) as caught:
        link.feed(changed(rows, slider=slider))
    kinds = [problem.kind for problem in caught.value.problems]
    assert kinds == ["travel", "slider-speed"]


def test_jumps_are_refused_within_and_between_batches(far):
    link, _ = far
    link.arm(ZERO)
    rows = run_of(200)
    fast = PAPER.sliders.speed_max * PERIOD * 1.01
    slider = rows.slider.copy()
    slider[30:, 1] += fast + 1e-3
    with pytest.raises(DriveError, match="slider 2 at tick 30: a step of"):
        link.feed(changed(rows, slider=slider))
    link.feed(rows[:30])
    with pytest.raises(DriveError, match="slider 2 at tick 30: a step of"):
        link.feed(changed(rows, slider=slider)[30:])


def test_run_that_does_not_begin_where_it_was_armed_is_refused(far):
    link, _ = far
    link.arm(ZERO)
    rows = run_of(200)
    with pytest.raises(DriveError, match=r"slider 1 at tick 0: a step of 0.1000 mm .* \(limit 0.0500 mm\)"):
        link.feed(changed(rows, slider=rows.slider + 1e-4))


@pytest.mark.parametrize("value", [-1.0, PAPER.extruder.pressure_max * 1.001])
def test_pressure_out_of_range_is_refused(far, value):
    link, _ = far
    link.arm(ZERO)
    rows = run_of(200)
    pressure = rows.pressure.copy()
    pressure[5] = value
    with pytest.raises(DriveError, match=r"pressure at tick 5: .* kPa is not within 0 to 200 kPa"):
        link.feed(changed(rows, pressure=pressure))


def test_shapes_are_refused(far):
    link, _ = far
    link.arm(ZERO)
    rows = run_of(200)
    with pytest.raises(DriveError, match="slider has shape"):
        link.feed(changed(rows, slider=rows.slider[:, :5]))


def test_arming_elsewhere_is_refused(far):
    link, _ = far
    with pytest.raises(DriveError, match=r"slider 3 stands at 0.0000 mm, the run begins at 2.0000 mm"):
        link.arm(np.array([0, 0, 2e-3, 0, 0, 1e-3]))
    with pytest.raises(DriveError, match="six finite"):
        link.arm(np.array([0, 0, np.nan, 0, 0, 0]))
    with pytest.raises(DriveError, match="six finite"):
        link.arm(np.zeros(3))
    assert link.state is LinkState.OPEN


def test_calls_out_of_turn_are_refused(far):
    link, _ = far
    with pytest.raises(DriveError, match="the drives are open, not armed"):
        link.feed(run_of(50))
    with pytest.raises(DriveError, match="open, not closed"):
        link.open()
    link.arm(ZERO)
    with pytest.raises(DriveError, match="the drives are armed, not open or stopped"):
        link.arm(ZERO)
    link.close()
    link.close()
    for call in (lambda: link.arm(ZERO), link.stop, lambda: link.feed(run_of(50))):
        with pytest.raises(DriveError, match="the drives are closed"):
            call()


def test_stop_before_anything_moves_drops_what_was_fed(far):
    link, clock = far
    link.stop()
    assert link.state is LinkState.OPEN
    link.arm(ZERO)
    rows = run_of(2000)
    link.feed(rows[:20])
    assert link.state is LinkState.ARMED
    link.stop()
    assert link.state is LinkState.STOPPED
    clock.wait_until(clock.now() + 1.0)
    assert len(link.feedback()) == 0


def test_stop_comes_to_rest_and_can_be_armed_there(far):
    link, clock = far
    link.arm(ZERO)
    rows = run_of(3000)
    parts = fed_all(link, clock, rows[:1200])
    link.stop()
    assert link.state is LinkState.STOPPING
    assert link.free == 0
    with pytest.raises(DriveError, match="the drives are stopping"):
        link.feed(rows[1200:])
    feedback = joined([*parts, drained(link, clock, lambda: link.state is LinkState.STOPPED)])
    assert (np.diff(feedback.tick) == 1).all()
    first = link.stop_tick
    assert same(feedback.setpoint[:first], rows.slider[:first], link)
    stop = link.stop_rows(rows[first:1200])
    assert same(feedback.setpoint[first:], stop.slider, link)
    assert (feedback.setpoint[-1] == feedback.setpoint[-2]).all()
    link.stop()
    link.arm(feedback.setpoint[-1])
    assert link.state is LinkState.ARMED
    assert link.stop_tick is None


def test_closing_while_moving_comes_to_rest(far):
    link, clock = far
    link.arm(ZERO)
    fed_all(link, clock, run_of(3000)[:1000])
    link.close()
    assert link.state is LinkState.CLOSED
    link.open()
    with pytest.raises(DriveError, match="stands at"):
        link.arm(ZERO)
