"""Cable lengths to pose: Newton's method on three cables at a time, and what it shows."""

from collections.abc import Sequence

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism.cables import LOWER, UPPER, Cables
from cdhr_host.mechanism.kinematics import block_rows, lengths, slider, wraps_of
from cdhr_host.mechanism.pulley import PULLEYS, PointWrap, Pulley, Vector
from cdhr_host.mechanism.statics import cofactors
from cdhr_host.units import MM
from cdhr_host.values import Array

MAX_STEPS = 60
STEP_LIMIT = 0.2
"""longest Newton step, of the shortest cable at the reference"""
SETTLED = 1e-8
"""a step this short, of the same cable, leaves an error of the order of its square"""
RESIDUAL = 64 * float(np.finfo(np.float64).eps)
"""largest residual of a solution, of the cable's length"""


def forward(cables: Cables, length: Array) -> tuple[Array, Array]:
    """(N, 6) -> (N, 3), (N, 3): displacements of the lower and the upper platform, m.

    Raises MotionError naming the cables, the sample and the residual where no pose between
    the pulleys has these lengths (the mirror solution beyond the pulley plane is refused).
    """
    found = np.empty((2, len(length), 3))
    for rows in block_rows(len(length)):
        block = np.ascontiguousarray(length[rows].T, dtype=np.float64)
        for platform, which in enumerate((LOWER, UPPER)):
            wanted = block[which[0] : which[-1] + 1]
            with np.errstate(all="ignore"):
                q = _newton(cables, which, wanted)
                _require_solution(cables, which, wanted, q, rows.start)
            found[platform, rows] = np.transpose(q)
    return found[0], found[1]


def uncompensated_error(cables: Cables, lower: Array, upper: Array) -> tuple[Array, Array]:
    """(N, 3), (N, 3) -> (N, 3), (N, 3): where the platforms go minus where they were meant to go, m.

    The machine with pulleys is commanded |BA| counted from the reference. Raises like
    ``lengths`` and ``forward``.
    """
    return mistaken_error(cables, PointWrap, lower, upper)


def mistaken_error(cables: Cables, believed: Pulley, lower: Array, upper: Array) -> tuple[Array, Array]:
    """(N, 3), (N, 3) -> (N, 3), (N, 3): errors of both platforms, m, where ``cables`` is the machine.

    Setpoints are computed with the pulley model ``believed``. Raises like ``lengths`` and ``forward``.
    """
    planned = cables.with_pulley(believed)
    commanded = cables.reference_lengths + slider(planned, lengths(planned, lower, upper))
    reached = forward(cables, commanded)
    return reached[0] - lower, reached[1] - upper


def model_errors(cables: Cables, lower: Array, upper: Array) -> dict[tuple[str, str], Array]:
    """(N, 3), (N, 3) -> {(believed, actual): (3,)}: greatest nozzle error along x, y, z, m.

    Setpoints by one pulley model on a machine that behaves like another, for every pair in
    ``PULLEYS``. Raises like ``lengths`` and ``forward``.
    """
    return {
        (believed, actual): np.abs(mistaken_error(cables.with_pulley(real), model, lower, upper)[0]).max(
            axis=0
        )
        for believed, model in PULLEYS.items()
        for actual, real in PULLEYS.items()
    }


def _newton(cables: Cables, which: Sequence[int], wanted: Array) -> Vector:
    """(3, N) lengths -> displacement of one platform; samples without a solution end anywhere."""
    scale = float(cables.reference_lengths.min())
    q: Vector = (np.zeros(wanted.shape[1]), np.zeros(wanted.shape[1]), np.zeros(wanted.shape[1]))
    for _ in range(MAX_STEPS):
        step = _step(cables, which, wanted, q)
        size = np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
        part = np.minimum(1.0, STEP_LIMIT * scale / size)
        q = (q[0] + part * step[0], q[1] + part * step[1], q[2] + part * step[2])
        if not (size > SETTLED * scale).any():
            break
    return q


def _step(cables: Cables, which: Sequence[int], wanted: Array, q: Vector) -> Vector:
    """The full Newton step: e·step = l(q) - wanted for three cables."""
    wraps = wraps_of(cables, which, q)
    first, second, third, det = cofactors(*(wrap.direction() for wrap in wraps))
    r1, r2, r3 = ((wrap.length() - goal) / det for wrap, goal in zip(wraps, wanted, strict=True))
    x, y, z = (r1 * a + r2 * b + r3 * c for a, b, c in zip(first, second, third, strict=True))
    return x, y, z


def _require_solution(cables: Cables, which: Sequence[int], wanted: Array, q: Vector, start: int) -> None:
    wraps = wraps_of(cables, which, q)
    residual = np.max(
        [np.abs(wrap.length() - goal) for wrap, goal in zip(wraps, wanted, strict=True)], axis=0
    )
    solved = residual <= RESIDUAL * np.max(wanted, axis=0)
    inside = np.min([wrap.reach() for wrap in wraps], axis=0) > 0.0
    if (solved & inside).all():
        return
    sample = int(np.argmin(solved & inside))
    raise MotionError(_no_pose(which, bool(solved[sample]), float(residual[sample]), start + sample))


def _no_pose(which: Sequence[int], solved: bool, residual: float, sample: int) -> Problem:
    names = f"cables {which[0] + 1}-{which[-1] + 1}"
    platform = "lower" if which == LOWER else "upper"
    why = (
        "they meet only beyond the plane or the axis of a pulley"
        if solved
        else f"residual {residual / MM:.6g} mm"
    )
    return Problem(
        "reach",
        f"no pose of the {platform} platform has the lengths of {names} at sample {sample}: {why}",
        value=residual / MM,
        limit=0.0,
        unit="mm",
        hint="a length is slider position plus reference length; check the lengths and the profile",
    )
