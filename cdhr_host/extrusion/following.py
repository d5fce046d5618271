"""The inverse of a first-order lag, as near as its input's range allows.

A lag fed with u, held for a tick, is at the tick's end at x = keep · before + (1 - keep) · u. So
the input that brings it where it is wanted is known at once; where that input does not exist,
the nearest one is taken, and the lag catches up from there.
"""

import numpy as np

from cdhr_host.values import Array


def follow(wanted: Array, before: float, keep: float, least: float, most: float) -> tuple[Array, Array]:
    """(N,) wanted at the ticks' ends -> (N,) inputs from ``least`` to ``most``, (N,) reached.

    ``before`` is where the lag was, ``keep`` what a tick leaves of it, 0 <= keep < 1. Runs of
    ticks that can be followed exactly are worked out at once.
    """
    lifted = np.diff(wanted, prepend=wanted[:1]) * (keep / (1.0 - keep))
    given, reached = wanted + lifted, wanted.copy()
    hard = np.append(np.flatnonzero((given < least) | (given > most)), len(wanted)).tolist()
    k, past = 0, 0
    at = before
    while k < len(wanted):
        given[k] = min(max((wanted[k] - keep * at) / (1.0 - keep), least), most)
        at = float(keep * at + (1.0 - keep) * given[k])
        reached[k], k = at, k + 1
        if k < len(wanted) and abs(at - wanted[k - 1]) <= 1e-12 * most:
            while hard[past] < k:
                past += 1
            if hard[past] > k:
                k, at = hard[past], float(wanted[hard[past] - 1])
    return given, reached


def settle(level: float, before: float, keep: float, count: int) -> Array:
    """(count,) reached by the lag under one input."""
    left = keep ** np.arange(1, count + 1) * (before - level)
    return np.asarray(level + left, dtype=np.float64)
