"""Rows that were fed are replaced before they are played, over all links."""

import numpy as np
import pytest
from links import drained, fed_all, same
from trajectories import PAPER, PERIOD, changed, run_of

from cdhr_host.drives import LinkState
from cdhr_host.drives.rows import joined
from cdhr_host.errors import DriveError
from cdhr_host.motion.hold import path_true_stop

ZERO = np.zeros(6)


def _detour(rows, first, seed):
    """The rows before ``first`` go on otherwise: the same place and speed, then another way to rest."""
    ahead = len(rows) - first
    other = run_of(ahead, seed=seed)
    z = np.clip(np.arange(ahead)[:, None] / 200.0, 0.0, 1.0)
    bump = z**3 * (10.0 - 15.0 * z + 6.0 * z * z)
    share = 0.02 * bump * other.slider
    kept = rows[first:]
    return changed(kept, slider=kept.slider + share, line=kept.line + 1000)


def test_revision_replaces_what_is_buffered_and_nothing_before_it(far):
    link, clock = far
    link.arm(ZERO)
    rows = run_of(2000, seed=4)
    fed = link.feed(rows)
    clock.wait_until(clock.now() + 0.2)
    parts = [link.feedback()]
    first = link.revisable
    assert len(parts[0]) < first < fed
    assert (first - len(parts[0])) * PERIOD <= 0.2
    other = joined([rows[:first], _detour(rows, first, seed=9)])
    assert not same(other.slider[first + 300], rows.slider[first + 300], link)
    link.revise(other[first:fed])
    parts += fed_all(link, clock, other[fed:])
    feedback = joined([*parts, drained(link, clock, lambda: link.buffered == 0)])
    assert (feedback.tick == other.tick).all()
    assert same(feedback.setpoint, other.slider, link)
    assert link.state is LinkState.RUNNING


def test_revision_may_end_the_run_early(far):
    link, clock = far
    link.arm(ZERO)
    rows = run_of(2000, seed=4)
    fed = link.feed(rows)
    clock.wait_until(clock.now() + 0.2)
    first = link.revisable
    hold = path_true_stop(rows[first:fed], PAPER)
    link.revise(hold)
    feedback = drained(link, clock, lambda: link.buffered == 0)
    assert same(feedback.setpoint, np.vstack([rows.slider[:first], hold.slider]), link)
    assert link.state is LinkState.RUNNING
    link.stop()
    assert link.state is LinkState.STOPPED


def test_revision_of_a_tick_that_is_due_is_refused_and_changes_nothing(far):
    link, clock = far
    link.arm(ZERO)
    rows = run_of(600, seed=4)
    fed = link.feed(rows)
    clock.wait_until(clock.now() + 0.2)
    early = link.revisable - 1
    with pytest.raises(DriveError, match=f"tick {early} can no longer be replaced") as caught:
        link.revise(_detour(rows, early, seed=9))
    assert caught.value.problems[0].kind == "late-revision"
    first = link.revisable
    with pytest.raises(DriveError, match=f"tick {fed + 1} came where tick {fed} is due"):
        link.revise(rows[fed + 1 :])
    away = changed(rows[first:fed], slider=rows.slider[first:fed] + 0.01)
    with pytest.raises(DriveError, match=f"at tick {first}: a step of"):
        link.revise(away)
    rest = rows[fed:]
    parts = fed_all(link, clock, rest)
    feedback = joined([*parts, drained(link, clock, lambda: link.buffered == 0)])
    assert same(feedback.setpoint, rows.slider, link)


def test_revision_needs_rows_to_revise(far):
    link, _ = far
    with pytest.raises(DriveError, match="the drives are open"):
        link.revise(run_of(50))
    link.arm(ZERO)
    with pytest.raises(DriveError, match="nothing to revise"):
        link.revise(run_of(50))


def test_revision_that_is_too_short_is_an_underrun_on_the_path(far):
    link, clock = far
    link.arm(ZERO)
    rows = run_of(2000, seed=4)
    fed = link.feed(rows)
    clock.wait_until(clock.now() + 0.2)
    first = link.revisable
    link.revise(rows[first : first + 40])
    with pytest.raises(DriveError) as caught:
        drained(link, clock, lambda: False)
    assert caught.value.problems[0].kind == "underrun"
    drained(link, clock, lambda: link.state is LinkState.FAULT)
    assert fed > first + 40
