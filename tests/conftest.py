"""What tests leave behind stays away from the user's own, and what they are traced for."""

import atexit
import os
import shutil
import tempfile
from collections.abc import Generator
from pathlib import Path

import pytest
from coverage import Coverage
from hypothesis import HealthCheck, settings

STATE = tempfile.mkdtemp(prefix="cdhr-tests-")
os.environ["XDG_STATE_HOME"] = STATE
atexit.register(shutil.rmtree, STATE, ignore_errors=True)
settings.register_profile("busy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("busy")  # how busy the computer is meanwhile says nothing about an example
HERE = Path(__file__).parent
TRACED = {"program", "mechanism", "motion", "extrusion", "control", "plant", "samples", "pipeline", "laws"}
"""the pure rooms' own tests, of which a share of covered lines is asked; tracing would slow others down"""
UPSTAIRS = {"test_hostile_doors.py", "test_playback_laws.py", "test_serve_laws.py"}
"""laws of other rooms"""


def traced(item: pytest.Item) -> bool:
    """Whether coverage is asked of this test."""
    return item.path.relative_to(HERE).parts[0] in TRACED and item.path.name not in UPSTAIRS


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Leave coverage to the tests that it is asked of.

    What other tests set up is not traced either. A process of pytest-xdist traces twice, one under the
    other (its own and that of its parent's arguments): both are stopped, or nothing is won.
    """
    stopped: list[Coverage] = []
    while not traced(item) and (tracing := Coverage.current()):
        tracing.stop()
        stopped.append(tracing)
    try:
        return (yield)
    finally:
        for tracing in reversed(stopped):
            tracing.start()
