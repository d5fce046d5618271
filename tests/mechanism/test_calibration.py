"""The geometry from measured points: exact slopes, truth within its doubts, what cannot be told."""

import numpy as np
import pytest
from mechanism_oracle import machine, workspace
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from cdhr_host.mechanism import Cables, lengths, slider
from cdhr_host.mechanism.calibration import Points, before, calibrate
from cdhr_host.mechanism.calibration_model import (
    NAMES,
    OFFSETS,
    RADIUS,
    SIZE,
    TURN,
    Doubts,
    Frame,
    nozzle,
    predicted,
    slopes,
)
from cdhr_host.mechanism.observability import best_poses, in_turn, information_of, learned, unobservable
from cdhr_host.mechanism.pulley import PULLEYS
from cdhr_host.units import MM

PAPER = machine("paper").cables
NOISE = 0.05 * MM


def visited(seed: int, count: int, cables: Cables = PAPER) -> np.ndarray:
    """(N, 3) m of sliders 1-3 over the printable volume."""
    q = workspace(np.random.default_rng(seed), count, 0.18, 0.0, 0.25)
    return slider(cables, lengths(cables, q, q))[:, :3]


def truth(seed: int, doubts: Doubts) -> np.ndarray:
    return doubts.each() * np.random.default_rng(seed).standard_normal(SIZE)


def measured(seed: int, parameters: np.ndarray, run: np.ndarray, frame: Frame | None = None) -> Points:
    noise = NOISE * np.random.default_rng(seed).standard_normal((len(run), 3))
    return Points(run, predicted(PAPER, frame or Frame.same(), parameters, run) + noise)


@pytest.mark.parametrize("model", PULLEYS)
def test_slopes_are_differences(model: str) -> None:
    cables = PAPER.with_pulley(PULLEYS[model])
    turn = Rotation.from_rotvec([0.3, 0.1, -0.2]).as_matrix()
    frame, run, step = Frame(np.array([0.1, 0.2, 0.3]), turn), visited(1, 20), 1e-6
    at = truth(2, Doubts().free_frame())
    place, by = slopes(cables, frame, at, run)
    assert_allclose(place, predicted(cables, frame, at, run), rtol=0, atol=0)
    for k, way in enumerate(step * np.eye(SIZE)):
        rise = predicted(cables, frame, at + way, run) - predicted(cables, frame, at - way, run)
        assert_allclose(by[:, :, k], rise / (2 * step), rtol=0, atol=2e-9, err_msg=NAMES[k])


def test_the_drawing_predicts_itself() -> None:
    q = workspace(np.random.default_rng(3), 50, 0.18, 0.0, 0.25)
    run = slider(PAPER, lengths(PAPER, q, q))[:, :3]
    assert_allclose(nozzle(PAPER, np.zeros(SIZE), run), q, rtol=0, atol=1e-11)


@pytest.mark.parametrize("known", [True, False])
def test_truth_is_within_its_doubts_over_many_machines(known: bool) -> None:
    """25 machines: 3 sigma for 99 of 100 parameters, sigma itself right; held-out points 20 times nearer."""
    doubts, off, gain = Doubts(), [], []
    for seed in range(25):
        at, run = truth(seed, doubts), visited(100 + seed, 30)
        found = calibrate(PAPER, measured(seed, at, run), doubts, noise=NOISE if known else None)
        free = doubts.each() > 0.0
        off.append((found.parameters - at)[free] / found.deviation[free])
        aside = visited(500 + seed, 60)
        true = predicted(PAPER, Frame.same(), at, aside)
        without = np.linalg.norm(true - predicted(PAPER, Frame.same(), 0 * at, aside), axis=1)
        left = np.linalg.norm(true - found.predicted(aside), axis=1)
        gain.append(np.sqrt((left**2).mean() / (without**2).mean()))
        assert left.max() < 4.0 * found.nozzle_doubt(aside).max()
    assert np.std(off) == pytest.approx(1.0, abs=0.12)
    assert np.mean(np.abs(off) < 3.0) > 0.985
    assert max(gain) < 0.1
    assert np.mean(gain) < 0.03


def test_noise_is_measured_from_the_residuals() -> None:
    at, run = truth(4, Doubts()), visited(5, 80)
    found = calibrate(PAPER, measured(6, at, run), Doubts())
    assert found.noise == pytest.approx(NOISE, rel=0.2)


def test_wild_points_are_named_and_do_little() -> None:
    at, run = truth(7, Doubts()), visited(8, 40)
    points = measured(9, at, run)
    points.place[[3, 17]] += [[5e-3, 0.0, 0.0], [0.0, -8e-3, 4e-3]]
    found = calibrate(PAPER, points, Doubts())
    assert np.flatnonzero(found.outliers).tolist() == [3, 17]
    aside = visited(10, 50)
    true = predicted(PAPER, Frame.same(), at, aside)
    assert np.linalg.norm(found.predicted(aside) - true, axis=1).max() < 0.15 * MM


def test_a_dial_gauge_measures_one_coordinate() -> None:
    """Heights alone: they improve, and what they leave in the plane stays in doubt."""
    at, run = truth(11, Doubts()), visited(12, 60)
    points = measured(13, at, run)
    points.place[:, :2] = np.nan
    found = calibrate(PAPER, points, Doubts(), noise=NOISE)
    aside = visited(14, 60)
    true = predicted(PAPER, Frame.same(), at, aside)
    drawn = predicted(PAPER, Frame.same(), 0 * at, aside)
    first, last = (np.abs(true - place) for place in (drawn, found.predicted(aside)))
    assert last[:, 2].max() < 0.1 * first[:, 2].max()
    assert found.nozzle_doubt(aside).min() > 5 * NOISE


def test_a_camera_s_own_frame() -> None:
    """Turned by half a radian and a metre away: aligned first, then identified with the geometry."""
    doubts = Doubts().free_frame()
    at = truth(15, Doubts())
    camera = Frame(np.array([1.0, -0.4, 0.7]), Rotation.from_rotvec([0.1, -0.2, 0.5]).as_matrix())
    points = measured(17, at, visited(16, 40), camera)
    drawn = predicted(PAPER, Frame.same(), 0 * at, points.slider)
    found = calibrate(PAPER, points, doubts, Frame.aligned(drawn, points.place), noise=NOISE)
    aside = visited(18, 50)
    true = predicted(PAPER, camera, at, aside)
    assert np.linalg.norm(found.predicted(aside) - true, axis=1).max() < 0.2 * MM
    assert np.linalg.norm(found.parameters[TURN]) > 0.0
    residual = before(PAPER, found.frame, points)
    assert np.sqrt((residual**2).mean()) > 3 * found.noise


def test_a_machine_as_drawn_is_left_as_drawn() -> None:
    run = visited(19, 30)
    found = calibrate(PAPER, Points(run, nozzle(PAPER, np.zeros(SIZE), run)), Doubts(), noise=NOISE)
    assert np.abs(found.parameters).max() < 1e-9
    assert not found.outliers.any()


def test_pulley_and_attachment_are_told_apart_by_nothing() -> None:
    """Nine exact null directions; the radius of the pulleys is almost one more."""
    told = information_of(PAPER, Frame.same(), Doubts(), visited(20, 200), NOISE).sum(axis=0)
    found = unobservable(told, Doubts())
    exact = {frozenset(name for name, _ in each.parts) for each in found if each.strength < 1e-9}
    pairs = {frozenset((f"pulley {i} {axis}", f"attachment {i} {axis}")) for i in (1, 2, 3) for axis in "xyz"}
    assert len(exact & pairs) >= 5
    assert sum(each.strength < 0.5 for each in found) >= 10
    assert any(each.words().startswith("pulley radius") for each in found)
    part = learned(told, Doubts())
    assert part[OFFSETS].min() > 0.98
    assert part[RADIUS] < 0.3


def test_null_directions_do_not_move_the_nozzle() -> None:
    run, doubts = visited(21, 50), Doubts()
    told = information_of(PAPER, Frame.same(), doubts, run, NOISE).sum(axis=0)
    for each in unobservable(told, doubts):
        if each.strength < 1e-9:
            way = np.zeros(SIZE)
            for name, ratio in each.parts:
                way[NAMES.index(name)] = 1e-3 * ratio
            assert np.abs(nozzle(PAPER, way, run) - nozzle(PAPER, 0 * way, run)).max() < 1e-9


def test_planned_poses_tell_more_than_as_many_by_chance() -> None:
    doubts, candidates = Doubts(), visited(22, 400)
    picked = best_poses(PAPER, doubts, candidates, 12, NOISE)
    assert len(set(picked.tolist())) == 12

    def doubt(rows: np.ndarray) -> float:
        told = information_of(PAPER, Frame.same(), doubts, rows, NOISE).sum(axis=0)
        return float(-np.linalg.slogdet(told + np.eye(SIZE))[1])

    by_chance = [doubt(candidates[12 * k : 12 * k + 12]) for k in range(30)]
    assert doubt(candidates[picked]) < min(by_chance)


def test_poses_to_add_are_where_the_others_are_not() -> None:
    """After points on one side only, the next ones are on the other."""
    doubts, candidates = Doubts(), visited(23, 400)
    q = nozzle(PAPER, np.zeros(SIZE), candidates)
    known = information_of(PAPER, Frame.same(), doubts, candidates[q[:, 0] > 0.05], NOISE).sum(axis=0)
    picked = best_poses(PAPER, doubts, candidates, 4, NOISE, known=known)
    assert q[picked, 0].mean() < -0.05


def test_the_way_round_is_shorter_than_as_picked() -> None:
    places = np.random.default_rng(24).uniform(-0.2, 0.2, (40, 3))
    order = in_turn(places, np.zeros(3))
    assert sorted(order.tolist()) == list(range(40))
    length = [np.linalg.norm(np.diff(rows, axis=0), axis=1).sum() for rows in (places, places[order])]
    assert length[1] < 0.5 * length[0]
