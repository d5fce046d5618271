"""Steps between nodes, their slopes, and the fastest motion through them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdhr_host.motion.cells import Cells
from cdhr_host.motion.interior import GAP, fastest
from cdhr_host.motion.look_ahead import change_distance, change_time
from cdhr_host.motion.steps import Motion, Slopes, Steps, curvature
from cdhr_host.motion.time_law import time_law

A, J, V = 0.5, 5.0, 0.08
SEEDS = st.integers(0, 10_000)


def steps(path, h, speed=V):
    """Steps of lengths ``h`` along a path with q', q'', q''' (3, 2, 3, N) at both ends."""
    count = len(h)
    q1, q2, q3 = path
    pairs = (q1, q1), (q1, q2), (q2, q2), (q2, q3), (q1, q3), (q3, q3)
    turning = np.stack([(one * other).sum(axis=1) for one, other in pairs])
    limits = (np.full((2, count), each) for each in (speed, A, J))
    return Steps(np.arange(count), np.zeros(count, int), np.asarray(h), turning, *limits)


def straight(h):
    """Steps along x."""
    q1 = np.zeros((2, 3, len(h)))
    q1[:, 0] = 1.0
    return steps((q1, np.zeros_like(q1), np.zeros_like(q1)), h)


def gentle(length, count=241):
    """Lengths of steps, b and a of nodes of a motion from rest to rest that uses half of the limits."""
    one, apart = np.ones((1, 1)), np.full(1, -1)
    bounds = one * V / 2, one * A / 2, one * J / 2
    cell = Cells(np.zeros(1), np.full(1, length), *bounds, length, apart < 0, np.ones((2, 1)), apart)
    law = time_law(cell, np.zeros(2))
    s, v, a = law.at(np.linspace(0.0, law.duration, count))
    a[[0, -1]] = v[[0, -1]] = 0.0
    return np.diff(s), v**2, a


def bent(seed, count=6):
    """Steps of a path that turns, and nodes of a motion along it."""
    rng = np.random.default_rng(seed)
    q1 = rng.normal(size=(2, 3, count))
    q1 /= np.linalg.norm(q1, axis=1)[:, None]
    q2, q3 = (rng.normal(size=q1.shape) * size for size in (50.0, 3e4))
    made = steps((q1, q2, q3), rng.uniform(1e-4, 3e-4, count))
    b = rng.uniform(0.02, 0.04, count + 1) ** 2
    return made, b, rng.uniform(-0.1, 0.1, count + 1)


@given(SEEDS)
def test_halves_of_constant_jerk_lead_from_node_to_node(seed):
    made, b, a = bent(seed)
    motion = Motion.of(made, b, a)
    s, v, change = np.zeros(6), np.sqrt(b[:-1]), a[:-1]
    for j in motion.j:
        x = motion.half
        s = s + x * (v + x * (change / 2 + x * j / 6))
        v, change = v + x * (change + x * j / 2), change + x * j
    assert s == pytest.approx(made.length, rel=1e-12)
    assert v == pytest.approx(np.sqrt(b[1:]), rel=1e-11)
    assert change == pytest.approx(a[1:], abs=1e-10)


@given(SEEDS)
def test_shares_are_the_squares_of_what_the_nozzle_has(seed):
    rng = np.random.default_rng(seed)
    q1, q2, q3 = rng.normal(size=(3, 2, 3, 1)) * np.array([1.0, 50.0, 3e4])[:, None, None, None]
    made = steps((q1, q2, q3), [2e-4])
    motion = Motion.of(made, np.array([9e-4, 1e-3]), np.array([0.05, -0.02]))
    shares = motion.shares(made)
    for end in range(2):
        v, a = motion.v[end, 0], motion.a[end, 0]
        pull = q2[end] * v**2 + q1[end] * a
        assert shares[1, end, 0] == pytest.approx((pull**2).sum() / A**2, rel=1e-10)
        for half in range(2):
            jerk = q3[end] * v**3 + 3 * q2[end] * v * a + q1[end] * motion.j[half, 0]
            assert shares[2 + half, end, 0] == pytest.approx((jerk**2).sum() / J**2, rel=1e-9)


@given(SEEDS)
def test_slopes_are_differences(seed):
    made, b, a = bent(seed)
    slopes = Slopes.of(made, Motion.of(made, b, a))
    for variable in range(4):
        ahead, behind = ([b.copy(), a.copy()] for _ in range(2))
        which, node = variable % 2, 3 + variable // 2
        tiny = 1e-6 * (b[node] if which == 0 else 0.1)
        ahead[which][node] += tiny
        behind[which][node] -= tiny
        one, other = (Motion.of(made, *nodes) for nodes in (ahead, behind))
        column = slice(3, 4)
        half = (one.half - other.half)[column] / (2 * tiny)
        assert half == pytest.approx(slopes.half[variable, column], rel=1e-4)
        jerk = (one.j - other.j)[:, column] / (2 * tiny)
        assert jerk == pytest.approx(slopes.jerk[:, variable, column], rel=1e-4)
        shares = (one.shares(made) - other.shares(made))[..., column] / (2 * tiny)
        largest = np.abs(slopes.share[..., column]).max()
        assert shares == pytest.approx(slopes.share[variable][..., column], rel=1e-3, abs=1e-6 * largest)


@given(SEEDS)
def test_second_derivatives_are_never_less_than_nothing(seed):
    made, b, a = bent(seed)
    motion = Motion.of(made, b, a)
    weight = np.random.default_rng(seed).uniform(0.0, 1.0, motion.shares(made).shape)
    found = curvature(made, motion, Slopes.of(made, motion).jerk, weight)
    assert np.allclose(found, found.transpose(1, 0, 2))
    scale = np.sqrt(np.einsum("ppn->pn", found))
    least = np.linalg.eigvalsh((found / (scale[:, None] * scale)).transpose(2, 0, 1)).min()
    assert least > -1e-9


@pytest.mark.parametrize("length", [0.002, 0.02, 0.1])
def test_on_a_straight_the_fastest_is_a_change_up_and_one_down(length):
    h, b, a = gentle(length)
    made = straight(h)
    found = fastest(made, b, a)
    assert found.solved.all()
    time = 2 * Motion.of(made, found.b, found.a).half.sum()
    peak = V
    if 2 * change_distance(0.0, V, A, J) > length:
        speeds = np.linspace(1e-4, V, 200_001)
        peak = speeds[2 * change_distance(0.0 * speeds, speeds, A, J) <= length].max()
    way = 2 * float(change_distance(0.0, peak, A, J))
    exact = 2 * float(change_time(np.array(peak), A, J)) + max(length - way, 0.0) / peak
    # Inside a step the acceleration may be more than at its ends: that is bounded later.
    assert exact * (1 - GAP) < time < exact * (1 + 2 * GAP)


def test_rows_do_not_know_of_each_other():
    h, b, a = gentle(0.012, 61)
    one = straight(h)
    both = Steps(
        np.append(one.node, one.node + 61),
        np.append(one.row, one.row + 1),
        *(np.concatenate((x, x), axis=-1) for x in (one.length, one.turning)),
        *(np.concatenate((x, x), axis=-1) for x in (one.speed, one.acceleration, one.jerk)),
    )
    alone, pair = fastest(one, b, a), fastest(both, np.append(b, 0.8 * b), np.append(a, 0.8 * a))
    assert pair.solved.tolist() == [True, True]
    assert pair.b[:61] == pytest.approx(alone.b, rel=1e-6)
    parts = slice(61), slice(61, 122)
    times = [2 * Motion.of(one, pair.b[part], pair.a[part]).half.sum() for part in parts]
    assert times[0] == pytest.approx(times[1], rel=2 * GAP)


def test_what_cannot_be_is_said_to_be_unsolved():
    """From full speed to nearly none in 2 mm; and back from what is no motion at all."""
    made = straight(np.full(20, 1e-4))
    b = np.full(21, 1e-8)
    b[0] = V**2
    for a in (np.zeros(21), np.full(21, 1e3)):
        found = fastest(made, b, a)
        assert not found.solved.any()
        assert np.isfinite(found.b).all()
