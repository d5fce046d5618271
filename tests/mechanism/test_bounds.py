"""Bounds over the whole bed against what happens at random places of it."""

import numpy as np
import pytest
from mechanism_oracle import Machine, workspace
from numpy.testing import assert_allclose

from cdhr_host.mechanism import (
    Policy,
    PolicyName,
    UpperMotion,
    cable_state,
    direction_change_bound,
    transition,
    upper_bounds,
)


def test_cables_bend_less_than_their_bound(any_machine: Machine) -> None:
    """At unit speed l'' without acceleration is the turning of the cable."""
    bed, rng = any_machine.profile.bed, np.random.default_rng(31)
    points_G = workspace(rng, 20_000, bed.radius, 0.0, bed.height)
    q = points_G - any_machine.cables.reference_G
    v = rng.normal(size=q.shape)
    v /= np.linalg.norm(v, axis=1)[:, None]
    bending = cable_state(any_machine.cables, any_machine.loads, q, q, v, np.zeros_like(q)).acceleration
    bound = direction_change_bound(any_machine.profile)
    assert bending.min() >= 0.0
    assert 0.2 * bound < bending.max() < bound


@pytest.mark.parametrize("name", ["vertical", "free"])
def test_the_upper_platform_moves_within_its_bounds(any_machine: Machine, name: PolicyName) -> None:
    """Random places of the bed, and third derivatives by differences along random curves."""
    profile, rng, h = any_machine.profile, np.random.default_rng(32), 1e-3
    policy = Policy.from_profile(profile, name)
    bounds = upper_bounds(profile, policy)
    q = workspace(rng, 5_000, profile.bed.radius, 0.0, profile.bed.height) - any_machine.cables.reference_G
    v, a, j = rng.normal(size=(3, *q.shape))
    v *= 0.1 / np.linalg.norm(v, axis=1)[:, None]

    def at(t: float) -> UpperMotion:
        return policy.follow(q + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t)

    size = [np.linalg.norm(part, axis=1) for part in (v, a, j)]
    found = at(0.0)
    jerk = np.linalg.norm((at(h).acceleration - at(-h).acceleration) / (2 * h), axis=1)
    assert (np.linalg.norm(found.velocity, axis=1) <= bounds.slope * size[0]).all()
    assert (
        np.linalg.norm(found.acceleration, axis=1) <= bounds.slope * size[1] + bounds.bend * size[0] ** 2
    ).all()
    limit = bounds.slope * size[2] + 3 * bounds.bend * size[0] * size[1] + bounds.twist * size[0] ** 3
    assert (jerk <= limit * (1 + 1e-6)).all()


def test_a_constant_offset_moves_like_the_nozzle(any_machine: Machine) -> None:
    for name in ("fixed", "preload"):
        assert upper_bounds(any_machine.profile, Policy.from_profile(any_machine.profile, name)) == (1, 0, 0)


def test_the_upper_platform_goes_to_its_place_within_limits() -> None:
    start, end, period = np.zeros(3), np.array([0.01, -0.02, 0.03]), 0.004
    limits = (0.2, 0.8, 10.0)
    moved = transition(start, end, limits, period)
    assert_allclose(moved.place[-1], end, rtol=0, atol=1e-15)
    assert_allclose(moved.velocity[-1], 0.0, atol=1e-14)
    assert_allclose(moved.acceleration[-1], 0.0, atol=1e-12)
    places = np.vstack([start, moved.place])
    assert_allclose(np.gradient(places, period, axis=0)[1:-1], moved.velocity[:-1], atol=2e-4)
    jerk = np.diff(np.vstack([np.zeros(3), moved.acceleration]), axis=0) / period
    used = [
        np.linalg.norm(part, axis=1).max() / limit
        for part, limit in zip((moved.velocity, moved.acceleration, jerk), limits, strict=True)
    ]
    assert 0.95 < max(used) <= 1.0


def test_no_way_takes_no_time() -> None:
    moved = transition(np.ones(3), np.ones(3), (0.2, 0.8, 10.0), 0.004)
    assert [part.shape for part in moved] == [(0, 3)] * 3
