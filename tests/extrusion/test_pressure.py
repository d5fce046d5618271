"""The static pressure model."""

import numpy as np
import pytest

from cdhr_host.extrusion import air_command
from cdhr_host.profile import find, read_table, validate
from cdhr_host.units import KPA, MM3


@pytest.fixture(scope="module")
def extruder():
    return validate(read_table(find("paper")))[0].extruder


def test_flow_needs_threshold_plus_slope(extruder):
    flow = np.array([100.0, 250.0]) * MM3
    command = air_command(flow, np.zeros(2), extruder)
    assert command.pressure / KPA == pytest.approx([60 + 0.35 * 100, 60 + 0.35 * 250])
    assert np.array_equal(command.flow, flow)


def test_no_flow_is_air_off(extruder):
    command = air_command(np.zeros(3), np.zeros(3), extruder)
    assert not command.pressure.any()
    assert not command.flow.any()


def test_held_pressure_gives_the_flow_the_model_says(extruder):
    command = air_command(np.zeros(2), np.array([130.0, 30.0]) * KPA, extruder)
    assert command.pressure / KPA == pytest.approx([130, 30])
    assert command.flow / MM3 == pytest.approx([200, 0])


def test_planned_clay_rules_over_held_air(extruder):
    command = air_command(np.array([100.0 * MM3]), np.array([190.0 * KPA]), extruder)
    assert command.pressure / KPA == pytest.approx([95])


def test_command_beyond_the_supply_is_not_clamped(extruder):
    command = air_command(np.array([1000.0 * MM3]), np.zeros(1), extruder)
    assert command.pressure[0] > extruder.pressure_max
