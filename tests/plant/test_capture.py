"""Simulated motion capture."""

import numpy as np
import pytest

from cdhr_host.plant.capture import Camera, SimulatedCapture


def moving(t: float) -> np.ndarray:
    return np.array([0.01 * t, 0.0, 0.0])


def test_a_sample_is_of_the_past_and_says_of_when() -> None:
    source = SimulatedCapture(Camera(rate=50.0, delay=0.05, noise=0.0), moving)
    assert source.latest(0.04) is None
    sample = source.latest(1.0)
    assert sample is not None
    assert (sample.frame, sample.t) == (47, pytest.approx(0.94))
    assert sample.position == pytest.approx(moving(0.94))


def test_noise_is_as_large_as_it_says_and_seeded() -> None:
    frames = np.arange(600) / 60.0 + 1.0
    draws = {
        seed: np.array([SimulatedCapture(Camera(seed=seed), moving).latest(t).position for t in frames])
        for seed in (1, 2)
    }
    again = np.array([SimulatedCapture(Camera(seed=1), moving).latest(t).position for t in frames])
    assert (draws[1] == again).all()
    assert (draws[1] != draws[2]).any()
    assert draws[1][:, 1].std() == pytest.approx(5e-5, rel=0.1)


def test_nothing_is_seen_in_a_gap() -> None:
    source = SimulatedCapture(Camera(delay=0.0, gaps=((1.0, 2.0),)), moving)
    before, after = source.latest(1.9), source.latest(2.1)
    assert before is not None
    assert after is not None
    assert before.t < 1.0 < 2.0 <= after.t


def test_dropped_frames_leave_the_one_before() -> None:
    source = SimulatedCapture(Camera(delay=0.0, dropped=0.5), moving)
    frames = {source.latest(n / 60.0).frame for n in range(60, 660)}
    assert 220 < len(frames) < 380


def test_all_dropped_is_nothing() -> None:
    assert SimulatedCapture(Camera(delay=0.0, dropped=1.0), moving).latest(3.0) is None
