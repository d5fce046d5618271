"""Against MuJoCo: spatial tendons wrapping a cylinder on a body that swivels about the vertical.

Each tendon runs from a site that swivels with the pulley, outwards of D and level with it, over
the pulley to a site on the platform: MuJoCo finds the tangent points and the arc by itself.
"""

import math

import mujoco
import numpy as np
import pytest
from mechanism_oracle import COLUMNS, machine, vector_ba, workspace

from cdhr_host.mechanism import jacobian, lengths
from cdhr_host.units import MM

RADIUS, CIRCLE, LEAD = 0.011, 0.89862, 0.3
POSES = 200


def model(column: str) -> mujoco.MjModel:
    """Six swivelling pulleys and two platforms on slides, in m, zero at the reference pose."""
    height = {"sim": 0.868, "exp": 0.4385}[column]
    pulleys = "".join(pulley(i, *pulley_place(i)) for i in range(6))
    platforms = platform("lower", height, 0.06062) + platform("upper", height + 0.055, 0.0)
    tendons = "".join(
        f'<spatial name="cable{i}"><site site="lead{i}"/><geom geom="wheel{i}" sidesite="side{i}"/>'
        f'<site site="end{i}"/></spatial>'
        for i in range(6)
    )
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{pulleys}{platforms}</worldbody><tendon>{tendons}</tendon></mujoco>"
    )


def pulley_place(i: int) -> tuple[float, float, float]:
    beta = 2 * math.pi * (i % 3) / 3
    return CIRCLE * math.cos(beta), CIRCLE * math.sin(beta), 0.0 if i < 3 else 1.796


def pulley(i: int, x: float, y: float, z: float) -> str:
    """Local x points from the platform outwards; the cable touches at the bottom (lower) or top (upper)."""
    k = -1 if i < 3 else 1
    return (
        f'<body pos="{x!r} {y!r} {z!r}"><joint name="swivel{i}" type="hinge" axis="0 0 1"/>'
        f'<geom name="wheel{i}" type="cylinder" size="{RADIUS} 0.005" euler="90 0 0" mass="0.1"/>'
        f'<site name="lead{i}" pos="{LEAD} 0 {k * RADIUS}"/>'
        f'<site name="side{i}" pos="{-2 * RADIUS} 0 {2 * k * RADIUS}"/></body>'
    )


def platform(name: str, height: float, radius: float) -> str:
    first = 0 if name == "lower" else 3
    slides = "".join(
        f'<joint name="{name}_{axis}" type="slide" axis="{direction}"/>'
        for axis, direction in zip("xyz", ("1 0 0", "0 1 0", "0 0 1"), strict=True)
    )
    ends = "".join(
        f'<site name="end{first + i}" pos="{radius * math.cos(turn)!r} {radius * math.sin(turn)!r} 0"/>'
        for i, turn in enumerate(2 * math.pi * np.arange(3) / 3)
    )
    return f'<body pos="0 0 {height!r}">{slides}<geom size="0.001" mass="1"/>{ends}</body>'


def measure(column: str, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tendon lengths (N, 6) without the lead, and slopes (N, 6, 3) with respect to the own platform."""
    made = model(column)
    data = mujoco.MjData(made)
    found, slopes = np.empty((len(lower), 6)), np.empty((len(lower), 6, 3))
    address = {made.joint(j).name: made.jnt_qposadr[j] for j in range(made.njnt)}
    for n, both in enumerate(zip(lower, upper, strict=True)):
        for name, q in zip(("lower", "upper"), both, strict=True):
            data.qpos[[address[f"{name}_{axis}"] for axis in "xyz"]] = q
        for i in range(6):
            x, y, _ = vector_ba(column, i, (both[i // 3] / MM).tolist())
            data.qpos[address[f"swivel{i}"]] = math.atan2(y, x)
        mujoco.mj_fwdPosition(made, data)
        found[n] = data.ten_length - LEAD
        slopes[n] = own_slopes(made, data, address)
    return found, slopes


def own_slopes(made: mujoco.MjModel, data: mujoco.MjData, address: dict[str, int]) -> np.ndarray:
    """(6, 3): tendon speed for unit speeds of the platform that holds it, swivels at rest."""
    found = np.empty((6, 3))
    for k, axis in enumerate("xyz"):
        data.qvel[:] = 0.0
        data.qvel[[address[f"lower_{axis}"], address[f"upper_{axis}"]]] = 1.0
        mujoco.mj_fwdVelocity(made, data)
        found[:, k] = data.ten_velocity
    return found


@pytest.mark.parametrize("column", COLUMNS)
def test_lengths_and_slopes_agree_with_mujoco(column: str) -> None:
    rng, cables = np.random.default_rng(21), machine(COLUMNS[column]).cables
    lower, upper = (workspace(rng, POSES, 0.4, -0.38, 0.7) for _ in range(2))
    found, slopes = measure(column, lower, upper)
    assert np.abs(found - lengths(cables, lower, upper)).max() < 1e-11 * MM
    assert np.abs(slopes - jacobian(cables, lower, upper)).max() < 1e-14
