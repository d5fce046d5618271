"""Shapers against the oscillator they are made for, and shaped motion against its bounds."""

import math

import numpy as np
import pytest
from motion_tracks import PERIOD, differences, distance_to, joined, moves, norm

from cdhr_host.motion.planner import Planner, all_tracks
from cdhr_host.motion.sampling import Timeline
from cdhr_host.motion.shaping import UNSHAPED, residual, shaper
from cdhr_host.values import Dwell

KINDS = ["zv", "mzv", "ei"]


def ringing(positions, period, frequency, damping, after):
    """Amplitude (m) of an oscillator driven by a position (N,), from the row ``after`` on."""
    omega = 2 * math.pi * frequency
    state, substeps = np.zeros(2), 8
    step = period / substeps
    exact = _transition(omega, damping, step)
    amplitude = 0.0
    for n in range(1, len(positions)):
        for k in range(substeps):
            target = positions[n - 1] + (positions[n] - positions[n - 1]) * (k + 0.5) / substeps
            state = exact @ (state - [target, 0.0]) + [target, 0.0]
        if n >= after:
            amplitude = max(amplitude, abs(state[0] - positions[n]))
    return amplitude


def _transition(omega, damping, step):
    from scipy.linalg import expm

    return expm(np.array([[0.0, 1.0], [-(omega**2), -2 * damping * omega]]) * step)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("damping", [0.0, 0.05, 0.2])
def test_weights_are_a_mean_and_delays_ascend(kind, damping):
    made = shaper(kind, 14.0, damping)
    assert made.weight.sum() == pytest.approx(1.0)
    assert (made.weight > 0).all()
    assert made.delay[0] == 0.0
    assert (np.diff(made.delay) > 0).all()
    assert made.length <= 1.0 / (14.0 * math.sqrt(1 - damping**2)) * (1 + 1e-12)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.2])
def test_residual_vibration_at_the_frequency_it_is_made_for(damping):
    assert residual(shaper("zv", 14.0, damping), 14.0, damping) < 1e-12
    assert residual(shaper("mzv", 14.0, 0.0), 14.0, 0.0) < 1e-12
    assert residual(shaper("ei", 14.0, 0.0), 14.0, 0.0) == pytest.approx(0.05)
    assert residual(UNSHAPED, 14.0, 0.0) == pytest.approx(1.0)


def test_ei_forgives_a_wrong_frequency_more_than_zv():
    off = [residual(shaper(kind, 14.0, 0.0), 14.0 * 1.15, 0.0) for kind in ("zv", "ei")]
    assert off[1] < off[0] / 2


@pytest.mark.parametrize("kind", KINDS)
def test_a_corner_rings_a_tenth_at_most(kind, limits):
    corner = [moves([[0, 0, 0], [0.05, 0, 0], [0.05, 0.05, 0]], 0.06), Dwell(9, 1.0)]
    made = shaper(kind, 8.0, 0.02)
    amplitude = {}
    for name, used in (("unshaped", UNSHAPED), ("shaped", made)):
        track = joined(list(all_tracks(Planner(limits, np.zeros(3)), Timeline(0.001, used), corner)))
        for axis in (0, 1):
            still = int(np.flatnonzero(np.abs(track.velocity[:, axis]) > 1e-12)[-1]) + 2
            amplitude[name, axis] = ringing(track.position_G[:, axis], 0.001, 8.0, 0.02, still)
    for axis in (0, 1):
        assert amplitude["shaped", axis] <= 0.1 * amplitude["unshaped", axis]


@pytest.mark.parametrize("kind", KINDS)
def test_shaped_motion_keeps_limits_and_leaves_the_path_no_more_than_stated(kind, limits):
    points = np.cumsum(np.random.default_rng(3).normal(size=(60, 3)) * 5e-3, axis=0)
    made = shaper(kind, 14.0, 0.05)
    track = joined(
        list(all_tracks(Planner(limits, points[0]), Timeline(PERIOD, made), [moves(points, 0.06)]))
    )
    speed, acceleration, jerk = differences(track)
    assert speed <= 0.06 * (1 + 1e-9)
    assert acceleration <= limits.acceleration * 1.001
    assert jerk <= limits.jerk * 1.001
    deviation = distance_to(track.position_G, points).max()
    assert deviation <= limits.half_width / 3 + made.deviation(limits.acceleration)
    assert np.allclose(track.position_G[[0, -1]], points[[0, -1]], atol=1e-11)
    assert not norm(track.velocity[-1:]).any()
    assert np.array_equal(track.tick, np.arange(len(track.tick)))


def test_clay_stays_in_phase_with_the_nozzle(limits):
    made = shaper("zv", 10.0, 0.0)
    program = [moves([[0, 0, 0], [0.05, 0, 0], [0.1, 0, 0]], 0.02, clay=[5e-7, 0.0])]
    track = joined(list(all_tracks(Planner(limits, np.zeros(3)), Timeline(1e-3, made), program)))
    assert track.flow.sum() * 1e-3 == pytest.approx(5e-7, rel=1e-3)
    last = track.position_G[np.flatnonzero(track.flow > 0)[-1], 0]
    assert last == pytest.approx(0.05, abs=0.02 * made.length)
    assert (np.diff(track.line) >= 0).all()


def test_stretches_shorter_than_the_shaper_are_all_seen(limits):
    steps = [moves([[0.001 * n, 0, 0], [0.001 * (n + 1), 0, 0]], 0.06, line=[n + 1]) for n in range(6)]
    commands = [command for step in steps for command in (step, Dwell(90, 0.002))]
    made = shaper("ei", 2.0, 0.0)
    track = joined(list(all_tracks(Planner(limits, np.zeros(3)), Timeline(PERIOD, made), commands)))
    _, acceleration, jerk = differences(track)
    assert acceleration <= limits.acceleration * 1.001
    assert jerk <= limits.jerk * 1.001
    assert track.position_G[-1] == pytest.approx([0.006, 0, 0], abs=1e-11)
