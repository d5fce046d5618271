"""Forces inside their windows that come nearest to what is wanted: clipping, or with a priority.

Clipping every cable is what saturation does by itself. Eq. (24)-(25) want the vertical kept:
``nearest`` minimises |W (J F - J F_v)|² over the windows with W = diag(1, 1, z). It is a trade,
not a gain: what z keeps, x and y pay (docs/control.md has the figures).
"""

from itertools import product

import numpy as np

from cdhr_host.values import Array


def nearest(pull: Array, wanted: Array, low: Array, high: Array, weight: float) -> Array:
    """(3, 3) J, (3,) N wanted, (3,) N windows -> (3,) N: the exact optimum inside the windows.

    A convex problem in three bounded numbers: of the 27 choices of cables at their bounds,
    the best whose free cables come out inside.
    """
    rows = np.array([[1.0], [1.0], [weight]]) * pull
    goal = rows @ wanted
    best, least = np.minimum(np.maximum(wanted, low), high), np.inf
    for bound in product((-1, 0, 1), repeat=3):
        found = _candidate(rows, goal, low, high, np.array(bound))
        if found is None:
            continue
        cost = float(((rows @ found - goal) ** 2).sum())
        if cost < least:
            best, least = found, cost
    return best


def _candidate(rows: Array, goal: Array, low: Array, high: Array, bound: Array) -> Array | None:
    """Cables at -1 low or +1 high, the others best; None when those leave their windows."""
    found = np.where(bound < 0, low, high).astype(np.float64)
    free = bound == 0
    if free.any():
        part = rows[:, free]
        rest = goal - rows[:, ~free] @ found[~free]
        found[free] = np.linalg.lstsq(part, rest, rcond=None)[0]
    inside = ((found >= low) & (found <= high)).all()
    return found if inside else None
