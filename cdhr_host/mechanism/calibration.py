"""The geometry from measured nozzle points: robust least squares around the drawing.

What is minimised is Huber's measure of the residuals over their noise plus the squares of the
parameters over their doubts: the most probable machine. Parameters that the points say nothing
about stay at the drawing, with the doubt they had. Pulley and attachment of a cable are told apart
by their doubts only; the nozzle, which depends on their difference, is as well known as the
residuals say.
"""

from dataclasses import dataclass
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


class _Problem:
    """Whitened residuals of the points, then the parameters, all in standard deviations."""

    def __init__(self, cables: Cables, points: Points, doubts: Doubts, frame: Frame, noise: float) -> None:
        self.machine, self.points, self.noise = (cables, frame), points, noise
        self.each = doubts.each()
        self.known = np.isfinite(points.place)
        self.count = int(self.known.sum())
        self._at, self._rows = np.empty(0), (np.empty(0), np.empty(0))

    def rows(self, scaled: Array) -> tuple[Array, Array]:
        """(SIZE,) parameters in doubts -> residuals and their derivatives; the last answer is kept."""
        if not np.array_equal(scaled, self._at):
            place, by = slopes(*self.machine, self.each * scaled, self.points.slider)
            short = (place - self.points.place)[self.known] / self.noise
            steep = by[self.known] * (self.each / self.noise)
            self._at = np.array(scaled)
            self._rows = np.concatenate([short, scaled]), np.vstack([steep, np.eye(len(scaled))])
        return self._rows

    def residuals(self, scaled: Array) -> Array:
        """For the solver."""
        return self.rows(scaled)[0]

    def jacobian(self, scaled: Array) -> Array:
        """For the solver."""
        return self.rows(scaled)[1]

    def huber(self, square: Array) -> Array:
        """(3, K): value, slope and curvature for the squares; what is known of the drawing stays square."""
        size = np.sqrt(np.maximum(square, HUBER**2))
        beyond = (np.arange(len(square)) < self.count) & (square > HUBER**2)
        value = np.where(beyond, 2.0 * HUBER * size - HUBER**2, square)
        slope = np.where(beyond, HUBER / size, 1.0)
        return np.stack([value, slope, np.where(beyond, -0.5 * HUBER / size**3, 0.0)])

    def information(self, scaled: Array) -> Array:
        """(SIZE, SIZE): of the points alone, in doubts; outliers say less."""
        rows, by = (part[: self.count] for part in self.rows(scaled))
        weight = self.huber(rows**2)[1]
        return np.asarray(by.T @ (weight[:, None] * by))


def _solved(cables: Cables, points: Points, doubts: Doubts, frame: Frame, noise: float) -> Calibrated:
    problem = _Problem(cables, points, doubts, frame, noise)
    answer = least_squares(
        problem.residuals,
        np.zeros(len(problem.each)),
        jac=problem.jacobian,
        loss=problem.huber,  # type: ignore[arg-type]  # the manual: (3, K)
        xtol=1e-10,
        ftol=1e-10,
    )
    information = problem.information(answer.x)
    covariance = np.linalg.inv(information + np.eye(len(problem.each)))
    parameters = problem.each * answer.x
    residual = points.place - predicted(cables, frame, parameters, points.slider)
    scaled = np.outer(problem.each, problem.each) * covariance
    return Calibrated(cables, frame, doubts, parameters, scaled, noise, residual, information)


def _spread(found: Calibrated) -> float:
    """m: standard deviation of the noise that leaves such residuals, whatever a few outliers say."""
    residual = found.residual[np.isfinite(found.residual)]
    told = found.information
    used = float(np.trace(told @ np.linalg.inv(told + np.eye(len(told)))))
    freedom = max(len(residual) - used, 1.0)
    return float(MAD * np.median(np.abs(residual)) * np.sqrt(len(residual) / freedom))
