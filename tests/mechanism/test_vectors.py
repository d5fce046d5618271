"""Against the stored 50-digit results, whose tangency is found by root finding, not by Eq. (4)."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mechanism_oracle import COLUMNS, machine
from numpy.testing import assert_allclose

from cdhr_host.mechanism import (
    cable_state,
    forward,
    jacobian,
    lengths,
    tensions,
    trajectories,
    uncompensated_error,
    uncompensated_lengths,
    wrap_rates,
)
from cdhr_host.mechanism.cables import LOWER, UPPER
from cdhr_host.mechanism.kinematics import components, wraps_of
from cdhr_host.mechanism.pulley import SwivelWrap
from cdhr_host.mechanism.statics import spring_force
from cdhr_host.units import MM

VECTORS = json.loads((Path(__file__).parent / "vectors.json").read_text(encoding="utf-8"))
EXACT = 1e-9 * MM
TURN = 1e-11
NEWTON = 1e-9


def numbers(values: Any) -> np.ndarray:
    return np.array(values, dtype=np.float64)


def named(rows: list[dict[str, Any]], *keys: str) -> list[Any]:
    return [pytest.param(row, id="-".join(row[key] for key in keys)) for row in rows]


def platforms(values: Any) -> tuple[np.ndarray, np.ndarray]:
    both = numbers(values) * MM
    return both[None, :3], both[None, 3:]


def close(found: np.ndarray, expected: Any, tolerance: float, unit: float = 1.0) -> None:
    assert_allclose(found, numbers(expected) * unit, rtol=0.0, atol=tolerance)


def test_there_are_as_many_vectors_as_written() -> None:
    assert [len(VECTORS[kind]) for kind in ("static", "dynamic", "nc")] == [24, 18, 12]


@pytest.mark.parametrize("row", named(VECTORS["static"], "column", "name"))
def test_static(row: dict[str, Any]) -> None:
    made = machine(COLUMNS[row["column"]])
    lower, upper = platforms(row["q"])
    close(lengths(made.cables, lower, upper)[0], row["l"], EXACT, MM)
    close(uncompensated_lengths(made.cables, lower, upper)[0], row["l_point"], EXACT, MM)
    slopes = numbers(row["J_dl_dq"])
    slope = jacobian(made.cables, lower, upper)[0]
    close(slope[:3], slopes[:3, :3], TURN)
    close(slope[3:], slopes[3:, 3:], TURN)
    close(-slope, row["e"], TURN)
    close(tensions(made.cables, made.loads, lower, upper)[0], row["F_static"], NEWTON)
    rows = slice(0, 1)
    spring = spring_force(made.loads, components(lower, rows), components(upper, rows))
    close(np.ravel(spring), row["spring_force_on_3R3T"], NEWTON)


@pytest.mark.parametrize("row", named(VECTORS["static"], "column", "name"))
def test_wrap_angle(row: dict[str, Any]) -> None:
    cables = machine(COLUMNS[row["column"]]).cables
    lower, upper = (components(q, slice(0, 1)) for q in platforms(row["q"]))
    wraps = wraps_of(cables, LOWER, lower) + wraps_of(cables, UPPER, upper)
    assert all(isinstance(wrap, SwivelWrap) for wrap in wraps)
    close(np.ravel([wrap.angle() for wrap in wraps]), row["theta"], TURN)


@pytest.mark.parametrize("row", named(VECTORS["static"], "column", "name"))
def test_forward_of_the_stored_lengths(row: dict[str, Any]) -> None:
    cables = machine(COLUMNS[row["column"]]).cables
    lower, upper = forward(cables, numbers(row["l"])[None] * MM)
    close(np.concatenate([lower[0], upper[0]]), row["q"], EXACT, MM)


@pytest.mark.parametrize("row", named(VECTORS["dynamic"], "column", "traj", "t"))
def test_dynamic(row: dict[str, Any]) -> None:
    made = machine(COLUMNS[row["column"]])
    lower, upper = platforms(row["q"])
    velocity, upper_velocity = platforms(row["qd"])
    acceleration, upper_acceleration = platforms(row["qdd"])
    state = cable_state(
        made.cables,
        made.loads,
        lower,
        upper,
        velocity,
        acceleration,
        upper_velocity=upper_velocity,
        upper_acceleration=upper_acceleration,
    )
    close(state.length[0], row["l"], EXACT, MM)
    close(state.rate[0], row["l_dot"], EXACT, MM)
    close(state.acceleration[0], row["l_ddot"], EXACT, MM)
    close(state.tension[0], row["F"], NEWTON)
    alone = tensions(made.cables, made.loads, lower, upper, acceleration, upper_acceleration)
    assert_allclose(alone, state.tension, rtol=0, atol=1e-13)


@pytest.mark.parametrize("row", named(VECTORS["dynamic"], "column", "traj", "t"))
def test_trajectories(row: dict[str, Any]) -> None:
    path = {"15": trajectories.eq15, "35": trajectories.eq35, "36": trajectories.eq36}[row["traj"]]
    for order, key in enumerate(("q", "qd", "qdd")):
        close(path(numbers([row["t"]]), order)[0], row[key][:3], EXACT, MM)


@pytest.mark.parametrize("row", named(VECTORS["nc"], "column", "traj", "t"))
def test_uncompensated_error(row: dict[str, Any]) -> None:
    cables = machine(COLUMNS[row["column"]]).cables
    lower, upper = platforms(row["q_desired"])
    commanded = forward(cables, numbers(row["l_commanded"])[None] * MM)
    close(np.concatenate([commanded[0][0], commanded[1][0]]), row["q_actual"], 1e-6 * MM, MM)
    errors = uncompensated_error(cables, lower, upper)
    close(np.concatenate([errors[0][0], errors[1][0]]), row["error_actual_minus_desired"], 1e-6 * MM, MM)


@pytest.mark.parametrize("row", named(VECTORS["dynamic"], "column", "traj", "t"))
def test_wrap_rates(row: dict[str, Any]) -> None:
    cables = machine(COLUMNS[row["column"]]).cables
    lower, upper = zip(*(platforms(row[key]) for key in ("q", "qd", "qdd")), strict=True)
    found = wrap_rates(cables, lower, upper)
    close(found.rate[0], row["theta_dot"], 1e-12)
    close(found.bend[0], row["theta_ddot"], 1e-12)


def test_wrap_rates_are_derivatives_of_the_angle() -> None:
    cables, rng, h = machine("paper").cables, np.random.default_rng(21), 1e-3
    q, v, a = (rng.uniform(-size, size, (2, 50, 3)) for size in (0.2, 0.1, 0.5))

    def at(t: float) -> Any:
        moved = q + v * t + a * t**2 / 2, v + a * t, a
        return wrap_rates(cables, *(tuple(part[k] for part in moved) for k in range(2)))

    ahead, back, now = at(h), at(-h), at(0.0)
    assert_allclose(now.rate, (ahead.value - back.value) / (2 * h), rtol=0, atol=1e-5)
    assert_allclose(now.bend, (ahead.rate - back.rate) / (2 * h), rtol=0, atol=1e-4)
