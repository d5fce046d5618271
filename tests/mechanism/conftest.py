import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from mechanism_oracle import Machine, machine


@pytest.fixture(scope="session")
def simulation() -> Machine:
    return machine("paper-simulation")


@pytest.fixture(scope="session")
def experiment() -> Machine:
    return machine("paper")


@pytest.fixture(params=["paper-simulation", "paper", "paper-wide"])
def any_machine(request: pytest.FixtureRequest) -> Machine:
    return machine(request.param)
