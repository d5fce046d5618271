"""The rigid bodies against an independent model, over whole states and the whole way."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from bodies_mujoco import Twin
from plant_machines import profile_of

from cdhr_host.plant.bodies import Bodies, BodiesState, Build, Forces
from cdhr_host.plant.strands import Strands

DT = 1e-4
STILL = (0.0,) * 6
NO_CABLES = (0.0,) * 9


def tilted(angle: float) -> tuple[float, float, float, float]:
    return math.cos(angle), 0.6 * math.sin(angle), 0.0, 0.8 * math.sin(angle)


def widest(a: BodiesState, b: BodiesState) -> list[float]:
    """Greatest difference of position, turn, velocity, spin, upper position, upper velocity."""
    return [float(np.abs(np.array(x) - np.array(y)).max()) for x, y in zip(a[:6], b[:6], strict=True)]


@pytest.mark.parametrize("column", ["paper", "paper-simulation"])
@pytest.mark.parametrize("mass_height", [0.0, 0.015])
def test_driven_by_forces(column: str, mass_height: float) -> None:
    profile, build = profile_of(column), Build(mass_height=mass_height)
    bodies = Bodies(profile, Strands.from_profile(profile), build)
    force = bodies.tensions(BodiesState(), bodies.wound(STILL, STILL))
    twin = Twin(profile, build, NO_CABLES, DT)
    state = BodiesState(
        (0.004, -0.003, 0.005), tilted(0.02), (0.02, 0.01, -0.03), (0.1, -0.2, 0.1), (0.002, 0.001, 0.006)
    )
    twin.place(state)
    worst = np.zeros(6)
    for n in range(5000):
        now = [pull * (1.0 + 0.02 * math.sin(9.0 * n * DT + i)) for i, pull in enumerate(force)]
        state = bodies.step(state, Forces(now), DT)
        twin.push(now)
        worst = np.maximum(worst, widest(state, twin.state()))
    assert (worst < [1e-6, 1e-5, 1e-5, 1e-4, 1e-6, 1e-5]).all(), worst


def elastic(
    build: Build, state: BodiesState, slider: Callable[[float], Sequence[float]], seconds: float
) -> tuple[np.ndarray, int]:
    """Widest differences on the way, and in how many steps a cable was slack."""
    profile = profile_of("paper")
    bodies = Bodies(profile, Strands.from_profile(profile), build)
    twin = Twin(profile, build, bodies.stiffness, DT)
    twin.place(state)
    worst, slack = np.zeros(6), 0
    for n in range(round(seconds / DT)):
        wound = bodies.wound(slider((n + 0.5) * DT), STILL)
        state, felt = bodies.stepped(state, wound, DT)
        twin.pull(wound.length)
        worst = np.maximum(worst, widest(state, twin.state()))
        slack += min(felt) == 0.0
    return worst, slack


def test_elastic_cables_with_damping() -> None:
    start = BodiesState((1e-4, 0.0, 1e-4), velocity=(0.01, 0.0, 0.0), spin=(0.05, 0.05, 0.1))
    worst, slack = elastic(Build(damping=5e-4), start, lambda t: STILL, 0.5)
    assert slack == 0
    assert (worst < [2e-6, 2e-5, 5e-4, 5e-3, 1e-6, 2e-4]).all(), worst


def test_lower_cables_that_go_slack_and_come_back() -> None:
    def paid_out(t: float) -> Sequence[float]:
        return (0.0, 0.0, 0.0, *(3 * [0.012 * math.sin(2.0 * math.pi * t) ** 2]))

    worst, slack = elastic(Build(damping=0.0), BodiesState(), paid_out, 0.5)
    assert slack > 100
    assert (worst < [2e-5, 2e-4, 5e-3, 5e-2, 1e-5, 1e-3]).all(), worst
