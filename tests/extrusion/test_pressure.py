"""The static pressure model."""

import numpy as np
import pytest

from cdhr_host.extrusion import air_command, flow_law
from cdhr_host.profile import find, read_table, validate
from cdhr_host.units import KPA, MM3

PROFILE = validate(read_table(find("paper")))[0]


@pytest.fixture(scope="module")
def law():
    return flow_law(PROFILE.extruder, PROFILE.clay)


def test_flow_needs_threshold_plus_slope(law):
    flow = np.array([100.0, 250.0]) * MM3
    command = air_command(flow, np.zeros(2), law)
    assert command.pressure / KPA == pytest.approx([60 + 0.35 * 100, 60 + 0.35 * 250])
    assert np.array_equal(command.flow, flow)


def test_no_flow_is_air_off(law):
    command = air_command(np.zeros(3), np.zeros(3), law)
    assert not command.pressure.any()
    assert not command.flow.any()


def test_held_pressure_gives_the_flow_the_model_says(law):
    command = air_command(np.zeros(2), np.array([130.0, 30.0]) * KPA, law)
    assert command.pressure / KPA == pytest.approx([130, 30])
    assert command.flow / MM3 == pytest.approx([200, 0])


def test_planned_clay_rules_over_held_air(law):
    command = air_command(np.array([100.0 * MM3]), np.array([190.0 * KPA]), law)
    assert command.pressure / KPA == pytest.approx([95])


def test_command_beyond_the_supply_is_not_clamped(law):
    command = air_command(np.array([1000.0 * MM3]), np.zeros(1), law)
    assert command.pressure[0] > PROFILE.extruder.pressure_max
