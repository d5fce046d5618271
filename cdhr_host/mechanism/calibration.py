"""The geometry from measured nozzle points: robust least squares around the drawing.

What is minimised is Huber's measure of the residuals over their noise plus the squares of the
parameters over their doubts: the most probable machine. Parameters that the points say nothing
about stay at the drawing, with the doubt they had. Pulley and attachment of a cable are told apart
by their doubts only; the nozzle, which depends on their difference, is as well known as the
residuals say.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from cdhr_host.mechanism.cables import Cables
from cdhr_host.mechanism.calibration_model import Doubts, Frame, predicted, slopes
from cdhr_host.units import MM
from cdhr_host.values import Array, Flags

HUBER: Final = 2.5
"""residuals beyond that many standard deviations count less"""
OUTLIER: Final = 5.0
"""standard deviations that make a coordinate an outlier"""
ROUNDS: Final = 4
"""in which the noise is measured from the residuals"""
MAD: Final = 1.4826
"""median of magnitudes -> standard deviation, of normal noise"""


@dataclass(frozen=True, slots=True)
class Points:
    """Measured nozzle points."""

    slider: Array
    """(N, 3) m: sliders 1-3 by their encoders"""
    place: Array
    """(N, 3) m in the measuring frame; NaN where a coordinate was not measured"""

    def __getitem__(self, rows: slice | Flags) -> "Points":
        return Points(self.slider[rows], self.place[rows])

    def __len__(self) -> int:
        return len(self.slider)


@dataclass(frozen=True, slots=True)
class Calibrated:
    """The most probable machine."""

    cables: Cables
    """the drawing"""
    frame: Frame
    doubts: Doubts
    parameters: Array
    """(SIZE,) m and rad, away from the drawing"""
    covariance: Array
    """(SIZE, SIZE)"""
    noise: float
    """m, standard deviation of a coordinate"""
    residual: Array
    """(N, 3) m, measured less predicted; NaN where nothing was measured"""
    information: Array
    """(SIZE, SIZE): of the points alone, in doubts of the parameters"""

    @property
    def deviation(self) -> Array:
        """(SIZE,): standard deviations of the parameters after measuring."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def outliers(self) -> Flags:
        """(N,): points with a coordinate that no such noise explains."""
        return np.asarray((np.abs(np.nan_to_num(self.residual)) > OUTLIER * self.noise).any(axis=1))

    def predicted(self, slider: Array) -> Array:
        """(N, 3) m of sliders 1-3 -> (N, 3) m in the measuring frame."""
        return predicted(self.cables, self.frame, self.parameters, slider)

    def nozzle_doubt(self, slider: Array) -> Array:
        """(N, 3) m of sliders 1-3 -> (N,) m: standard deviation of the nozzle's place in space."""
        _, by = slopes(self.cables, self.frame, self.parameters, slider)
        return np.asarray(np.sqrt(np.einsum("nik,kl,nil->n", by, self.covariance, by)))


def before(cables: Cables, frame: Frame, points: Points) -> Array:
    """(N, 3) m: measured less what the drawing predicts."""
    from_drawing = np.zeros(len(Doubts().each()))
    return points.place - predicted(cables, frame, from_drawing, points.slider)


def calibrate(
    cables: Cables, points: Points, doubts: Doubts, frame: Frame | None = None, noise: float | None = None
) -> Calibrated:
    """The machine that these points make most probable.

    ``noise`` m is the standard deviation of a measured coordinate; None takes it from the residuals.
    Raises MotionError where slider positions fit no pose.
    """
    at = Frame.same() if frame is None else frame
    sigma = noise or 0.1 * MM
    for _ in range(1 if noise else ROUNDS):
        found = _solved(cables, points, doubts, at, sigma)
        if not noise:
            sigma = max(_spread(found), 1e-6)
    return found


def _solved(cables: Cables, points: Points, doubts: Doubts, frame: Frame, noise: float) -> Calibrated:
    each = doubts.each()
    known = np.isfinite(points.place)
    count = int(known.sum())

    @lru_cache(maxsize=2)
    def at(scaled: bytes) -> tuple[Array, Array]:
        return whole(np.frombuffer(scaled))

    def whole(scaled: Array) -> tuple[Array, Array]:
        place, by = slopes(cables, frame, each * scaled, points.slider)
        rows = np.concatenate([(place - points.place)[known] / noise, scaled])
        return rows, np.vstack([by[known] * (each / noise), np.eye(len(each))])

    def huber(square: Array) -> Array:
        """Of the points; what is known of the drawing stays square."""
        size = np.sqrt(np.maximum(square, HUBER**2))
        beyond = np.arange(len(square)) < count
        beyond &= square > HUBER**2
        value = np.where(beyond, 2.0 * HUBER * size - HUBER**2, square)
        slope = np.where(beyond, HUBER / size, 1.0)
        return np.stack([value, slope, np.where(beyond, -0.5 * HUBER / size**3, 0.0)])

    start = np.zeros(len(each))
    answer = least_squares(
        lambda x: at(x.tobytes())[0],
        start,
        jac=lambda x: at(x.tobytes())[1],
        loss=huber,
        xtol=1e-10,
        ftol=1e-10,
    )
    rows, by = whole(answer.x)
    weight = huber(rows**2)[1][:count, None]
    information = by[:count].T @ (weight * by[:count])
    covariance = np.linalg.inv(information + np.eye(len(each)))
    parameters = each * answer.x
    residual = points.place - predicted(cables, frame, parameters, points.slider)
    scaled = np.outer(each, each) * covariance
    return Calibrated(cables, frame, doubts, parameters, scaled, noise, residual, information)


def _spread(found: Calibrated) -> float:
    """m: standard deviation of the noise that leaves such residuals, whatever a few outliers say."""
    residual = found.residual[np.isfinite(found.residual)]
    told = found.information
    used = float(np.trace(told @ np.linalg.inv(told + np.eye(len(told)))))
    freedom = max(len(residual) - used, 1.0)
    return float(MAD * np.median(np.abs(residual)) * np.sqrt(len(residual) / freedom))
