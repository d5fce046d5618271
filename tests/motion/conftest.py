"""A planner's limits, and a way to run one; helper modules lie beside."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.planner import Planner, all_tracks
from cdhr_host.motion.sampling import Timeline

sys.path.insert(0, str(Path(__file__).parent))

from motion_tracks import PERIOD, joined


@pytest.fixture
def limits():
    return MotionLimits(
        speed=0.1, acceleration=0.5, jerk=5.0, half_width=0.74e-3, stop_angle=math.radians(150)
    )


@pytest.fixture
def run(limits):
    """Commands -> one track; starts where the first command does."""

    def run(commands, *, start=None, period=PERIOD):
        planner = Planner(limits, np.zeros(3) if start is None else np.asarray(start, float))
        return joined(list(all_tracks(planner, Timeline(period), commands)))

    return run
