"""Planned tracks: limits, tolerance, times, ticks and what they carry."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from motion_tracks import PERIOD, differences, distance_to, joined, moves, norm

from cdhr_host.motion import leg, planner
from cdhr_host.motion.leg import BATCH
from cdhr_host.motion.planner import Planner, all_tracks
from cdhr_host.motion.sampling import Timeline
from cdhr_host.values import Arc, Dwell, Moves, Notice, Pause, Prime, Stop

SQUARE = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0], [0, 0, 0]])


def assert_within(track, limits, slack=1e-3):
    speed, acceleration, jerk = differences(track)
    assert speed <= limits.speed * (1 + 1e-9)
    assert acceleration <= limits.acceleration * (1 + slack)
    assert jerk <= limits.jerk * (1 + slack)


def assert_rests(track, start, end):
    assert np.allclose(track.position_G[0], start, atol=1e-12)
    assert np.allclose(track.position_G[-1], end, atol=1e-11)
    assert norm(track.velocity[[0, -1]]).max() < 1e-12
    assert np.array_equal(track.tick, np.arange(len(track.tick)))


def random_walk(seed, steps, size):
    return np.cumsum(np.random.default_rng(seed).normal(size=(steps, 3)) * size, axis=0)


def noisy_line(seed):
    noise = np.random.default_rng(seed).normal(size=(2000, 2)) * 5e-5
    return np.column_stack((np.linspace(0, 0.1, 2000), noise))


def helix(chord, turns, radius=0.05):
    angle = np.arange(0, turns * 2 * math.pi, chord / radius)
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle), 1e-4 * angle))


STRESS = {
    "square": SQUARE,
    "reversal": np.array([[0, 0, 0], [0.05, 0, 0], [0, 1e-4, 0], [0.05, 0, 0]]),
    "one micrometre": np.array([[0, 0, 0], [1e-6, 0, 0]]),
    "duplicates": np.repeat(SQUARE, 3, axis=0),
    "long zigzag": random_walk(1, 400, 2e-3),
    "short zigzag": random_walk(2, 3000, 2e-4),
    "micrometre zigzag": random_walk(3, 3000, 1e-6),
    "noise": noisy_line(4),
    "helix of 0.3 mm": helix(3e-4, 3),
    "helix of 0.01 mm": helix(1e-5, 0.2),
}


@pytest.mark.parametrize("name", STRESS)
@pytest.mark.parametrize("speed", [0.02, 0.06])
def test_stress_paths_keep_limits_and_tolerance(name, speed, run, limits):
    points = STRESS[name]
    track = run([moves(points, speed)], start=points[0])
    assert_within(track, limits)
    assert differences(track)[0] <= speed * (1 + 1e-9)
    assert_rests(track, points[0], points[-1])
    deviation = distance_to(track.position_G[:: len(track.tick) // 3000 + 1], points)
    assert deviation.max() <= limits.half_width / 3
    covered = distance_to(points[:: len(points) // 400 + 1], track.position_G)
    assert covered.max() <= limits.half_width / 3 + speed * PERIOD


def test_analytic_velocity_and_acceleration_are_the_positions_derivatives(run):
    track = run([moves(STRESS["long zigzag"], 0.03)], start=STRESS["long zigzag"][0], period=1e-4)
    middle = (track.position_G[2:] - track.position_G[:-2]) / 2e-4
    assert np.abs(middle - track.velocity[1:-1]).max() < 1e-4 * 0.5
    bend = (track.velocity[2:] - track.velocity[:-2]) / 2e-4
    assert np.abs(bend - track.acceleration[1:-1]).max() < 1e-4 * 5.0


def test_circle_of_short_chords_runs_at_constant_speed(run):
    angle = np.linspace(0, 2 * math.pi, 1048)
    circle = 0.05 * np.column_stack((np.cos(angle), np.sin(angle), 0 * angle))
    track = run([moves(circle, 0.02)], start=circle[0])
    away = norm(track.position_G - circle[0]) > 5e-3
    speed = norm(track.velocity)[away]
    assert speed.max() <= 0.02
    assert speed.min() >= 0.98 * 0.02
    assert speed.mean() >= 0.97 * 0.02


def test_single_move_takes_the_fastest_jerk_limited_time(run, limits):
    """A straight move between rests: compared with ruckig's own answer for the same limits."""
    from ruckig import InputParameter, Ruckig, Trajectory

    request, answer = InputParameter(1), Trajectory(1)
    request.current_position, request.target_position = [0.0], [0.1]
    request.max_velocity, request.max_acceleration, request.max_jerk = [0.1], [0.5], [5.0]
    Ruckig(1).calculate(request, answer)
    track = run([moves([[0, 0, 0], [0.1, 0, 0]], 0.1)])
    assert abs(track.tick[-1] * PERIOD - answer.duration) < PERIOD


def test_arc_is_round_and_ends_where_programmed(run, limits):
    arc = Arc(7, np.array([0.05, 0, 0]), np.array([0.05, 0, 0.01]), np.zeros(2), 2 * math.pi, 0.03, 1e-6, 0.0)
    track = run([arc], start=arc.start_G)
    radius = np.hypot(track.position_G[:, 0], track.position_G[:, 1])
    assert np.abs(radius - 0.05).max() <= limits.half_width / 3
    assert_rests(track, arc.start_G, arc.end_G)
    assert_within(track, limits)
    assert set(track.line) == {7}


def test_arc_with_rounded_end_goes_over_from_one_radius_to_the_other(run):
    arc = Arc(1, np.array([0.05, 0, 0]), np.array([0, 0.05003, 0]), np.zeros(2), math.pi / 2, 0.03, 0.0, 0.0)
    track = run([arc], start=arc.start_G)
    assert np.allclose(track.position_G[-1], arc.end_G, atol=1e-12)


def test_result_does_not_depend_on_how_moves_are_batched(run, monkeypatch):
    batch = 512
    for module in (leg, planner):
        monkeypatch.setattr(module, "BATCH", batch)
    points = random_walk(5, 3 * batch, 3e-4)
    whole = run([moves(points, 0.03)], start=points[0])
    cuts = [0, 1, 70, batch + 3, 2 * batch + 1, len(points) - 1]
    parts = [
        moves(points[a : b + 1], 0.03, line=np.arange(a + 1, b + 1)) for a, b in itertools.pairwise(cuts)
    ]
    split = run(parts, start=points[0])
    assert abs(len(split.tick) - len(whole.tick)) * PERIOD < 0.02 * whole.tick[-1] * PERIOD
    assert np.allclose(split.position_G[-1], points[-1], atol=1e-11)
    assert distance_to(split.position_G[::50], points).max() < 0.25e-3


def test_clay_is_laid_in_proportion_to_the_path(run):
    track = run([moves([[0, 0, 0], [0.05, 0, 0], [0.1, 0, 0]], 0.02, clay=[5e-7, 0.0])])
    assert track.flow.sum() * PERIOD == pytest.approx(5e-7, rel=1e-3)
    assert track.flow[track.line == 2].max() == 0.0
    cruising = np.abs(track.position_G[:, 0] - 0.025) < 0.02
    assert track.flow[cruising] == pytest.approx(0.02 * 5e-7 / 0.05, rel=1e-9)


def test_dwell_prime_and_pause_stand_still_in_order(run):
    commands = [
        moves([[0, 0, 0], [0.01, 0, 0]], 0.02, line=[1]),
        Dwell(2, 0.5),
        Prime(3, 2e-8, 1e-7),
        Pause(4, "change clay"),
        Stop(5),
        Notice(6, "display", "hello"),
        moves([[0.01, 0, 0], [0, 0, 0]], 0.02, line=[7]),
    ]
    track = run(commands)
    dwell, prime = track.line == 2, track.line == 3
    assert dwell.sum() == pytest.approx(0.5 / PERIOD, abs=1)
    assert prime.sum() == pytest.approx(0.2 / PERIOD, abs=1)
    assert track.flow[prime] == pytest.approx(1e-7)
    assert not track.flow[~prime].any()
    assert np.allclose(track.position_G[dwell | prime], [0.01, 0, 0], atol=1e-12)
    assert not track.velocity[dwell | prime].any()
    assert (np.diff(track.line) >= 0).all()


def test_corner_sharper_than_the_stop_angle_is_reached_exactly(run):
    points = np.array([[0, 0, 0], [0.05, 0, 0], [0, 1e-3, 0]])
    track = run([moves(points, 0.05)])
    assert distance_to(points[1:2], track.position_G).max() < 1e-6
    joined_batches = run([moves(points[:2], 0.05), moves(points[1:], 0.05, line=[2])])
    assert np.array_equal(joined_batches.position_G, track.position_G)


def test_a_reversal_comes_to_its_tolerance_where_no_corner_stops(limits):
    points = np.array([[0, 0, 0], [0.06, 0, 0], [0.01, 0, 0]])
    times = []
    for angle in (math.pi / 2, math.pi):
        planner = Planner(replace(limits, stop_angle=angle), points[0])
        legs = [*planner.stretches(moves(points, 0.05)), *planner.close()]
        assert len({leg.number for leg in legs}) == (2 if angle < math.pi else 1)
        times.append(sum(leg.duration for leg in legs))
    assert times[1] < times[0] - 0.05
    reached = max(leg.path.at(np.linspace(0.0, leg.path.end, 4000))[1][:, 0].max() for leg in legs)
    assert abs(reached - 0.06) <= limits.deviation + 1e-6


def test_ticks_go_on_from_program_to_program(limits):
    planner, timeline = Planner(limits, np.zeros(3)), Timeline(PERIOD)
    first = joined(list(all_tracks(planner, timeline, [moves([[0, 0, 0], [0.01, 0, 0]])])))
    second = joined(list(all_tracks(planner, timeline, [moves([[0.01, 0, 0], [0, 0, 0]])])))
    assert second.tick[0] == first.tick[-1] + 1
    assert np.allclose(second.position_G[-1], 0, atol=1e-12)


def test_empty_program_is_one_tick_at_rest(run):
    track = run([])
    assert track.tick.tolist() == [0]
    assert not track.position_G.any()


def test_only_commands_are_planned(limits):
    with pytest.raises(TypeError, match="no motion"):
        list(Planner(limits, np.zeros(3)).stretches("G1 X1"))


def test_memory_of_a_long_leg_stays_bounded(limits):
    planner = Planner(limits, np.zeros(3))
    points = np.column_stack((np.arange(BATCH + 1) * 1e-4, np.zeros((BATCH + 1, 2))))
    held = []
    for k in range(6):
        list(planner.stretches(moves(points + np.array([k * points[-1, 0], 0, 0]), 0.02)))
        held.append(len(planner._leg._segments))
    assert max(held[2:]) <= 2 * BATCH


def test_moves_values_are_read_only():
    command = moves(SQUARE)
    assert isinstance(command, Moves)
    with pytest.raises(ValueError, match="read-only"):
        command.end_G[0, 0] = 1.0


def test_position_does_not_jump_where_a_leg_is_planned_in_parts(run, limits):
    """A long row of nearly straight moves, whose turns are mostly too small to be corners."""
    rng = np.random.default_rng(7)
    steps = np.column_stack((np.full(3 * BATCH, 2e-3), rng.normal(size=(3 * BATCH, 2)) * 1e-12))
    steps[::50, 1] += 1e-4
    points = np.cumsum(np.vstack((np.zeros(3), steps)), axis=0)
    track = run([moves(points, 0.1)], period=1e-3)
    _, acceleration, jerk = differences(track, 1e-3)
    assert acceleration <= limits.acceleration * 1.001
    assert jerk <= limits.jerk * 1.001
    assert np.allclose(track.position_G[-1], points[-1], atol=1e-11)


@pytest.mark.parametrize("seed", range(8))
def test_no_bend_is_crept_through_where_it_ends_at_rest(seed, run):
    """Corners about as far from a stop as the kernel is wide leave room to brake."""
    rng = np.random.default_rng(seed)
    for _ in range(25):
        start = np.round(rng.uniform(-60, 60, 3), 3)
        long, short = np.round(rng.uniform(-9, 9, (2, 3)), 3)
        points = np.cumsum([start, long, 0.07 * short], axis=0) * 1e-3
        track = run([moves(points, speed=0.1)], start=points[0])
        assert len(track.tick) * PERIOD < 1.6
