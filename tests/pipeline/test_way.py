"""Sliders as cubics along the path are where the cables have them."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import chebyshev

from cdhr_host.mechanism import lengths
from cdhr_host.motion.leg import Leg
from cdhr_host.motion.sampling import Timed
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.rig import Rig
from cdhr_host.pipeline.ticking import _tick, ticked
from cdhr_host.pipeline.tracer import Tracer
from cdhr_host.pipeline.way import NEAR, Turns, places, way

PAPER = open_profile("paper")
RATE = 1000.0
STAR = "G1 Z5 F6000\n" + "".join(
    f"G1 X{radius * math.cos(turn):.3f} Y{radius * math.sin(turn):.3f} Z{5 + n} E{n}\n"
    for n, (radius, turn) in enumerate(zip([90, 20, 70, 5, 60] * 3, np.arange(15) * 1.9, strict=True))
)
"""long legs, sharp and blunt corners, on every side of the axis"""
CIRCLE = "G1 X80 Y0 Z3 F3000\n" + "".join(
    f"G1 X{80 * math.cos(turn):.4f} Y{80 * math.sin(turn):.4f} E{turn:.4f}\n"
    for turn in np.arange(0.0, 6.0, 0.3 / 80)
)
POINT = st.tuples(st.integers(-60, 60), st.integers(-60, 60), st.integers(0, 40))
MACHINES = [
    ("paper", "free", "swivel"),
    ("paper-wide", "vertical", "swivel"),
    ("paper-simulation", "free", "swivel"),
    ("paper", "fixed", "caster"),
    ("paper", "preload", "fixed-plane"),
    ("paper", "free", "point"),
]


def machine(name, policy, pulley):
    profile = open_profile(name)
    changed = {"spring": {"policy": policy}, "geometry": {"pulley_model": pulley}}
    return profile.model_copy(
        update={key: getattr(profile, key).model_copy(update=value) for key, value in changed.items()}
    )


def legs(profile, program):
    staircase = Staircase(profile, rate_hz=RATE)
    steps = [step for step in staircase.timed([program.encode()]) if isinstance(step, Timed)]
    return staircase.rig, [step for step in steps if isinstance(step.stretch, Leg)]


def compared(rig, timed):
    """Samples of a leg, and what the compiled loop has at the same ticks."""
    leg = timed.stretch
    track = timed.track(np.arange(timed.ticks.start, timed.ticks.stop))
    known = way(rig, leg, places(leg, Turns.of(rig)))
    return track, ticked(leg, known, timed.laid[-1].elapsed(track.tick * timed.period))


@pytest.mark.parametrize("given", MACHINES, ids="-".join)
@pytest.mark.parametrize("program", [STAR, CIRCLE], ids=["star", "circle"])
def test_sliders_are_as_near_as_stated_at_every_tick(given, program):
    rig, found = legs(machine(*given), program)
    worst = 0.0
    for timed in found:
        track, quick = compared(rig, timed)
        worst = max(worst, np.abs(quick.slider.T - rig.slider_places(track)).max())
    assert 0.0 < worst <= NEAR


@settings(max_examples=12, deadline=None)
@given(st.lists(POINT, min_size=1, max_size=6), st.sampled_from([1200, 6000]))
def test_the_nozzle_is_where_the_path_is_to_the_bit(points, feed):
    program = "".join(f"G1 X{x} Y{y} Z{z} E{n} F{feed}\n" for n, (x, y, z) in enumerate(points))
    rig, found = legs(PAPER, program)
    for timed in found:
        track, quick = compared(rig, timed)
        carried = timed.stretch.segments
        assert np.array_equal(quick.nozzle_G.T, track.position_G)
        assert np.array_equal(carried.line[quick.segment], track.line)
        assert quick.speed == pytest.approx(np.linalg.norm(track.velocity, axis=1), rel=1e-12, abs=1e-15)
        assert np.array_equal(quick.speed > 0.0, np.linalg.norm(track.velocity, axis=1) > 0.0)
        assert np.abs(quick.slider.T - rig.slider_places(track)).max() <= NEAR


@pytest.mark.parametrize("policy", ["fixed", "free"])
@pytest.mark.parametrize("name", ["paper", "paper-wide", "paper-simulation"])
def test_sliders_turn_nowhere_more_than_stated(name, policy):
    """Derivatives along random lines over the bed, from the polynomial through nine places of each."""
    profile = machine(name, policy, "swivel")
    rig, half, count = Rig.from_profile(profile), 0.01, 2000
    rng = np.random.default_rng(1)
    radius, angle = profile.bed.radius * np.sqrt(rng.random(count)), rng.random(count) * 2 * math.pi
    height = rng.random(count) * profile.bed.height
    start = np.column_stack((radius * np.cos(angle), radius * np.sin(angle), height))
    lines = rng.normal(size=(count, 3))
    lines *= half / np.linalg.norm(lines, axis=1)[:, None]
    nodes = chebyshev.chebpts1(9)
    along = [start - rig.cables.reference_G + node * lines for node in nodes]
    values = [lengths(rig.cables, q, rig.policy.upper(q)).ravel() for q in along]
    fitted, turns = chebyshev.chebfit(nodes, np.array(values), 8), Turns.of(rig)
    for order, bound in ((2, turns.second), (3, turns.third), (4, turns.fourth)):
        found = np.abs(chebyshev.chebval(0.0, chebyshev.chebder(fitted, order))).max() / half**order
        assert 1e-3 * bound < found <= bound


@pytest.mark.parametrize("shaper", ["none", "zv"])
@pytest.mark.parametrize("stretch", ["off", "on"])
def test_traces_are_the_setpoints_whatever_the_way_there(shaper, stretch):
    """Shaped motion and cables that stretch are worked out tick by tick."""
    changed = {"path": {"shaper": shaper}, "stretch": {"compensation": stretch}}
    profile = PAPER.model_copy(
        update={key: getattr(PAPER, key).model_copy(update=value) for key, value in changed.items()}
    )
    program = [STAR.encode()]
    staircase = Staircase(profile, rate_hz=RATE)
    tracer = Tracer(staircase.rig, staircase.period)
    traces = [trace for step in staircase.timed(program) for trace in given_to(tracer, step)]
    traces += tracer.finish()
    rows = list(Staircase(profile, rate_hz=RATE).setpoints(program))
    for name in ("tick", "line", "nozzle_G"):
        quick, full = (np.concatenate([getattr(each, name) for each in found]) for found in (traces, rows))
        assert np.array_equal(quick, full)
    for name, near in (("slider", NEAR), ("flow", 1e-18), ("pressure", 1e-6)):
        quick, full = (np.concatenate([getattr(each, name) for each in found]) for found in (traces, rows))
        assert np.abs(quick - full).max() <= near


def given_to(tracer, step):
    """What a tracer makes of a step of a staircase."""
    moved = not hasattr(step, "line") or isinstance(step, Timed)
    return tracer.traces(step) if moved else tracer.command(step)


def test_what_was_compiled_is_kept():
    rig, (timed, *_) = legs(PAPER, "G1 X50 F3000\n")
    compared(rig, timed)
    assert list(Path(_tick.stats.cache_path).glob("ticking._tick-*.nbc"))
