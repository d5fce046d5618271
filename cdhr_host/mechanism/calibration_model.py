"""From slider positions to measured nozzle points, with everything about the geometry in doubt.

A nozzle point p, measured at slider positions s, is p = t + R(phi) (q + q_ref) where q solves, for
each of the cables 1-3,

    l(A_i - B_i - q; r) - l(A_i - B_i; r) + o_i = s_i

with pulley centres A, attachments B at the reference pose, reference offsets o (what slider i
stands at when the platform is at the drawn reference pose) and the groove radius r. The
upper platform's cables are no part of it: on a machine that holds positions the nozzle does not
feel them. Differentiating the equation gives dq exactly: with g the gradient of l along A - B - q,

    G dq = (g_i(q) - g_i(0))·(dA_i - dB_i) + do_i + (l_r(q) - l_r(0)) dr,   G = [g_i^T].
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from cdhr_host.mechanism.cables import LOWER, Cables
from cdhr_host.mechanism.forward import forward
from cdhr_host.mechanism.kinematics import components, wraps_of
from cdhr_host.mechanism.pulley import Vector
from cdhr_host.units import DEG, MM
from cdhr_host.values import Array

XYZ: Final = ("x", "y", "z")
NAMES: Final = (
    *(f"pulley {i + 1} {axis}" for i in LOWER for axis in XYZ),
    *(f"attachment {i + 1} {axis}" for i in LOWER for axis in XYZ),
    *(f"offset {i + 1}" for i in LOWER),
    "pulley radius",
    *(f"frame shift {axis}" for axis in XYZ),
    *(f"frame turn {axis}" for axis in XYZ),
)
"""the parameters, in order: m, and rad for the turns"""
PULLEYS, ATTACHMENTS, OFFSETS, RADIUS, SHIFT, TURN = (
    slice(0, 9),
    slice(9, 18),
    slice(18, 21),
    21,
    slice(22, 25),
    slice(25, 28),
)
SIZE: Final = len(NAMES)


@dataclass(frozen=True, slots=True)
class Doubts:
    """How far the drawing may be off before anything is measured: standard deviations, m and rad.

    0 takes a parameter for known.
    """

    pulley: float = 3.0 * MM
    attachment: float = 0.5 * MM
    offset: float = 3.0 * MM
    radius: float = 0.3 * MM
    shift: float = 0.0
    """of the measuring frame, which is the program's coordinates when both are 0"""
    turn: float = 0.0

    def each(self) -> Array:
        """(SIZE,) for every parameter."""
        counts = (9, 9, 3, 1, 3, 3)
        sizes = [getattr(self, part.name) for part in fields(self)]
        return np.repeat(np.array(sizes, dtype=np.float64), counts)

    def free_frame(self) -> "Doubts":
        """The same with a measuring frame that is only roughly known."""
        return replace(self, shift=20.0 * MM, turn=2.0 * DEG)


@dataclass(frozen=True, slots=True)
class Frame:
    """A measuring frame, roughly: p = shift + turn·position_G."""

    shift: Array
    """(3,) m"""
    turn: Array
    """(3, 3)"""

    @classmethod
    def same(cls) -> "Frame":
        """Program coordinates."""
        return cls(np.zeros(3), np.eye(3))

    @classmethod
    def aligned(cls, position_G: Array, measured: Array) -> "Frame":
        """(N, 3), (N, 3) -> the frame that brings them together best: Kabsch's method."""
        middle, seen = position_G.mean(axis=0), measured.mean(axis=0)
        turn = Rotation.align_vectors(measured - seen, position_G - middle)[0].as_matrix()
        return cls(seen - turn @ middle, turn)


def moved(cables: Cables, parameters: Array) -> Cables:
    """The machine with parameters (SIZE,) away from its drawing; attachments move on their platform."""
    anchors, attachments = np.array(cables.anchors), np.array(cables.attachments)
    anchors[:3] += parameters[PULLEYS].reshape(3, 3)
    attachments[:3] += parameters[ATTACHMENTS].reshape(3, 3)
    radius = cables.pulley_radius + float(parameters[RADIUS])
    changed = replace(cables, anchors=anchors, attachments=attachments, pulley_radius=radius)
    changed = changed.with_pulley(cables.pulley)
    lengths = np.array(changed.reference_lengths)
    lengths[:3] -= parameters[OFFSETS]
    return replace(changed, reference_lengths=lengths)


def nozzle(cables: Cables, parameters: Array, slider: Array) -> Array:
    """(N, 3) m of sliders 1-3 -> (N, 3) m: displacement of the nozzle; raises MotionError without one."""
    machine = moved(cables, parameters)
    length = np.tile(machine.reference_lengths, (len(slider), 1))
    length[:, :3] += slider
    return forward(machine, length)[0]


def predicted(cables: Cables, frame: Frame, parameters: Array, slider: Array) -> Array:
    """(N, 3) m of sliders 1-3 -> (N, 3) m: where the nozzle is measured."""
    q = nozzle(cables, parameters, slider)
    return _placed(cables, frame, parameters, q)


def slopes(cables: Cables, frame: Frame, parameters: Array, slider: Array) -> tuple[Array, Array]:
    """(N, 3) m -> (N, 3) ``predicted`` and (N, 3, SIZE) its exact derivatives."""
    q = nozzle(cables, parameters, slider)
    turn = Rotation.from_rotvec(parameters[TURN]).as_matrix() @ frame.turn
    found = np.zeros((len(q), 3, SIZE))
    found[:, :, : SHIFT.start] = np.einsum("ij,njk->nik", turn, _nozzle_slopes(cables, parameters, q))
    found[:, :, SHIFT] = np.eye(3)
    place = _placed(cables, frame, parameters, q)
    out = place - frame.shift - parameters[SHIFT]
    found[:, :, TURN] = -_crossing(out) @ _turning(parameters[TURN])
    return place, found


def _placed(cables: Cables, frame: Frame, parameters: Array, q: Array) -> Array:
    turn = Rotation.from_rotvec(parameters[TURN]).as_matrix() @ frame.turn
    return np.asarray((q + cables.reference_G) @ turn.T + frame.shift + parameters[SHIFT])


def _nozzle_slopes(cables: Cables, parameters: Array, q: Array) -> Array:
    """(N, 3, 22): of ``nozzle`` by pulleys, attachments, offsets, radius."""
    machine = moved(cables, parameters)
    here, gradient, wider = _looked(machine, q)
    _, start, wide = _looked(machine, np.zeros((1, 3)))
    right = np.zeros((len(q), 3, SHIFT.start))
    for i in LOWER:
        right[:, i, 3 * i : 3 * i + 3] = gradient[:, i] - start[:, i]
        right[:, i, 9 + 3 * i : 12 + 3 * i] = start[:, i] - gradient[:, i]
        right[:, i, 18 + i] = 1.0
        right[:, i, RADIUS] = wider[:, i] - wide[:, i]
    return np.asarray(np.linalg.solve(here, right))


def _looked(machine: Cables, q: Array) -> tuple[Array, Array, Array]:
    """Of cables 1-3 at (N, 3) m: G, the gradients in its rows, and dl/dr."""
    wraps = wraps_of(machine, LOWER, components(q, slice(0, len(q))))
    gradient = np.stack([_stacked(wrap.direction()) for wrap in wraps], axis=1)
    return gradient, gradient, np.stack([wrap.per_radius() for wrap in wraps], axis=1)


def _stacked(vector: Vector) -> Array:
    return np.stack(vector, axis=1)


def _crossing(vectors: Array) -> Array:
    """(N, 3) v -> (N, 3, 3) of v x."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    rows: Sequence[Array] = (zero, -z, y, z, zero, -x, -y, x, zero)
    return np.stack(rows, axis=1).reshape(-1, 3, 3)


def _turning(turn: Array) -> Array:
    """(3, 3): the left Jacobian of a rotation vector, d(turn as seen in space) by its components."""
    angle = float(np.linalg.norm(turn))
    cross = _crossing(turn[None])[0]
    if angle < 1e-6:
        return np.asarray(np.eye(3) + 0.5 * cross)
    first = (1.0 - np.cos(angle)) / angle**2
    second = (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)
