"""Speeds at the borders of cells, in closed form.

At every border s'' = 0. A speed change from v0 to v1 with s'' = 0 at both ends and
|s''| <= a, |s'''| <= j takes T = 2 sqrt(d/j) if d = |v1 - v0| <= a²/j, else d/a + a/j,
over the distance (v0 + v1)/2 · T.
"""

import math
from dataclasses import replace

import numpy as np

from cdhr_host.motion.limits import Cells
from cdhr_host.values import Array


def change_distance(v0: Array, v1: Array, a: Array, j: Array) -> Array:
    """(K,) m: distance of the fastest speed change; infinite where a is 0 and the speeds differ."""
    d = np.abs(v1 - v0)
    with np.errstate(divide="ignore", invalid="ignore"):
        time = np.where(d * j <= a * a, 2 * np.sqrt(d / j), d / a + a / j)
    return np.where(d == 0, 0.0, (v0 + v1) / 2 * np.where(a > 0, time, np.inf))


def reachable(v0: float, length: float, a: float, j: float) -> float:
    """m/s: greatest speed a change from v0 reaches within a length; v0 where a is 0.

    Beyond d = a²/j the distance is a quadratic in d, below it a cubic in sqrt(d/j) with one
    real root (y³ + p y = q, p >= 0), which the hyperbolic form gives without cancellation.
    """
    if a <= 0.0 or length <= 0.0:
        return v0
    knee = a * a / j
    if (2 * v0 + knee) * a / j >= length:
        p, q = 2 * v0 / j, length / j
        if p < 1e-12 * math.cbrt(q) ** 2:
            y = math.cbrt(q)
        else:
            root = math.sqrt(p / 3)
            y = 2 * root * math.sinh(math.asinh(1.5 * q / p / root) / 3)
        return v0 + j * y * y
    b, c = 2 * v0 + knee, length * a - v0 * knee
    return v0 + 4 * c / (b + math.sqrt(b * b + 8 * c))


def border_speeds(cells: Cells, entry: float | None, exit_speed: float | None) -> tuple[Array, Array]:
    """(K+1,) speeds at the borders, and the ones a forward pass alone would allow.

    ``entry`` is the speed already given at the first border, or None where the path opens
    and any speed will do; ``exit_speed`` likewise at the last. A border whose two speeds
    agree cannot become faster by knowing more of the path.
    """
    cap = np.minimum(np.append(cells.speed, np.inf), np.concatenate(([np.inf], cells.speed)))
    if entry is not None:
        cap[0] = entry
    forward = _pass(cap, cells)
    cap = forward.copy()
    if exit_speed is not None:
        cap[-1] = min(exit_speed, cap[-1])
    backward = _pass(cap[::-1], _reversed(cells))[::-1]
    return backward, forward


def _reversed(cells: Cells) -> Cells:
    return replace(
        cells, length=cells.length[::-1], acceleration=cells.acceleration[::-1], jerk=cells.jerk[::-1]
    )


def _pass(cap: Array, cells: Cells) -> Array:
    """(K+1,) -> (K+1,): each speed lowered to what the one before it can reach."""
    needed = change_distance(cap[:-1], np.maximum(cap[1:], cap[:-1]), cells.acceleration, cells.jerk)
    short = needed > cells.length
    speeds = cap.tolist()
    length, a, j = cells.length.tolist(), cells.acceleration.tolist(), cells.jerk.tolist()
    for i in np.flatnonzero(short).tolist():
        k = i
        while k < len(length) and speeds[k + 1] > speeds[k]:
            reached = reachable(speeds[k], length[k], a[k], j[k])
            if reached >= speeds[k + 1]:
                break
            speeds[k + 1] = reached
            k += 1
    return np.array(speeds)


def peak_speeds(cells: Cells, borders: Array) -> Array:
    """(K,) m/s: greatest speed inside each cell between its border speeds."""
    v0, v1, a, j = borders[:-1], borders[1:], cells.acceleration, cells.jerk
    low, high = np.maximum(v0, v1), np.maximum(cells.speed, np.maximum(v0, v1))
    fits = change_distance(v0, high, a, j) + change_distance(high, v1, a, j) <= cells.length
    low = np.where(fits, high, low)
    for _ in range(48):
        middle = (low + high) / 2
        fits = change_distance(v0, middle, a, j) + change_distance(middle, v1, a, j) <= cells.length
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    return low
