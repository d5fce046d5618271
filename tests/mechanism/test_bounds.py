"""Bounds over the whole bed against what happens at random places of it."""

import numpy as np
from mechanism_oracle import Machine, workspace

from cdhr_host.mechanism import cable_state, direction_change_bound


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
