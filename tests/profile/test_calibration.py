"""What a measured machine is away from its drawing: shapes, bounds, where it goes."""

import numpy as np
import pytest
from pydantic import ValidationError

from cdhr_host.mechanism import Cables, Loads
from cdhr_host.pipeline import open_profile
from cdhr_host.profile.calibration import Calibration

SIX = [[1.0, 2.0, 3.0]] * 6


def test_nothing_is_the_drawing():
    found = Calibration()
    assert not found.pulleys().any()
    assert not found.attachments().any()
    assert found.greatest() == 0.0


def test_shifts_reach_cables_and_spring():
    paper = open_profile("paper")
    moved = paper.model_copy(
        update={"calibration": Calibration(pulley_shift_mm=SIX, reference_shift_mm=[0.5, 0.0, -1.0])}
    )
    before, after = Cables.from_profile(paper), Cables.from_profile(moved)
    assert np.allclose(after.anchors - before.anchors, [1e-3, 2e-3, 3e-3], rtol=0, atol=1e-15)
    assert np.allclose((after.attachments - before.attachments)[:3], [5e-4, 0, -1e-3], rtol=0, atol=1e-15)
    assert not (after.attachments - before.attachments)[3:].any()
    assert np.allclose(after.reference_G, [5e-4, 0, -1e-3], rtol=0, atol=1e-15)
    loads = Loads.from_profile(moved)
    assert (loads.separation, loads.aside) == (pytest.approx(0.056), (-5e-4, 0.0))


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("pulley_shift_mm", [[1.0, 2.0, 3.0]] * 5, "six rows"),
        ("attachment_shift_mm", [[1.0, 2.0]] * 6, "x, y and z"),
        ("reference_shift_mm", [1.0], "x, y and z"),
        ("reference_shift_mm", [1.0, 2.0, 101.0], "more than 100 mm"),
    ],
)
def test_other_shapes_and_other_machines_are_refused(key, value, words):
    with pytest.raises(ValidationError, match=words):
        Calibration.model_validate({key: value})
