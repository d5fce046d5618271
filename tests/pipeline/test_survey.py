"""A proof by bounds finds what a look at every setpoint finds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.mechanism import nine_tensions
from cdhr_host.motion.bounds import leg_bounds
from cdhr_host.motion.leg import Leg
from cdhr_host.motion.sampling import Timed
from cdhr_host.pipeline import Staircase, open_profile, prove
from cdhr_host.pipeline.rig import Rig
from cdhr_host.pipeline.survey import Survey, _refined, force_slope

PAPER = open_profile("paper")
POINT = st.tuples(st.integers(-330, 330), st.integers(-330, 330), st.integers(0, 120))


def text(points, feed=3000):
    lines = [f"G1 X{x} Y{y} Z{z} E{n} F{feed}" for n, (x, y, z) in enumerate(points)]
    return ("\n".join(lines) + "\n").encode()


def legs(program, profile=PAPER):
    staircase = Staircase(profile)
    return [step for step in staircase.timed([program]) if isinstance(step, Timed)]


def told(proof):
    """What is refused, but for collisions, which are looked for at samples in either case."""
    return {problem for problem in proof.problems if problem.kind != "clearance"}


@settings(max_examples=60, deadline=None)
@given(st.lists(POINT, min_size=1, max_size=5))
def test_problems_are_those_of_every_setpoint(points):
    program = text(points)
    quick = prove([program], PAPER)
    full = prove([program], PAPER, sink=lambda _: None)
    assert told(quick) == told(full)
    assert quick.duration == full.duration


@settings(max_examples=60, deadline=None)
@given(st.lists(POINT, min_size=2, max_size=8), st.sampled_from([600, 3000, 6000]))
def test_bounds_hold_at_every_tick(points, feed):
    for timed in legs(text(points, feed)):
        if not isinstance(timed.stretch, Leg):
            continue
        found = leg_bounds(timed.stretch)
        for track in timed.tracks():
            assert np.linalg.norm(track.velocity, axis=1).max() <= found.speed * (1 + 1e-9)
            assert np.linalg.norm(track.acceleration, axis=1).max() <= found.acceleration * (1 + 1e-9) + 1e-12
            assert track.flow.max() <= found.flow * (1 + 1e-9)
        assert found.over_feed <= 1 + 1e-9
        assert found.speed <= PAPER.limits.speed_max * (1 + 1e-9)
        assert found.acceleration <= PAPER.limits.acceleration_max * (1 + 1e-9)
        assert found.jerk <= PAPER.limits.jerk_max * (1 + 1e-9)


@pytest.mark.parametrize("policy", ["fixed", "free"])
@pytest.mark.parametrize("name", ["paper", "paper-wide", "paper-simulation"])
def test_resting_forces_are_nowhere_steeper_than_stated(name, policy):
    """Random short ways over the bed."""
    profile = open_profile(name)
    spring = profile.spring.model_copy(update={"policy": policy})
    rig = Rig.from_profile(profile.model_copy(update={"spring": spring}))
    rng = np.random.default_rng(1)
    count, step = 20_000, 1e-6
    radius, angle = profile.bed.radius * np.sqrt(rng.random(count)), rng.random(count) * 2 * math.pi
    height = rng.random(count) * profile.bed.height
    start = np.column_stack((radius * np.cos(angle), radius * np.sin(angle), height))
    way = rng.normal(size=(count, 3))
    way *= step / np.linalg.norm(way, axis=1)[:, None]
    before, after = (
        nine_tensions(rig.cables, rig.loads, rig.pairs, q, rig.policy.upper(q)) for q in (start, start + way)
    )
    steepest = np.abs(after - before).max() / step
    assert 0.4 * force_slope(rig) < steepest <= force_slope(rig)


def test_only_doubtful_intervals_are_refined():
    coarse = np.array([0, 4, 8, 12, 13])
    assert _refined(coarse, np.array([True] * 4)).tolist() == coarse.tolist()
    found = _refined(coarse, np.array([True, False, True, False]))
    assert found.tolist() == [0, 4, 5, 6, 7, 8, 12, 13]


def test_a_harmless_program_needs_few_samples():
    program = b"G1 Z5 F1200\nG1 X80\nG1 Y80\nG4 S5\nG1 X0\n"
    ticks = [len(timed.ticks) for timed in legs(program)]
    survey = Survey(Rig.from_profile(PAPER))
    looked_at = sum(len(track.tick) for timed in legs(program) for track in survey.tracks(timed))
    assert looked_at < sum(ticks) / 10


@pytest.mark.parametrize(
    "change",
    [
        {"limits": {"acceleration_max": 0.1}},
        {"extruder": {"pressure_max": 70e3}},
        {"limits": {"jerk_max": 0.1}},
    ],
)
def test_a_leg_beyond_a_bound_is_looked_at_tick_by_tick(change):
    (section, values), *_ = change.items()
    stricter = PAPER.model_copy(update={section: getattr(PAPER, section).model_copy(update=values)})
    program = b"M83\nG1 X80 E800 F1200\n"
    timed = next(step for step in legs(program) if isinstance(step.stretch, Leg))
    looked_at = np.concatenate([track.tick for track in Survey(Rig.from_profile(stricter)).tracks(timed)])
    assert np.array_equal(looked_at, np.arange(timed.ticks.start, timed.ticks.stop))
