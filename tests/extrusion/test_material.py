"""A profile's clay as a law of flow."""

import numpy as np
import pytest

from cdhr_host.extrusion import Channel, LinearFlow, bores, clay_findings, flow_law
from cdhr_host.pipeline import open_profile
from cdhr_host.profile import Clay
from cdhr_host.units import KPA, MM, MM3


@pytest.fixture(scope="module")
def profile():
    return open_profile("paper")


def test_line_is_the_extruders(profile):
    law = flow_law(profile.extruder, profile.clay)
    assert law == LinearFlow(pytest.approx(60 * KPA), pytest.approx(0.35 * KPA / MM3))
    assert clay_findings(profile) == []


def test_paste_goes_through_nozzle_and_hose(profile):
    assert bores(profile.extruder) == (
        Channel(5 * MM, 20 * MM),
        Channel(40 * MM, pytest.approx(150 * MM)),
    )
    law = flow_law(profile.extruder, Clay(model="herschel-bulkley", yield_stress_pa=600.0))
    assert law.threshold == pytest.approx(4 * 600.0 * (20 / 5 + 150 / 40))
    assert law.flow(law.pressure(np.array([250 * MM3]))) == pytest.approx([250 * MM3])


def test_no_hose_is_the_nozzle_alone(profile):
    short = profile.extruder.model_copy(update={"hose_length": 0.0})
    assert bores(short) == (Channel(5 * MM, 20 * MM),)
