"""21: host, sender and far side as real processes, spoilt while they print; benchmarks/chaos_drives.py."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from chaos_drives import begun

MOMENT = 1.5


@pytest.mark.parametrize(
    ("bus", "victim", "how", "pause"),
    [
        ("slcan", "host", "stop", 6.0),
        ("slcan", "host", "hog", 0.0),
        ("slcan", "line", "unplug", 0.0),
        ("link", "host", "kill", 0.0),
        ("link", "far", "stop", 2.0),
    ],
)
def test_machine_comes_to_rest_without_air_for_good(bus, victim, how, pause):
    outcome = begun(bus, victim, how, MOMENT, pause)
    assert outcome.verdict == ""
    if victim != "host" or how == "kill":
        assert outcome.rest_s < 5.0
        assert outcome.host.startswith("fault") or outcome.host == ""
