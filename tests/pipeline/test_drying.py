"""Pauses and drying: the nozzle goes away above all clay, comes back, and is primed before it lays again."""

import numpy as np
import pytest

from cdhr_host.drives.rows import joined
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.profile import Profile
from cdhr_host.units import MM, MM3
from cdhr_host.values import Setpoints

PAPER = open_profile("paper")
TOWER = "G1 X30 Y0 Z6 F1200\nG1 X40 E50\nG1 X-20 Y10 Z2 F1200\nG1 X-40 E60\n"
AFTER = "G1 X-40 Y20 E70\n"
PARKED = {"pauses_lift": True, "pauses_park": True, "lift": 15 * MM, "park_x": 5 * MM, "park_y": -35 * MM}


def machine(**rules: object) -> Profile:
    return PAPER.model_copy(update={"job": PAPER.job.model_copy(update=rules)})


def rows(text: str, profile: Profile) -> Setpoints:
    return joined([part for part in Staircase(profile).setpoints([text.encode()]) if len(part)])


def bead(of: Setpoints) -> np.ndarray:
    return of.nozzle_G[of.flow > 0.0]


@pytest.mark.parametrize("word", ["M0", "M1", "M600", "M601"])
def test_a_pause_parks_above_all_clay_and_comes_back(word: str) -> None:
    plain, parked = (
        rows(TOWER + word + "\n" + AFTER, machine(**rules)) for rules in ({"pauses_lift": False}, PARKED)
    )
    beside = np.hypot(parked.nozzle_G[:, 0] - 5 * MM, parked.nozzle_G[:, 1] + 35 * MM)
    there = parked.nozzle_G[beside < 1e-6]
    assert len(there)
    np.testing.assert_allclose(there[:, 2], 21 * MM, atol=1e-9)
    away = (parked.nozzle_G[:, 1] < -1e-6) | (parked.nozzle_G[:, 2] > 6.1 * MM)
    assert (parked.flow[away] == 0.0).all()
    across = np.ptp(parked.nozzle_G[away & (parked.nozzle_G[:, 2] < 20.5 * MM)][:, :2], axis=0)
    assert (across < 1 * MM).all()
    np.testing.assert_allclose(bead(parked)[-1], bead(plain)[-1], atol=1e-7)
    assert parked.flow.sum() == pytest.approx(plain.flow.sum(), rel=1e-3)
    assert parked.t[-1] > plain.t[-1] + 2.0


def test_a_lift_alone_goes_straight_up() -> None:
    lifted = rows(TOWER + "M0\n" + AFTER, machine(pauses_lift=True, pauses_park=False, lift=15 * MM))
    high = lifted.nozzle_G[lifted.nozzle_G[:, 2] > 7 * MM]
    assert high[:, 2].max() == pytest.approx(17 * MM, abs=1e-6)
    np.testing.assert_allclose(high[:, :2], [[-40 * MM, 10 * MM]] * len(high), atol=1e-9)


def test_clay_is_pushed_before_a_bead_that_follows_a_pause() -> None:
    plain = rows(TOWER + "M0\n" + AFTER, machine(**PARKED))
    primed = rows(TOWER + "M0\n" + AFTER, machine(**PARKED, resume_prime=0.4))
    more = (primed.flow.sum() - plain.flow.sum()) * PAPER.drives.period
    wanted = plain.flow[plain.line == 6].max()
    assert more == pytest.approx(0.4 * wanted, rel=0.02)
    still = np.linalg.norm(np.diff(primed.nozzle_G, axis=0), axis=1) < 1e-12
    pushed = still & (primed.flow[1:] > 0.0)
    assert pushed.sum() * PAPER.drives.period == pytest.approx(0.4, abs=0.02)
    np.testing.assert_allclose(
        primed.nozzle_G[1:][pushed], [[-40 * MM, 10 * MM, 2 * MM]] * pushed.sum(), atol=1e-9
    )


def test_a_tall_arc_on_its_side_is_cleared() -> None:
    text = "G1 X10 Z2 F1200\nG18\nG3 X30 Z2 I10 K0 E20\nM0\nG17\nG1 X40 E25\n"
    parked = rows(text, machine(**PARKED))
    assert parked.nozzle_G[:, 2].max() >= 12 * MM + 15 * MM - 1e-6
    assert parked.flow.max() > 10 * MM3
