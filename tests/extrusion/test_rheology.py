"""Herschel–Bulkley flow in round bores against closed forms, quadrature and its own inverse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from cdhr_host.extrusion.rheology import Channel, ChannelFlow, LinearFlow, Material
from cdhr_host.units import KPA, MM, MM3

NOZZLE = Channel(5 * MM, 20 * MM)
HOSE = Channel(20 * MM, 1.0)
STONEWARE = Material(2000.0, 800.0, 0.4)

materials = st.builds(
    Material,
    st.one_of(st.just(0.0), st.floats(1.0, 1e5)),
    st.floats(1e-3, 1e5),
    st.floats(0.1, 2.0),
)
channels = st.lists(
    st.builds(Channel, st.floats(1 * MM, 50 * MM), st.floats(1 * MM, 5.0)), min_size=1, max_size=3
).map(tuple)


def test_bingham_is_buckingham_reiner():
    """Q = pi D⁴ dp / (128 mu L) · (1 - 4/3 y + y⁴/3), y = yield stress / wall stress."""
    law = ChannelFlow(Material(2000.0, 15.0, 1.0), (NOZZLE,))
    pressure = np.linspace(1.001, 20.0, 50) * law.threshold
    y = law.threshold / pressure
    poiseuille = np.pi * NOZZLE.diameter**4 * pressure / (128 * 15.0 * NOZZLE.length)
    assert law.flow(pressure) == pytest.approx(poiseuille * (1 - 4 / 3 * y + y**4 / 3), rel=1e-9)


@pytest.mark.parametrize("index", [0.2, 0.5, 1.4])
def test_without_yield_it_is_the_power_law(index):
    """Q = pi R³ n / (3 n + 1) · (R dp / (2 k L))^(1/n)."""
    law = ChannelFlow(Material(0.0, 700.0, index), (NOZZLE,))
    pressure, radius = np.geomspace(1.0, 1e6, 30), NOZZLE.diameter / 2
    wall = radius * pressure / (2 * 700.0 * NOZZLE.length)
    expected = np.pi * radius**3 * index / (3 * index + 1) * wall ** (1 / index)
    assert law.flow(pressure) == pytest.approx(expected, rel=1e-12)


def test_newton_is_hagen_poiseuille():
    law = ChannelFlow(Material(0.0, 12.0, 1.0), (NOZZLE, HOSE))
    ohms = sum(128 * 12.0 * bore.length / (np.pi * bore.diameter**4) for bore in (NOZZLE, HOSE))
    flow = np.array([0.0, 1.0, 250.0]) * MM3
    assert law.pressure(flow) == pytest.approx(ohms * flow, rel=1e-12)
    assert law.resistance(flow) == pytest.approx(np.full(3, ohms), rel=1e-12)


@pytest.mark.parametrize("excess", [1.02, 1.5, 6.0])
@pytest.mark.parametrize("material", [STONEWARE, Material(500.0, 60.0, 0.85), Material(900.0, 3.0, 1.6)])
def test_flow_is_the_integral_of_the_speeds_across_the_bore(material, excess):
    """Independent of the closed form: shear rate -> speed profile -> flow, by quadrature."""
    law = ChannelFlow(material, (NOZZLE,))
    radius, wall = NOZZLE.diameter / 2, material.yield_stress * excess

    def rate(r):
        over = wall * r / radius - material.yield_stress
        return (max(over, 0.0) / material.consistency) ** (1 / material.index)

    plug = radius / excess
    sheared, _ = quad(lambda r: np.pi * r**2 * rate(r), plug, radius, epsabs=0, epsrel=1e-12)
    assert law.flow(np.array([law.threshold * excess]))[0] == pytest.approx(sheared, rel=1e-9)


def test_nothing_flows_up_to_the_threshold():
    law = ChannelFlow(STONEWARE, (NOZZLE, HOSE))
    assert law.threshold == pytest.approx(4 * 2000.0 * (20 / 5 + 1000 / 20))
    assert not law.flow(np.array([0.0, 0.5, 1.0]) * law.threshold).any()
    assert law.flow(np.array([1.0001 * law.threshold]))[0] > 0
    assert law.pressure(np.zeros(2)) == pytest.approx([law.threshold] * 2)
    assert np.isinf(law.resistance(np.zeros(1))[0])


def test_pressures_of_bores_in_series_add():
    flow = np.array([1.0, 50.0, 400.0]) * MM3
    alone = [ChannelFlow(STONEWARE, (bore,)).pressure(flow) for bore in (NOZZLE, HOSE)]
    assert ChannelFlow(STONEWARE, (NOZZLE, HOSE)).pressure(flow) == pytest.approx(sum(alone), rel=1e-13)


@given(materials, channels, st.floats(-14.0, -4.0))
def test_pressure_is_the_exact_inverse_of_flow(material, channels, exponent):
    """1e-12 in the pressure; in the flow as well, as far as a rounded pressure determines it."""
    law = ChannelFlow(material, channels)
    flow = np.array([10.0**exponent])
    pressure = law.pressure(flow)
    if pressure[0] > law.threshold:
        again = law.flow(pressure)
        assert law.pressure(again) == pytest.approx(pressure, rel=1e-12)
        magnified = pressure / (law.resistance(flow) * flow)
        assert abs(again / flow - 1)[0] < 1e-12 + 1e-14 * magnified[0]


@given(materials, channels, st.floats(-10.0, -5.0))
def test_resistance_is_the_slope_of_the_pressure(material, channels, exponent):
    law = ChannelFlow(material, channels)
    flow, step = 10.0**exponent, 1e-4
    near = law.pressure(flow * np.array([1 - step, 1 + step]))
    slope = (near[1] - near[0]) / (2 * step * flow)
    rounding = 1e-15 * near[1] / (step * flow)
    assert law.resistance(np.array([flow]))[0] == pytest.approx(slope, rel=1e-5, abs=2 * rounding)


def test_resistance_at_rest_of_pastes_that_neither_yield_nor_thin():
    assert ChannelFlow(Material(0.0, 1.0, 1.5), (NOZZLE,)).resistance(np.zeros(1))[0] == 0.0
    assert np.isinf(ChannelFlow(Material(0.0, 1.0, 0.5), (NOZZLE,)).resistance(np.zeros(1))[0])


def test_straight_line():
    law = LinearFlow(60 * KPA, 0.35 * KPA / MM3)
    pressure = np.array([0.0, 60.0, 95.0, 147.5]) * KPA
    flow = law.flow(pressure)
    assert flow / MM3 == pytest.approx([0, 0, 100, 250])
    assert law.pressure(flow)[1:] == pytest.approx(pressure[1:])
    assert law.resistance(flow) == pytest.approx(np.full(4, 0.35 * KPA / MM3))


@pytest.mark.parametrize("law", [ChannelFlow(STONEWARE, (NOZZLE,)), LinearFlow(60e3, 3.5e11)])
@pytest.mark.parametrize("bad", [-1e-9, np.inf, np.nan])
def test_flow_that_no_pressure_gives_is_refused(law, bad):
    for ask in (law.pressure, law.resistance):
        with pytest.raises(ValueError, match=f"flow of {bad:g}"):
            ask(np.array([1e-9, bad]))


def test_shapes_are_kept():
    law = ChannelFlow(STONEWARE, (NOZZLE, HOSE))
    flow = np.array([[0.0, 1.0], [20.0, 300.0]]) * MM3
    assert law.flow(law.pressure(flow)) == pytest.approx(flow, rel=1e-9)
    assert law.pressure(flow[1, 1]).shape == ()


@pytest.mark.parametrize("index", [0.05, 0.2, 0.5, 1.0, 1.9])
def test_what_the_iteration_rests_on(index):
    """d ln(p - threshold) / d ln Q rises from n / (1 + n) to n: Newton's method never passes the root."""
    law = ChannelFlow(Material(1.0, 1.0, index), (NOZZLE,))
    pressure = law.threshold * (1 + np.geomspace(1e-5, 1e5, 400))
    flow = law.flow(pressure)
    slope = law.resistance(flow) * flow / (pressure - law.threshold)
    assert slope[0] == pytest.approx(index / (1 + index), rel=1e-4)
    assert slope[-1] == pytest.approx(index, rel=1e-3)
    assert (np.diff(slope) > -1e-9).all()
