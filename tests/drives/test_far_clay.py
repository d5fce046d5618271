"""The far sides lay clay too: their traces tell how much."""

import numpy as np
import pytest
from trajectories import PAPER

from cdhr_host.drives.sim.motors import Motors
from cdhr_host.drives.sim.serve import SlcanStation, keep_trace
from cdhr_host.plant import Clay, Paste, undisturbed
from cdhr_host.units import MM3

COMMAND = np.concatenate((np.zeros(10), np.full(100, 148e3), np.zeros(100)))


def test_a_bridge_lays_what_its_pressure_pushes():
    motors, laid = Motors(PAPER, undisturbed), []
    for pressure in COMMAND:
        motors.execute((0,) * 12 + (round(pressure / 100.0),))
        laid.append(motors.deposited)
    clay = Clay(Paste.from_profile(PAPER), PAPER.drives.period)
    _, _, expected = clay.step(clay.standing(), np.arange(len(COMMAND)), COMMAND)
    assert np.array(laid) == pytest.approx(expected / MM3)
    assert max(laid) > 200.0


def test_a_trace_has_a_column_of_clay(tmp_path):
    far = SlcanStation(PAPER, 0.0)
    far.exchange(0.1, b"")
    far.station.trace.append((0.104, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 4850, True, 251.43))
    keep_trace(far, tmp_path / "trace.csv")
    head, *_, last = (tmp_path / "trace.csv").read_text().splitlines()
    assert head.endswith("pressure_raw,fresh,deposited_mm3_s")
    assert last == "0.104000,1,2,3,4,5,6,4850,1,251.43"
