"""Robust least squares with a covariance: what measurements say of a model, outliers held back.

Huber's estimate: residuals beyond 1.345 standard deviations count linearly (95 % efficient when
there are no outliers). The deviation comes from the median of the residuals of a first fit,
without as many of the smallest as there are parameters (Street, Carroll, Ruppert, Am. Stat. 42
(1988) 152); the covariance is Huber's (Robust Statistics, 1981, section 7.6).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats
from scipy.optimize import OptimizeResult, least_squares

from cdhr_host.values import Array, Flags

HUBER = 1.345
"""standard deviations from which on a residual counts linearly"""
OUTLYING = 4.0
"""standard deviations beyond which a measurement is called an outlier"""
_MEDIAN_OF_NORMAL = 0.6745
_LEAST_DEVIATION = 1e-9
"""deviation of data without noise, over the residuals at the start"""
_SETTLED = 1e-12
"""relative change and slope at which the solver has arrived"""

Residual = Callable[[Array], Array]
Loss = Literal["linear", "soft_l1", "huber"]


@dataclass(frozen=True, slots=True)
class Fit:
    """P parameters found from N measurements."""

    value: Array
    """(P,)"""
    covariance: Array
    """(P, P)"""
    residual: Array
    """(N,) model minus measurement, in the residual's unit"""
    deviation: float
    """standard deviation of a residual that is no outlier"""
    freedom: int
    """measurements beyond the parameters"""

    @property
    def sigma(self) -> Array:
        """(P,) standard deviations of the parameters."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def quantile(self) -> float:
        """Student's factor for a two-sided interval of 95 %."""
        return float(stats.t.ppf(0.975, self.freedom))

    @property
    def correlation(self) -> Array:
        """(P, P)"""
        return self.covariance / np.outer(self.sigma, self.sigma)

    @property
    def outlier(self) -> Flags:
        """(N,) residuals that are too far off to be noise."""
        return np.abs(self.residual) > OUTLYING * self.deviation

    def transformed(self, value: Array, jacobian: Array) -> "Fit":
        """The same fit in other parameters, (P, P) of their derivatives by these."""
        covariance = jacobian @ self.covariance @ jacobian.T
        return Fit(value, covariance, self.residual, self.deviation, self.freedom)


def fitted(residual: Residual, start: Array, bounds: tuple[Array, Array], scale: Array) -> Fit:
    """(P,) start, bounds and typical sizes -> Fit; more measurements than parameters are needed.

    Raises ArithmeticError when the solver does not come to an end.
    """

    unit = float(np.linalg.norm(residual(start))) or 1.0

    def in_units(parameters: Array) -> Array:
        return residual(parameters) / unit

    def solve(at: Array, loss: Loss = "linear", width: float = 1.0) -> OptimizeResult:
        found = least_squares(
            in_units,
            at,
            "3-point",
            bounds,
            x_scale=scale,
            loss=loss,
            f_scale=width,
            xtol=_SETTLED,
            ftol=_SETTLED,
            gtol=_SETTLED,
        )
        if not found.success:
            raise ArithmeticError(f"the fit did not converge: {found.message}")
        return found

    plain = solve(start)
    rough = solve(plain.x, "soft_l1", _deviation(plain))
    deviation = _deviation(rough)
    found = solve(rough.x, "huber", HUBER * deviation).x
    plain = least_squares(residual, found, "3-point", bounds, x_scale=scale, max_nfev=1)
    deviation *= unit
    covariance = _covariance(np.asarray(plain.jac), plain.fun, deviation)
    return Fit(found, covariance, plain.fun, deviation, len(plain.fun) - len(found))


def _deviation(found: OptimizeResult) -> float:
    """Standard deviation of the honest residuals of a fit."""
    sizes = np.sort(np.abs(found.fun))[len(found.x) :]
    return max(float(np.median(sizes)) / _MEDIAN_OF_NORMAL, _LEAST_DEVIATION)


def _covariance(jacobian: Array, residual: Array, deviation: float) -> Array:
    """(N, P), (N,) -> (P, P): the spread of the residuals held back over the slope of their influence."""
    count, parameters = jacobian.shape
    limit = HUBER * deviation
    inside = float(np.mean(np.abs(residual) <= limit))
    finite = 1.0 + parameters / count * (1.0 - inside) / inside
    spread = np.sum(np.clip(residual, -limit, limit) ** 2) / (count - parameters)
    return np.asarray((finite / inside) ** 2 * spread * np.linalg.pinv(jacobian.T @ jacobian))
