"""The stage that leads the air: exact against the simulated clay, whatever the batches and revisions."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cdhr_host.extrusion import AirModel, AirStage, Channel, ChannelFlow, LinearFlow, Material
from cdhr_host.plant import Clay, Paste
from cdhr_host.values import Setpoints

T = 0.004
LINE = LinearFlow(60e3, 0.35e12)
PASTE = ChannelFlow(Material(1100.0, 700.0, 0.5), (Channel(5e-3, 20e-3), Channel(40e-3, 0.15)))
LED = AirModel(LINE, 200e3, 0.08, 0.03, 0.05, 0.05)
NOW = AirModel(LINE, 200e3)


def rows(flow, first=0, way=None):
    count = len(flow)
    still, none, tick = np.zeros((count, 3)), np.zeros((count, 6)), np.arange(first, first + count)
    nozzle = still.copy()
    nozzle[:, 0] = 0.0 if way is None else way
    pressure = np.where(flow > 0.0, 1.0, 0.0)
    return Setpoints(tick, tick * T, np.ones(count, int), nozzle, still, none, none.copy(), flow, pressure)


def bead(count=200, flow=200e-9, ramp=60, before=200, after=200):
    """A bead from rest to rest."""
    n = np.arange(count)
    edge = np.clip(np.minimum(n, count - 1 - n) / ramp, 0.0, 1.0)
    smooth = edge**3 * (10 - 15 * edge + 6 * edge**2)
    return np.concatenate((np.zeros(before), flow * smooth, np.zeros(after)))


def led(model, flow, sizes=None, way=None):
    stage, parts, at = AirStage(model, T), [], 0
    whole = rows(flow, way=way)
    for size in sizes or [len(flow)]:
        parts.append(stage.push(whole[at : at + size]))
        at += size
    parts.append(stage.flush())
    return np.concatenate([part.pressure for part in parts if part is not None])


def laid(model, command, **paste):
    dead = {"open_dead": model.open_dead, "close_dead": model.close_dead} | paste
    clay = Clay(Paste(model.law, model.regulator_lag, model.line_lag, **dead), T)
    return clay.step(clay.standing(), np.arange(len(command)), command)[2]


@pytest.mark.parametrize(
    "model",
    [
        LED,
        replace(LED, line_lag=0.0),
        replace(LED, regulator_lag=0.0),
        replace(LED, open_dead=0.0, close_dead=0.0),
        replace(LED, law=PASTE, creep=2e-9),
    ],
)
def test_clay_flows_as_planned(model):
    flow = bead()
    found = laid(model, led(model, flow))
    assert found.sum() == pytest.approx(flow.sum(), rel=0.01)
    assert np.abs(found - flow).max() < 0.02 * flow.max()


@pytest.mark.parametrize(("opens", "closes"), [(0.02, 0.08), (0.08, 0.02), (0.0, 0.06), (0.06, 0.0)])
def test_opening_and_closing_lead_by_their_own_dead_times(opens, closes):
    model = replace(LED, regulator_lag=0.02, line_lag=0.0, open_dead=opens, close_dead=closes)
    flow = bead()
    command = led(model, flow)
    found = laid(model, command)
    assert found.sum() == pytest.approx(flow.sum(), rel=0.01)
    late = round(closes / T)
    begun = np.flatnonzero(flow)[[0, -1]]
    on = np.flatnonzero(command)
    assert on[0] == begun[0] - round((opens + 0.06) / T)
    assert on[-1] == begun[1] - late
    assert found[begun[1] + 10 :].max() == 0.0


def test_without_delays_rows_pass_as_they_are():
    flow = bead()
    stage = AirStage(NOW, T)
    given = rows(flow)
    assert stage.lead == 0
    assert stage.push(given) is given
    assert stage.flush() is None


def test_short_gaps_are_passed_at_yield_and_long_ones_without_air():
    flow = np.concatenate((bead(after=0), bead(before=1, after=0), bead(before=300)))
    command = led(LED, flow)
    found = laid(LED, command)
    assert np.abs(found - flow).max() < 0.02 * flow.max()
    shift = round(LED.open_dead / T)
    assert (command[199 : 598 - shift] > 0.0).all()
    assert (command[603 : 900 - shift - round(LED.restore / T)] == 0.0).all()


def test_a_bead_is_cut_short_by_the_coast():
    flow = bead()
    way = np.cumsum(flow) / flow.max() * 80e-6
    coasting = replace(LED, coast=2e-3)
    plain, short = (laid(LED, led(model, flow, way=way)) for model in (LED, coasting))
    millimetre = flow.max() / 80e-6 * T * 1e-3
    assert 0.3 * millimetre < (plain - short).sum() * T < 2.0 * millimetre
    assert np.flatnonzero(short)[-1] < np.flatnonzero(plain)[-1]


def test_what_the_air_cannot_make_stays_within_its_pressure():
    flow = np.concatenate((np.zeros(200), np.full(100, 380e-9), np.zeros(200)))
    command = led(LED, flow)
    assert (command >= 0.0).all()
    assert (command <= LED.pressure_max).all()
    assert command.max() == LED.pressure_max


def test_rows_must_follow_one_another():
    stage = AirStage(LED, T)
    stage.push(rows(np.zeros(10)))
    with pytest.raises(ValueError, match="go on at tick 20, not 10"):
        stage.push(rows(np.zeros(10), first=20))


flows = st.lists(
    st.tuples(st.integers(1, 250), st.sampled_from([0.0, 40e-9, 220e-9])), min_size=1, max_size=6
).map(lambda runs: np.concatenate([np.full(count, flow) for count, flow in runs]))
models = st.builds(
    AirModel,
    st.sampled_from([LINE, PASTE]),
    st.just(200e3),
    st.sampled_from([0.0, 0.08]),
    st.sampled_from([0.0, 0.03]),
    st.sampled_from([0.0, 0.02, 0.06]),
    st.sampled_from([0.0, 0.03, 0.05]),
    st.sampled_from([0.0, 2e-9]),
)


@settings(max_examples=60, deadline=None)
@given(models, flows, st.lists(st.integers(1, 120), min_size=1, max_size=20))
def test_commands_do_not_depend_on_the_batches(model, flow, sizes):
    cut = []
    while sum(cut) < len(flow):
        cut.append(min(sizes[len(cut) % len(sizes)], len(flow) - sum(cut)))
    whole = led(model, flow)
    assert len(whole) == len(flow)
    assert led(model, flow, cut) == pytest.approx(whole, abs=1e-3)
    assert (whole >= 0.0).all()
    assert (whole <= model.pressure_max).all()


SHUTS_EARLY = AirModel(LinearFlow(60e3, 3.5e11), 200e3, 0.08, 0.0, 0.0, 0.05, 0.0, 0.0)


@settings(max_examples=60, deadline=None)
@given(models, flows, st.floats(0.0, 1.0), st.integers(0, 300))
@example(SHUTS_EARLY, np.repeat([0.0, 4e-8, 0.0], [2, 56, 100]), 0.375, 99)
def test_the_same_rows_again_give_the_same_commands(model, flow, share, ahead):
    whole, expected = rows(flow), led(model, flow)
    again = int(share * (len(flow) - 1))
    stage = AirStage(model, T)
    first = stage.push(whole[: min(again + ahead + 1, len(flow))])
    stage.restart(again)
    kept = first.pressure[first.tick < again]
    parts = [kept, stage.push(whole[again:]).pressure]
    if (rest := stage.flush()) is not None:
        parts.append(rest.pressure)
    found = np.concatenate(parts)
    if not stage.lead:
        expected = whole.pressure
    assert found == pytest.approx(expected, abs=1e-3)


def test_a_stage_goes_on_apart_from_its_fork():
    flow = bead()
    stage = AirStage(LED, T)
    stage.push(rows(flow[:300]))
    other = stage.fork()
    other.restart(250)
    ended = other.push(rows(np.zeros(150), first=250))
    assert ended.pressure[-1] == 0.0
    rest = stage.push(rows(flow[300:], first=300))
    expected = led(LED, flow)
    assert rest.pressure == pytest.approx(expected[rest.tick], abs=1e-3)
