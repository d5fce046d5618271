"""Flow the air cannot push lowers the speed, there, and is told."""

import numpy as np
import pytest

from cdhr_host.errors import MotionError
from cdhr_host.extrusion import flow_law
from cdhr_host.pipeline import Staircase, open_profile, prove
from cdhr_host.plant import Clay, Paste
from cdhr_host.units import KPA, MM, MM3

PAPER = open_profile("paper")
STONEWARE = open_profile("paper", "stoneware")
FAST = b"M83\nG1 X10 E100 F1200\nG1 X30 E800 F1200\nG1 X40 E100 F1200\nG1 E20 F60000\n"
"""mm³/s: 200, 800, 200 at 20 mm/s; the air of ``paper`` pushes 400"""


def logged(profile, text):
    blocks = []
    proof = prove([text], profile, sink=blocks.append)
    assert proof.ok, proof.problems
    return proof, {
        name: np.concatenate([getattr(block, name) for block in blocks])
        for name in ("line", "flow", "pressure", "nozzle_G", "t")
    }


def test_too_much_flow_is_slower_there_and_told_with_line_and_numbers():
    proof, rows = logged(PAPER, FAST)
    speed = (
        np.linalg.norm(np.diff(rows["nozzle_G"], axis=0, prepend=rows["nozzle_G"][:1]), axis=1) / 0.004 / MM
    )
    line = rows["line"]
    assert speed[line == 3].max() == pytest.approx(10.0, rel=1e-3)
    assert speed[line == 2].max() == pytest.approx(20.0, rel=1e-3)
    assert rows["flow"].max() == pytest.approx(400 * MM3)
    assert rows["pressure"].max() <= PAPER.extruder.pressure_max * (1 + 1e-9)
    told = [(warning.line, warning.message) for warning in proof.warnings]
    assert told[0][0] == 3
    assert "800 mm³/s of clay need 340 kPa, the air gives 200 kPa" in told[0][1]
    assert "at 10 instead of 20 mm/s" in told[0][1]
    assert told[1] == (5, "2 lines are slowed down for the air, this one most: to 40 %")


def test_with_the_air_led_pressure_stays_within_what_there_is_at_every_tick():
    text = b"M83\nG1 Z2 F1200\n" + b"".join(
        b"G1 X%d Y%d E1200 F6000\n" % (x, y) for x, y in [(60, 0), (60, 60), (0, 60), (0, 0)]
    )
    proof, rows = logged(STONEWARE, text)
    law, extruder = flow_law(STONEWARE.extruder, STONEWARE.clay), STONEWARE.extruder
    assert rows["pressure"].max() <= extruder.pressure_max
    assert rows["pressure"].min() >= 0.0
    assert law.pressure(rows["flow"]).max() <= 0.85 * extruder.pressure_max * (1 + 1e-9)
    assert proof.warnings[0].line == 3
    clay = Clay(Paste.from_profile(STONEWARE), 0.004)
    _, _, laid = clay.step(clay.standing(), np.arange(len(rows["flow"])), rows["pressure"])
    way = np.cumsum(np.linalg.norm(np.diff(rows["nozzle_G"], axis=0, prepend=rows["nozzle_G"][:1]), axis=1))
    place = np.floor(way / MM + 1e-6).astype(int)
    planned, found = (np.bincount(place, each) for each in (rows["flow"], laid))
    inside = planned > 0.9 * np.median(planned[planned > 0.0])
    assert np.abs(found[inside] / planned[inside] - 1.0).max() < 0.05


def test_flow_within_the_air_is_neither_slowed_nor_told():
    proof, rows = logged(PAPER, b"M83\nG1 X20 E200 F1200\n")
    assert not proof.warnings
    assert rows["flow"].max() == pytest.approx(200 * MM3)


def test_clay_that_nothing_can_push_is_refused_with_its_line():
    extruder = PAPER.extruder.model_copy(update={"pressure_threshold": 200e3})
    stiff = PAPER.model_copy(update={"extruder": extruder})
    with pytest.raises(MotionError) as refused:
        list(Staircase(stiff).setpoints([b"G1 X5 F600\nG1 X9 E4\n"]))
    problem = refused.value.problems[0]
    assert (problem.line, problem.kind, problem.limit) == (2, "pressure", 200e3 / KPA)


def test_the_first_bead_waits_until_the_air_is_ready():
    text = b"M83\nG1 X20 E200 F1200\n"
    _, plain = logged(PAPER, text)
    _, rows = logged(STONEWARE, text)
    begins = [float(each["t"][np.flatnonzero(each["flow"])[0]]) for each in (plain, rows)]
    lead = STONEWARE.clay.open_dead + 3 * (STONEWARE.clay.line_lag + STONEWARE.drives.regulator_lag)
    assert begins[1] - begins[0] == pytest.approx(lead, abs=0.02)
    assert rows["pressure"][:2].max() == 0.0 or np.flatnonzero(rows["pressure"])[0] <= 4
