"""Where both platforms go while one slider moves, against kinematics and differences."""

import numpy as np
import pytest

from cdhr_host.mechanism import lengths, slider
from cdhr_host.motion.playback import Beat
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.shift import played_shift
from cdhr_host.pipeline.slide import SPEED, slide
from cdhr_host.units import MM

PROFILE = open_profile("paper")
PERIOD = PROFILE.drives.period
MACHINE = Staircase(PROFILE)
STANDING = np.array([1.0, 2.0, -0.5, 0.3, 0.0, -1.0]) * MM


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("distance", [0.1 * MM, -1.0 * MM])
def test_cables_of_the_poses_are_the_sliders(axis: int, distance: float) -> None:
    way = np.zeros(6)
    way[axis] = distance
    nozzle, upper = slide(MACHINE.rig, STANDING, way, PERIOD)
    cables = MACHINE.rig.cables
    places = slider(cables, lengths(cables, nozzle.place - cables.reference_G, upper.place))
    assert np.abs(np.delete(places - STANDING, axis, axis=1)).max() < 1e-12
    moved = places[:, axis] - STANDING[axis]
    assert moved[[0, -1]] == pytest.approx([0.0, distance], abs=1e-12)
    assert (np.diff(moved * np.sign(distance)) >= -1e-15).all()
    assert np.abs(np.diff(moved)).max() / PERIOD <= SPEED


@pytest.mark.parametrize("axis", [0, 4])
def test_velocities_are_those_of_the_places(axis: int) -> None:
    way = np.zeros(6)
    way[axis] = 1.0 * MM
    for motion in slide(MACHINE.rig, STANDING, way, PERIOD):
        inner = slice(1, -1)
        speed = np.gradient(motion.place, PERIOD, axis=0)
        assert motion.velocity[inner] == pytest.approx(speed[inner], abs=5e-6)
        change = np.gradient(motion.velocity, PERIOD, axis=0)
        assert motion.acceleration[inner] == pytest.approx(change[inner], abs=2e-4)
        assert np.abs(motion.velocity[[0, -1]]).max() < 1e-12
        assert np.abs(motion.acceleration[[0, -1]]).max() < 1e-9


def test_played_slower_it_takes_the_same_way() -> None:
    way = np.array([1.0, 0, 0, 0, 0, 0]) * MM
    machine = MACHINE.apart()
    step = machine.moved(*slide(machine.rig, np.zeros(6), way, PERIOD))
    u = step.track.tick[0] + np.arange(0.0, len(step.track.tick) - 1, 0.25)
    slow = played_shift(step, np.arange(len(u)), Beat(u, np.full(len(u), 0.25), np.zeros(len(u))), PERIOD)
    whole = slice(None, None, 4)
    assert slow.track.position_G[whole] == pytest.approx(step.track.position_G[:-1], abs=1e-12)
    assert slow.track.velocity[whole] == pytest.approx(step.track.velocity[:-1] / 4, abs=1e-12)
    checked = machine.shifted(slow)
    assert not checked.problems
    assert np.abs(checked.setpoints.slider[:, 1:]).max() < 1e-9


def test_the_machine_stands_where_the_slider_left_it() -> None:
    machine = MACHINE.apart()
    nozzle, upper = slide(machine.rig, np.zeros(6), np.array([0, 0, 0, 0, 0, -1.0]) * MM, PERIOD)
    machine.moved(nozzle, upper)
    assert (machine.standing_G == nozzle.place[-1]).all()
    assert machine.upper == pytest.approx(upper.place[-1], abs=1e-15)
