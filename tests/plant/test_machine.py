from dataclasses import fields

import numpy as np
import pytest
from trajectories import PAPER, cut, run_of

from cdhr_host.plant import Machine
from cdhr_host.plant.disturbances import Slipped, Stuck

ROWS = run_of(400, seed=3)


def _run(machine, sizes, standing=None):
    state = machine.standing(np.zeros(6) if standing is None else standing)
    parts = []
    for batch in cut(ROWS, sizes):
        state, feedback = machine.step(state, batch)
        parts.append(feedback)
    return [np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(parts[0])]


@pytest.mark.parametrize("disturbance", [None, Stuck(2, 150), Slipped(4, 90, 1e-3)])
@pytest.mark.parametrize("sizes", [[1], [7, 64], [150, 1, 3], [90, 60]])
def test_feedback_does_not_depend_on_the_batches(sizes, disturbance):
    machine = Machine(PAPER, disturbance) if disturbance else Machine(PAPER)
    whole = _run(machine, [len(ROWS)])
    parts = _run(machine, sizes)
    assert all((a == b).all() for a, b in zip(whole, parts, strict=True))


def test_feedback_is_of_the_rows_and_near_them():
    tick, setpoint, slider, counts, torque, pressure, force, deposited = _run(Machine(PAPER), [len(ROWS)])
    assert (tick == ROWS.tick).all()
    assert (setpoint == ROWS.slider).all()
    assert 1e-7 < np.abs(slider - setpoint).max() < 1e-4
    assert (slider == counts * (PAPER.sliders.screw_lead / PAPER.drives.encoder)).all()
    assert 0.003 < np.abs(torque).max() < 0.1
    assert 79e3 < pressure.max() <= 80e3
    assert force.shape == (0, 3)  # no force sensors on this machine
    assert deposited.shape == pressure.shape


def test_a_stuck_slider_stays_where_it_is():
    _, _, slider, *_ = _run(Machine(PAPER, Stuck(2, 150)), [len(ROWS)])
    assert (slider[149:, 2] == slider[149, 2]).all()
    assert np.abs(slider[149:, 1] - ROWS.slider[149:, 1]).max() < 1e-4


def test_a_slipped_coupling_is_off_by_its_distance():
    free = _run(Machine(PAPER), [len(ROWS)])[2]
    slipped = _run(Machine(PAPER, Slipped(4, 90, 1e-3)), [len(ROWS)])[2]
    off = slipped - free
    assert np.abs(off[:90]).max() == 0.0
    assert off[90:, 4] == pytest.approx(np.full(310, 1e-3), abs=4e-9)


def test_standing_elsewhere_vents_and_pulls_in():
    machine = Machine(PAPER)
    state = machine.standing(np.full(6, 1e-5), setpoint=np.zeros(6), pressure=1e3, rested=0.08)
    assert state.pressure == pytest.approx(1e3 / np.e)
    _, feedback = machine.step(state, run_of(300, size=0.0))
    assert np.abs(feedback.slider[0]).max() > 1e-6
    assert np.abs(feedback.slider[-1]).max() < 1e-8
