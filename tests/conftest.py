"""What tests leave behind stays away from the user's own, and what they are traced for."""

import atexit
import os
import shutil
import tempfile
from pathlib import Path

import pytest

STATE = tempfile.mkdtemp(prefix="cdhr-tests-")
os.environ["XDG_STATE_HOME"] = STATE
atexit.register(shutil.rmtree, STATE, ignore_errors=True)
HERE = Path(__file__).parent
TRACED = {"program", "mechanism", "motion", "extrusion", "control", "plant", "samples", "pipeline", "laws"}
"""the pure rooms' own tests, of which a share of covered lines is asked; tracing would slow others down"""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave coverage to the tests that it is asked of."""
    for item in items:
        if item.path.relative_to(HERE).parts[0] not in TRACED:
            item.add_marker("no_cover")
