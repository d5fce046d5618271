"""Laws of laid clay: whatever an operator does to the pace, it lies where it was drawn."""

import math

import numpy as np
import pytest
from clay_runs import AREA, CLAYS, RIGS, Change, Player, program
from hypothesis import given, settings
from hypothesis import strategies as st

EVEN = 0.05
"""of the clay a millimetre"""
AWAY = 1
"""mm from a bead at most"""
OOZE = 0.02
"""of a millimetre's clay, that may come out while the nozzle stands for a bead"""

turns = st.sampled_from([-135, -90, -45, -20, 20, 45, 90, 135])
segments = st.lists(st.tuples(st.integers(12, 40), turns), min_size=1, max_size=3)


@st.composite
def beads(draw):
    """One to three beads, each beginning 25 mm from the end of the one before."""
    made, at, heading = [], np.array([20.0, 20.0]), draw(st.integers(0, 359))
    for lines in draw(st.lists(segments, min_size=1, max_size=3)):
        points = [at]
        for length, turn in lines:
            heading += turn
            points.append(
                points[-1] + length * np.array([math.cos(angle := math.radians(heading)), math.sin(angle)])
            )
        made.append([tuple(point) for point in points])
        at = points[-1] + np.array([25.0, 0.0])
    return made


changes = st.lists(
    st.one_of(
        st.builds(Change, st.floats(0.02, 0.95), st.floats(0.1, 1.0)),
        st.builds(Change, st.floats(0.02, 0.95), st.just(0.0)),
    ),
    max_size=3,
).map(lambda found: sorted(found, key=lambda change: change.at))


def check_even(printed):
    """Each millimetre inside a bead has its clay, and none lies further than AWAY from one."""
    planned, deposited = printed.by_millimetre()
    inside = planned > 0.999 * AREA
    assert np.abs(deposited[inside] / planned[inside] - 1.0).max() <= EVEN
    near = np.convolve(planned > 0.0, np.ones(2 * AWAY + 1), "same") > 0
    assert deposited[~near].sum() <= OOZE * AREA
    assert deposited.sum() == pytest.approx(planned.sum(), rel=EVEN)


def check_air_off_at_rest(printed, air):
    """Where the nozzle stands nothing comes out but what creeps; the air is on only near a bead."""
    stands = printed.speed < 1e-7
    runs = np.split(np.arange(len(stands)), np.flatnonzero(np.diff(stands)) + 1)
    for run in (each for each in runs if stands[each[0]]):
        assert printed.deposited[run].sum() * printed.period <= OOZE * AREA * 1e-9
    flowing = printed.planned > 0.0
    near = math.ceil(air.gap / printed.period) + math.ceil(air.start_lead / printed.period) + 2
    ready = np.convolve(flowing, np.ones(2 * near + 1), "same") > 0
    assert not printed.command[stands & ~ready].any()


@settings(max_examples=20, deadline=None)
@given(beads(), st.sampled_from(CLAYS), st.integers(300, 1000), st.floats(1.0, 3.0), changes)
def test_no_override_hold_or_resume_moves_a_bead_or_changes_it(drawn, clay, feed, factor, done):
    player = Player(program(drawn, feed), clay, factor)
    printed = player.play(done)
    check_even(printed)
    check_air_off_at_rest(printed, RIGS[clay].air)
    assert printed.command.max() <= RIGS[clay].air.pressure_max
    assert printed.command.min() >= 0.0
    assert printed.command[-1] == 0.0
