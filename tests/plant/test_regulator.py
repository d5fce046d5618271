import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.plant.regulator import Regulator

commands = st.lists(st.floats(-1e5, 2e5), min_size=1, max_size=60).map(np.array)


def test_step_has_the_closed_form():
    pressure = Regulator(0.08, 0.004).step(0.0, np.full(100, 80e3))
    t = 0.004 * np.arange(1, 101)
    assert pressure == pytest.approx(80e3 * (1 - np.exp(-t / 0.08)))


def test_venting_is_the_same_at_once_or_by_ticks():
    regulator = Regulator(0.08, 0.004)
    assert regulator.step(50e3, np.zeros(25))[-1] == pytest.approx(regulator.vented(50e3, 0.1))


def test_no_lag_follows_at_once():
    regulator = Regulator(0.0, 0.004)
    assert regulator.step(7.0, np.array([1.0, 2.0])).tolist() == [1.0, 2.0]
    assert regulator.vented(7.0, 0.001) == 0.0


@settings(max_examples=50, deadline=None)
@given(commands, st.floats(0, 2e5), st.integers(1, 60))
def test_never_negative_and_independent_of_batches(command, before, split):
    regulator = Regulator(0.08, 0.004)
    whole = regulator.step(before, command)
    assert (whole >= 0.0).all()
    first = regulator.step(before, command[:split])
    rest = regulator.step(float(first[-1]), command[split:]) if split < len(command) else np.zeros(0)
    assert (np.concatenate([first, rest]) == whole).all()
