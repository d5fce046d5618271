"""Clay found again from simulated weighings and steps: within its own doubt, over many seeds."""

import numpy as np
import pytest
from scipy import stats

from cdhr_host.errors import ProfileError
from cdhr_host.extrusion import Channel, ChannelFlow, Material
from cdhr_host.extrusion.identify import Weighings, bead_section, doubts, identify_flow
from cdhr_host.extrusion.identify_delays import StepRecord, delay_doubts, identify_delays
from cdhr_host.extrusion.robust import fitted
from cdhr_host.plant.clay import Clay, Paste
from cdhr_host.units import KPA, MM, MM3

BORES = (Channel(5 * MM, 20 * MM), Channel(40 * MM, 150 * MM))
STONEWARE = Material(2000.0, 1200.0, 0.3)
PORCELAIN = Material(1100.0, 700.0, 0.5)
TRUTH = (0.11, 0.18, 0.06)
DENSITY = 1950.0
REGULATOR = 0.08
PERIOD = 2e-3


def weighed(material, seed, noise=0.03, count=10):
    """Weighings from just above yield to about 900 mm³/s, with noise of 3 % and 0.3 mm³/s."""
    law = ChannelFlow(material, BORES)
    pressure = np.linspace(1.15 * law.threshold, law.pressure(np.array(900 * MM3)), count)
    draw = np.random.default_rng(seed).standard_normal((2, count))
    flow = law.flow(pressure) * (1 + noise * draw[0]) + 10 * noise * MM3 * draw[1]
    return Weighings(pressure, np.maximum(flow, 0.0))


def values(material):
    return np.array([material.yield_stress, material.consistency, material.index])


@pytest.mark.parametrize("material", [STONEWARE, PORCELAIN, Material(900.0, 40.0, 1.0)])
def test_clay_without_noise_is_found_exactly(material):
    curve = identify_flow(weighed(material, 0, noise=0.0), BORES)
    assert curve.fit.value == pytest.approx(values(material), rel=1e-5)
    assert curve.law.channels == BORES
    assert doubts(curve) == []


@pytest.mark.parametrize("material", [STONEWARE, PORCELAIN])
def test_parameters_lie_within_three_sigma_over_many_seeds(material):
    """Student's t with seven degrees of freedom leaves 2 % of the draws outside three sigma."""
    curves = [identify_flow(weighed(material, seed), BORES) for seed in range(40)]
    away = np.array([(curve.fit.value - values(material)) / curve.fit.sigma for curve in curves])
    freedom = curves[0].fit.freedom
    expected = 2 * stats.t.sf(3.0, freedom)
    allowed = stats.binom.ppf(0.9999, len(curves), expected)
    assert freedom == 7
    assert ((np.abs(away) > 3).sum(axis=0) <= allowed).all()
    assert (np.abs(away).max(axis=0) > 1.0).all()
    inside = (np.abs(away) < curves[0].fit.quantile).mean(axis=0)
    assert (inside > 0.8).all()
    assert (away.std(axis=0) > 0.6).all()
    assert (away.std(axis=0) < 1.6).all()


def test_an_outlier_is_held_back_and_named():
    weighings = weighed(STONEWARE, 3, noise=0.005)
    flow = weighings.flow.copy()
    flow[6] *= 0.5
    curve = identify_flow(Weighings(weighings.pressure, flow), BORES)
    assert np.flatnonzero(curve.fit.outlier).tolist() == [6]
    assert curve.fit.value == pytest.approx(values(STONEWARE), rel=0.1)
    (doubt,) = doubts(curve)
    assert doubt.message.startswith("weighing 7: ")


def test_nothing_came_counts_too():
    weighings = weighed(STONEWARE, 0, noise=0.001)
    law = ChannelFlow(STONEWARE, BORES)
    still = Weighings(np.append(weighings.pressure, 0.9 * law.threshold), np.append(weighings.flow, 0.0))
    assert identify_flow(still, BORES).fit.value == pytest.approx(values(STONEWARE), rel=0.05)


def test_too_few_pressures_are_refused():
    weighings = weighed(STONEWARE, 0)
    twice = Weighings(np.repeat(weighings.pressure[-3:], 4), np.repeat(weighings.flow[-3:], 4))
    with pytest.raises(ProfileError, match="flowed at 3 different pressures") as caught:
        identify_flow(twice, BORES)
    assert "six to ten pressures" in caught.value.problems[0].hint


def test_weighings_far_above_yield_leave_it_in_doubt():
    law = ChannelFlow(STONEWARE, BORES)
    pressure = np.linspace(2.2, 2.6, 8) * law.threshold
    noise = 1 + 0.03 * np.random.default_rng(1).standard_normal(8)
    found = {
        doubt.key: doubt
        for doubt in doubts(identify_flow(Weighings(pressure, law.flow(pressure) * noise), BORES))
    }
    assert "extrapolated" in found["clay.yield_stress_pa"].message
    assert "weigh at" in found["clay.yield_stress_pa"].hint
    assert "clay.index" in found


def test_bead_sections():
    width, height = np.array([6.0, 2.0]) * MM, np.array([2.0, 2.0]) * MM
    assert bead_section(width, height) / MM**2 == pytest.approx([8 + np.pi, np.pi])


def test_fit_agrees_with_the_straight_line_in_closed_form():
    """Without outliers: ordinary least squares, s² (XᵀX)⁻¹, but for Huber's own corrections."""
    rng = np.random.default_rng(5)
    x = np.linspace(0, 1, 400)
    y = 2.0 + 3.0 * x + 0.1 * rng.standard_normal(400)
    design = np.stack([np.ones_like(x), x], axis=1)
    wide = (np.full(2, -np.inf), np.full(2, np.inf))
    fit = fitted(lambda p: design @ p - y, np.zeros(2), wide, np.ones(2))
    plain, *_ = np.linalg.lstsq(design, y, rcond=None)
    covariance = 0.01 * np.linalg.inv(design.T @ design)
    assert fit.value == pytest.approx(plain, abs=0.01)
    assert fit.sigma == pytest.approx(np.sqrt(np.diag(covariance)), rel=0.15)
    assert fit.deviation == pytest.approx(0.1, rel=0.15)
    assert fit.freedom == 398
    assert fit.quantile == pytest.approx(1.966, abs=1e-3)


def stepped(seed, noise, pressures=(95 * KPA, 130 * KPA, 170 * KPA), steps=12, gain=1.0):
    """The plant's clay on a scale, read 20 times a second: independent of the model that is fitted."""
    spans = [span for k in range(steps) for span in ((0.0, 1.0), (pressures[k % len(pressures)], 2.0))]
    command = np.concatenate([np.full(round(t / PERIOD), p) for p, t in [*spans, (0.0, 1.5)]])
    law = ChannelFlow(STONEWARE, BORES)
    plant = Clay(Paste(law, REGULATOR, TRUTH[2], TRUTH[0], TRUTH[1]), PERIOD)
    _, _, flow = plant.step(plant.standing(), np.arange(len(command)), command)
    mass = gain * DENSITY * PERIOD * np.concatenate(([0.0], np.cumsum(flow)[:-1]))
    every = slice(None, None, 25)
    draw = np.random.default_rng(seed).standard_normal(len(mass[every]))
    return StepRecord(PERIOD * np.arange(len(mass))[every], command[every], mass[every] + noise * draw)


def delays_of(record):
    return identify_delays(record, ChannelFlow(STONEWARE, BORES), DENSITY, REGULATOR)


def test_delays_of_the_plant_are_found():
    """Half a tick of the plant's own clock is all that is left without noise."""
    found = delays_of(stepped(0, 0.0))
    assert found.fit.value[:3] == pytest.approx(TRUTH, abs=PERIOD)
    assert found.gain == pytest.approx(np.ones(3), abs=1e-3)


def test_delays_lie_within_three_sigma():
    away = []
    for seed in range(4):
        found = delays_of(stepped(seed, 1e-5))
        away.append((found.fit.value[:3] - TRUTH) / found.fit.sigma[:3])
        assert (found.fit.sigma[:3] < 0.05).all()
    assert (np.abs(away) < 3.0).all()


def test_clay_that_has_stiffened_is_no_delay():
    found = delays_of(stepped(1, 5e-6, gain=0.6))
    assert found.gain == pytest.approx(np.full(3, 0.6), abs=0.02)
    assert found.fit.value[:3] == pytest.approx(TRUTH, abs=0.02)
    assert any("% of the clay came" in doubt.message for doubt in delay_doubts(found))


def test_two_short_steps_on_a_coarse_scale_are_doubtful():
    found = delays_of(stepped(2, 2e-4, pressures=(150 * KPA,), steps=2))
    assert {doubt.key for doubt in delay_doubts(found)} >= {"clay.line_lag_ms"}


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        (lambda r: StepRecord(r.t, 0 * r.pressure, r.mass), "never opens"),
        (lambda r: StepRecord(r.t, np.where(r.t < 1, 0.0, 150e3), r.mass), "never shut"),
        (lambda r: StepRecord(r.t, 0.1 * r.pressure, r.mass), "never moves a clay"),
        (lambda r: StepRecord(r.t, r.pressure, 0 * r.mass), "the scale never moves"),
    ],
)
def test_records_that_show_no_delay_are_refused(change, wrong):
    with pytest.raises(ProfileError, match=wrong):
        delays_of(change(stepped(0, 0.0)))
