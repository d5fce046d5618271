"""The best spring field of a machine: the smallest margin of all nine cables, as large as can be.

At a pose every margin is affine in the spring's force s, and s is linear in the field's
coefficients. What is minimised is the soft worst margin log sum exp(-p margin) / p, summed over a
grid of the workspace: convex, with Newton's method. p grows from round to round; poses near the
edge of what is possible count most, those beyond it hardly. After each round the cables'
directions are taken anew from where the upper platform then stands.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.kinematics import reachable
from cdhr_host.mechanism.pairs import Pairs
from cdhr_host.mechanism.pulley import Vector
from cdhr_host.mechanism.response import Response, Windows, response
from cdhr_host.mechanism.spring_field import RISE, ROWS, SPLITS, Domain, SpringField, basis
from cdhr_host.units import DEG
from cdhr_host.values import Array, Flags

ROUNDS: Final = ((8.0, 6), (20.0, 5), (40.0, 5), (80.0, 5), (150.0, 5))
"""(sharpness p, Newton steps)"""
RADII: Final = np.linspace(0.0, 0.9666, 14)
"""of the domain's radius"""
AZIMUTHS: Final = np.linspace(0.0, 60.0, 5) * DEG
"""the rest of the circle follows by symmetry"""
HEIGHTS: Final = 26
NEAR: Final = 0.06
"""a margin this far below zero counts as beyond what is possible"""
PIECE: Final = 48
"""rows of a product done at once"""
DAMPINGS: Final = 8
"""tries of a Newton step, each damped six times as much"""


@dataclass(slots=True)
class _Fit:
    """One fit under way."""

    response: Response
    windows: Windows
    level: Array
    """(N, 2, L): how the first coefficients turn into s_x and s_y; the others do not"""
    upright: Array
    """(N, 1, M - L): how the others turn into s_z; the first do not"""
    weight: Array
    """(N,) what each pose counts"""
    damping: float = 1e-3

    def spring(self, coefficients: Array) -> Array:
        """(M,) -> (N, 3) N."""
        aside = self.level.shape[2]
        return np.hstack((self.level @ coefficients[:aside], self.upright @ coefficients[aside:]))

    def worst(self, coefficients: Array, sharpness: float) -> tuple[float, Array]:
        """The sum, and the share (N, 24) that each margin has in its pose's."""
        margin = self.windows.margins(self.response.force(self.spring(coefficients)))
        least = margin.min(axis=1, keepdims=True)
        share = np.exp(-sharpness * (margin - least))
        total = share.sum(axis=1, keepdims=True)
        value = self.weight @ (np.log(total[:, 0]) / sharpness - least[:, 0])
        return float(value), share / total

    def bent(self, share: Array, sharpness: float) -> tuple[Array, Array]:
        """Each pose's slope (N, 3) and curvature (N, 3, 3) by its spring force, from the shares."""
        half = 0.5 * (self.windows.high - self.windows.low)
        rise = self.response.gain / half[:, None]
        slopes = np.concatenate([rise, -rise], axis=1)
        slope = -np.einsum("ni,nij->nj", share, slopes)
        curve = (share[:, :, None] * slopes).transpose(0, 2, 1) @ slopes
        return slope, sharpness * (curve - slope[:, :, None] * slope[:, None, :])

    def step(self, coefficients: Array, sharpness: float) -> Array:
        """One damped Newton step; the same coefficients where none gets better."""
        value, share = self.worst(coefficients, sharpness)
        slope, curve = self.bent(share, sharpness)
        gradient = self._gathered(self.weight[:, None] * slope)
        hessian = self._hessian(self.weight[:, None, None] * (curve + 1e-7 * np.eye(3)))
        scale = float(np.diag(hessian).mean()) * np.eye(len(coefficients))
        for _ in range(DAMPINGS):
            trial = coefficients - np.linalg.solve(hessian + self.damping * scale, gradient)
            if self.worst(trial, sharpness)[0] < value:
                self.damping = max(self.damping / 6.0, 1e-7)
                return trial
            self.damping *= 6.0
        return coefficients

    def _gathered(self, slope: Array) -> Array:
        """(N, 3) by the spring force -> (M,) by the coefficients."""
        aside, up = np.tensordot(slope[:, :2], self.level), np.tensordot(slope[:, 2:], self.upright)
        return np.concatenate((aside, up))

    def _hessian(self, curve: Array) -> Array:
        """(N, 3, 3) by the spring force -> (M, M) by the coefficients."""
        level, upright = self.level, self.upright
        corner = _product(curve[:, :2, :2] @ level, level)
        beside = _product(curve[:, 2:, :2] @ level, upright)
        last = _product(curve[:, 2:, 2:] * upright, upright)
        return np.block([[corner, beside], [beside.T, last]])


def best_field(cables: Cables, loads: Loads, pairs: Pairs, windows: Windows, rows: Flags) -> SpringField:
    """``rows`` (ROWS,) of the coefficients are free, the others zero; HEIGHT_ONLY: upright.

    Raises MotionError where the windows call for springs that leave the machine.
    """
    domain = whole_machine(cables)
    places = _grid(cables, domain)
    used = np.repeat(rows, RISE + 1)
    full = np.zeros(len(used))
    full[SPLITS[1] * (RISE + 1)] = loads.stiffness * (loads.separation - loads.rest_length)
    coefficients = full[used]
    matrix = basis(domain, (places[:, 0], places[:, 1], places[:, 2]))[:, :, used]
    start = matrix @ coefficients
    aside = int(rows[: SPLITS[1]].sum()) * (RISE + 1)
    level, upright = (np.ascontiguousarray(part) for part in (matrix[:, :2, :aside], matrix[:, 2:, aside:]))
    fit = _Fit(_answer(cables, loads, pairs, places, start), windows, level, upright, np.ones(len(places)))
    for sharpness, steps in ROUNDS:
        for _ in range(steps):
            coefficients = fit.step(coefficients, sharpness)
        spring = fit.spring(coefficients)
        fit.response = _answer(cables, loads, pairs, places, spring)
        fit.weight = _importance(windows.margins(fit.response.force(spring)).min(axis=1))
    full[used] = coefficients
    return SpringField(domain, full.reshape(ROWS, RISE + 1))


def _product(left: Array, right: Array) -> Array:
    """(N, K, L), (N, K, M) -> (L, M): the sum of leftᵀ right, in pieces small enough to stay on one core.

    A library that spreads the product over all cores is slower wherever these have other work.
    """
    count = left.shape[0] * left.shape[1]
    first, second = (_pieces(rows.reshape(count, rows.shape[2])) for rows in (left, right))
    return np.asarray((first.transpose(0, 2, 1) @ second).sum(axis=0), dtype=np.float64)


def _pieces(rows: Array) -> Array:
    """(N, M) -> (P, PIECE, M), filled up with zeros."""
    count, width = -(-len(rows) // PIECE), rows.shape[1]
    filled = np.zeros((count * PIECE, width))
    filled[: len(rows)] = rows
    return filled.reshape(count, PIECE, width)


def whole_machine(cables: Cables) -> Domain:
    """Where three lower cables can hold: inside the pulleys' triangle less the platform, off both planes."""
    out = np.linalg.norm(cables.anchors[0, :2]) - np.linalg.norm(cables.attachments[0, :2])
    floor, gap = float(cables.anchors[0, 2]), float(cables.anchors[3, 2] - cables.anchors[0, 2])
    base = float(cables.attachments[0, 2])
    return Domain(0.5 * float(out), floor + gap / 9.0 - base, floor + gap * 0.807 - base)


def offset(loads: Loads, spring: Vector) -> Vector:
    """Spring force on the lower platform, N -> displacement of the upper one minus the lower's, m."""
    x, y, z = spring
    size = np.sqrt(x * x + y * y + z * z)
    longer = 1.0 / loads.stiffness + loads.rest_length / size
    return x * longer - loads.aside[0], y * longer - loads.aside[1], z * longer - loads.separation


def _answer(cables: Cables, loads: Loads, pairs: Pairs, places: Array, spring: Array) -> Response:
    upper = places + np.column_stack(offset(loads, (spring[:, 0], spring[:, 1], spring[:, 2])))
    if not reachable(cables, places, upper).all():
        size = float(np.linalg.norm(spring, axis=1).max())
        raise MotionError(
            Problem(
                "unsettled",
                f"the best spring force, {size:.4g} N, would take the upper platform out of reach",
                key="spring.policy",
                value=size,
                unit="N",
                hint="windows in [forces] that are no wider than the cables bear, or another policy",
            )
        )
    return response(cables, loads, pairs, places, upper)


def _importance(margin: Array) -> Array:
    beyond = 0.3 * NEAR / np.maximum(np.abs(margin), NEAR)
    return np.where(margin > -NEAR, 1.0 / (0.02 + np.abs(margin)), beyond)


def _grid(cables: Cables, domain: Domain) -> Array:
    r, turn, z = np.meshgrid(
        RADII * domain.radius, AZIMUTHS, np.linspace(domain.low, domain.high, HEIGHTS), indexing="ij"
    )
    places = np.column_stack([(r * np.cos(turn)).ravel(), (r * np.sin(turn)).ravel(), z.ravel()])
    return places[reachable(cables, places, places)]
