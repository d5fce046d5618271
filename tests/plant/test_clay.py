"""The simulated air and clay against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.extrusion import Channel, ChannelFlow, LinearFlow, Material
from cdhr_host.plant import Clay, Paste

T = 0.004
LINE = LinearFlow(60e3, 0.35e12)
PASTE = ChannelFlow(Material(600.0, 300.0, 0.4), (Channel(5e-3, 20e-3), Channel(20e-3, 0.5)))


def _run(paste, command, sizes=None):
    clay = Clay(paste, T)
    state, parts, at = clay.standing(), [], 0
    for size in sizes or [len(command)]:
        rows = slice(at, at + size)
        state, *found = clay.step(state, np.arange(len(command))[rows], command[rows])
        parts.append(found)
        at += size
    return [np.concatenate(each) for each in zip(*parts, strict=True)]


def test_without_delays_flow_is_the_law_of_the_command():
    command = np.array([0.0, 50e3, 100e3, 150e3])
    _, flow = _run(Paste(LINE, 0.0), command)
    assert flow == pytest.approx(LINE.flow(command))


def test_two_lags_have_the_step_response_of_the_textbook():
    _, flow = _run(Paste(LINE, 0.08, 0.03), np.full(200, 150e3))
    t = T * np.arange(1, 201)
    pressure = 150e3 * (1 - (0.08 * np.exp(-t / 0.08) - 0.03 * np.exp(-t / 0.03)) / 0.05)
    assert flow == pytest.approx(LINE.flow(pressure), abs=1e-3 * flow.max())


@pytest.mark.parametrize(("opens", "closes"), [(0.04, 0.04), (0.02, 0.06), (0.06, 0.02), (0.0, 0.04)])
def test_air_opens_and_closes_by_its_own_dead_times(opens, closes):
    command = np.zeros(100)
    command[20:50] = 100e3
    pressure, flow = _run(Paste(LINE, 0.0, 0.0, opens, closes), command)
    on = np.flatnonzero(pressure)
    assert (on[0], on[-1] + 1) == (20 + round(opens / T), 50 + round(closes / T))
    assert (np.diff(on) == 1).all()
    assert (pressure[on] == 100e3).all()
    assert ((flow > 0) == (pressure > 0)).all()


def test_the_last_level_lasts_until_the_end_of_the_air_arrives():
    command = np.zeros(40)
    command[10:20] = np.linspace(80e3, 98e3, 10)
    pressure, _ = _run(Paste(LINE, 0.0, 0.0, 5 * T, 8 * T), command)
    assert pressure[15:25] == pytest.approx(command[10:20])
    assert pressure[25:29].tolist() == [98e3] * 3 + [0.0]


def test_hysteresis_keeps_the_regulator_until_the_command_has_turned():
    command = np.array([100e3, 102e3, 99e3, 94e3, 0.0])
    pressure, _ = _run(Paste(LINE, 0.0, hysteresis=3e3), command)
    assert pressure.tolist() == [97e3, 99e3, 99e3, 97e3, 0.0]


def test_stored_clay_oozes_once_the_air_is_shut():
    command = np.concatenate((np.full(100, 150e3), np.zeros(400)))
    dry = _run(Paste(LINE, 0.04), command)[1]
    wet = _run(Paste(LINE, 0.04, compliance=0.2e-12, ooze=0.5), command)[1]
    assert (wet[:100] == dry[:100]).all()
    assert (wet - dry).sum() * T == pytest.approx(0.5 * 0.2e-12 * 150e3, rel=0.01)
    assert (np.diff((wet - dry)[100:]) < 0.0).all()


def test_noise_is_of_its_seed_and_has_its_size():
    command = np.full(4000, 150e3)
    one, same, other = (_run(Paste(LINE, 0.0, noise=0.05, seed=seed), command)[1] for seed in (3, 3, 4))
    assert (one == same).all()
    assert (one != other).any()
    assert one.std() / one.mean() == pytest.approx(0.05, rel=0.05)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.sampled_from([0.0, 0.0, 80e3, 120e3, 200e3]), min_size=1, max_size=50),
    st.sampled_from([(0.0, 0.0), (0.012, 0.02), (0.02, 0.008)]),
    st.integers(1, 49),
)
def test_the_result_does_not_depend_on_the_batches(command, dead, split):
    paste = Paste(PASTE, 0.05, 0.02, *dead, 1e-13, 0.3, 0.1, 2e3, 0.03, 5)
    command = np.array(command)
    sizes = [split, len(command) - split] if split < len(command) else [len(command)]
    whole, parts = _run(paste, command), _run(paste, command, sizes)
    for a, b in zip(whole, parts, strict=True):
        assert a == pytest.approx(b, rel=1e-12, abs=1e-18)
