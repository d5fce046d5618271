"""Input shaping on the rigid-body plant, by the benchmark's own measure."""

import numpy as np
import pytest
import shaping
from shaping import DAMPING, STEP, corner, ringing, vibration

from cdhr_host.motion.shaping import UNSHAPED, shaper


@pytest.fixture(scope="module")
def unshaped():
    return vibration(UNSHAPED)


def strength(swing, frequency):
    """Of one frequency in what rings."""
    turned = swing * np.exp(-2j * np.pi * frequency * STEP * np.arange(len(swing)))
    return abs(np.hanning(len(swing)) @ turned)


def test_the_plant_rings_after_a_corner_in_both_sideways_modes(unshaped, monkeypatch):
    """At 50 mm/s in both; at 60 the corner's own shape leaves little of the slower one."""
    assert unshaped > 1e-6
    monkeypatch.setattr(shaping, "SPEED", 0.05)
    swing = ringing(*corner(UNSHAPED))
    between, outside = strength(swing, 16.2), strength(swing, 25.0)
    for mode in (14.3, 18.1):
        assert strength(swing, mode) > 2 * between
        assert strength(swing, mode) > 10 * outside


@pytest.mark.parametrize(
    ("kind", "frequency", "left"), [("zv", 18.0, 0.1), ("mzv", 18.0, 0.1), ("ei", 16.0, 0.05)]
)
def test_every_shaper_leaves_less_than_a_tenth(kind, frequency, left, unshaped):
    assert vibration(shaper(kind, frequency, DAMPING)) < left * unshaped


@pytest.mark.parametrize("mode", [14.3, 18.1])
def test_the_shortest_shaper_takes_the_one_mode_it_is_made_for(mode, monkeypatch):
    monkeypatch.setattr(shaping, "SPEED", 0.05)
    before, after = (ringing(*corner(shaped)) for shaped in (UNSHAPED, shaper("zv", mode, DAMPING)))
    assert strength(after, mode) < 0.1 * strength(before, mode)


def test_smoke_prints_a_row_for_each_shaper(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["shaping.py"])
    monkeypatch.setattr(shaping, "FREQUENCIES", (16.0,))
    shaping.main()
    rows = [line.split("|")[1].strip() for line in capsys.readouterr().out.splitlines()]
    assert rows == ["shaper", "---", "none", "zv", "mzv", "ei"]
