"""The lower bound, against closed forms and against an independent solver."""

import numpy as np
import pytest
from bound import bound, fastest, grid
from paths import SMALL, Run, machine, planned_runs, read


@pytest.fixture(scope="module")
def setting():
    return machine()


def runs_of(setting, name):
    profile, limits = setting
    return planned_runs(read(profile, SMALL[name]()), limits)


def test_straight_run_takes_the_time_of_a_trapezoid(setting):
    (run,) = runs_of(setting, "straight 60 mm, F50")
    a = setting[1].acceleration
    assert bound(run, setting[1]) == pytest.approx(0.06 / 0.05 + 0.05 / a)


def test_circle_runs_at_the_speed_of_its_curvature(setting):
    (run,) = runs_of(setting, "circle R10, chords 0.3 mm, F90")
    nodes = grid(run)
    x = fastest(nodes, setting[1].acceleration)
    middle = np.median(x[len(x) // 4 : 3 * len(x) // 4])
    assert middle == pytest.approx(setting[1].acceleration * 0.01, rel=0.05)


@pytest.mark.parametrize("name", list(SMALL))
def test_no_plan_is_faster(setting, name):
    for run in runs_of(setting, name):
        assert bound(run, setting[1]) <= run.planned * (1 + 1e-9)


@pytest.mark.parametrize("name", ["square 20 mm, F60", "Hilbert 3 mm, F40"])
def test_finer_steps_change_it_by_less_than_a_percent(setting, name):
    (run,) = runs_of(setting, name)
    coarse, fine = bound(run, setting[1]), bound(run, setting[1], steps=64)
    assert coarse <= fine <= 1.012 * coarse


def by_toppra(run: Run, acceleration: float) -> float:
    """The same problem solved by toppra, with the ball of accelerations cut to a polygon outside it."""
    toppra = pytest.importorskip("toppra")
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointVelocityConstraint, SecondOrderConstraint

    class Path(toppra.interpolator.AbstractGeometricPath):
        dof, path_interval = 2, np.array([run.s[0], run.s[-1]])

        def __call__(self, s, order=0):
            found = run.at(np.atleast_1d(s))[order][:, :2]
            return found if np.ndim(s) else found[0]

    angle = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    ball = SecondOrderConstraint(
        lambda q, v, a: a,
        lambda q: normal,
        lambda q: np.full(96, acceleration),
        dof=2,
        discretization_scheme=0,
    )
    speed = JointVelocityConstraint(np.full((2, 2), run.feed[0]) * [-1, 1])
    solver = TOPPRA(
        [ball, speed], Path(), gridpoints=np.linspace(run.s[0], run.s[-1], 4001), solver_wrapper="seidel"
    )
    return float(solver.compute_trajectory(0, 0).duration)


def test_toppra_finds_the_same(setting):
    (run,) = runs_of(setting, "square 20 mm, F60")  # along the axes toppra's box of speeds is the ball
    assert bound(run, setting[1]) == pytest.approx(by_toppra(run, setting[1].acceleration), rel=0.01)
