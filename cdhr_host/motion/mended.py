"""The least jerk that closes a shape of two right angles, or takes it nearer to the drawn moves.

What is blended of shapes does not end where it should, and is further off than these. Acceleration, speed and
place at any time are linear in the jerks of the pieces; so the least squares of more jerk that change them as
wanted follow in closed form. None of it acts along the second straight before the first corner: what is not
to be below the first straight is not by that.
"""

import math
from dataclasses import replace

import numpy as np

from cdhr_host.motion.pair_shapes import PIECES, Pairs, Shapes, dot, norm
from cdhr_host.values import Array

ENDS = 7
"""Rows of what must be at the end, before those of points"""
SOFT = 0.02
"""which need not be met so exactly: two that are near each other cannot go different ways"""


def closed(shapes: Shapes, pairs: Pairs) -> Shapes:
    """Without acceleration at the end, and there on the third straight and along it."""
    return _mended(shapes, _frame(pairs), *_ends(shapes, pairs))


def nearer(shapes: Shapes, pairs: Pairs, at: Array, away: Array) -> Shapes:
    """Closed, and at P times (P, K) s moved by all of ``away`` (P, 3, K) m along it."""
    frame, distance = _frame(pairs), norm(away)
    toward = away / np.maximum(distance, np.finfo(float).tiny)[:, None]
    rows, missing = _ends(shapes, pairs)
    along = np.stack([dot(toward, axis) for axis in frame], axis=1)
    points = _weight(shapes, at, 3)[:, :, None] * along[:, None]
    return _mended(shapes, frame, np.concatenate((rows, points)), np.concatenate((missing, -distance)))


def _frame(pairs: Pairs) -> Array:
    """(3, 3, K) along the third straight; as far across it as that is along the second; and to the side."""
    _, up, after = pairs.direction
    across = up - dot(up, after) * after
    across = across / norm(across)
    return np.stack((after, across, np.cross(after, across, axis=0)))


def _weight(shapes: Shapes, at: Array, power: int) -> Array:
    """(P, 28, K): what jerk on each piece adds to acceleration (1), speed (2) or place (3) at (P, K) s."""
    t = shapes.pieces
    end = np.cumsum(t, axis=0)
    since = [np.maximum(at[:, None] - edge, 0.0) ** power for edge in (end - t, end)]
    return np.asarray((since[0] - since[1]) / math.factorial(power), dtype=np.float64)


def _ends(shapes: Shapes, pairs: Pairs) -> tuple[Array, Array]:
    """Rows (7, 28, 3, K) of what must be at the end, by axes of the frame, and what is missing (7, K)."""
    frame, (before, up, _) = _frame(pairs), pairs.direction
    end = shapes.duration.sum(axis=0)[None]
    weight = [_weight(shapes, end, power)[0] for power in (1, 2, 3)]
    (pieces, count), missing = weight[0].shape, np.zeros((ENDS, len(end[0])))
    rows = np.zeros((ENDS, pieces, 3, count))
    for row, (power, axis) in enumerate(((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 1), (2, 2))):
        along, begin = frame[axis], shapes.speed * dot(before, frame[axis])
        rows[row, :, axis] = weight[power]
        target = -begin if power == 1 else 0.0 * begin
        if power == 2:
            target = pairs.length * dot(up, along) + shapes.reach * dot(before, along) - begin * end[0]
        missing[row] = target - (weight[power] * dot(shapes.jerk, along)).sum(axis=0)
    return rows, missing


def _mended(shapes: Shapes, frame: Array, rows: Array, missing: Array) -> Shapes:
    """With the jerk that rows (R, 28, 3, K) of it make ``missing`` (R, K), the least squares over time."""
    gain = np.repeat(1 / np.sqrt(shapes.pieces[:, None]), 3, axis=1)
    gain[: PIECES[0], 1] = 0.0
    scaled = np.ascontiguousarray((rows * gain).reshape(len(rows), -1, len(missing[0])).transpose(2, 0, 1))
    square = scaled @ scaled.swapaxes(1, 2)
    points = np.arange(ENDS, len(missing))
    own = square[:, points, points]
    square[:, points, points] += np.where(own > 0.0, SOFT * own, 1.0)
    found = np.linalg.solve(square, missing.T[:, :, None]).swapaxes(1, 2)
    more = gain * (found @ scaled)[:, 0].T.reshape(gain.shape)
    return replace(shapes, jerk=shapes.jerk + sum(more[:, [axis]] * frame[axis] for axis in range(3)))
