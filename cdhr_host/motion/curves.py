"""Cubic Bézier curves as points that the smoothing turns into the true curve again.

As with arcs (see ``motion.arc``), the smoothed points are the smoothed curve to within
CHORD_ERROR, and their curvature is continuous; it is even because the points lie evenly by
arc length, a whole number of them in the kernel's half-width, and closer only where the
curve bends so sharply that the sagitta asks for it. There the spacing changes gradually and
at least EVEN of them lie in the half-width, where the worst ripple of even spacing,
2 sinc²(EVEN + 1/2), is 0.7 %. A place where the curve nearly stands still may be a cusp or
the turning point of a line: it is always one of the points.
"""

import math
from itertools import pairwise

import numpy as np

from cdhr_host.motion.arc import spacing
from cdhr_host.motion.limits import CHORD_ERROR
from cdhr_host.values import Array, Spline

SAMPLES = 2048
"""Places along the parameter at which length and curvature are taken."""
EVEN = 5
"""Points in the kernel's half-width at which spacing that changes shows no ripple."""
SPARE = 0.5
"""Of the sagitta: what the spacing between two places may add to it."""
SLOW = 0.1
"""Of the mean |B'|: where it is least and below this, the curve nearly stands still."""
SHORTEST = 1e-12
"""m, less is rounding."""
STANDING = 1e-6
"""Of the greatest |B'|: below this the curvature is rounding."""


def points_on(spline: Spline, half_width: float) -> Array:
    """(M + 1, 3) m: points on a curve, from its start to its end, chords within CHORD_ERROR of it.

    A curve shorter than SHORTEST is its two ends.
    """
    control = spline.control_G
    t, breaks = _places(control)
    s = _lengths_to(control, t)
    if s[-1] < SHORTEST:
        return control[[0, 3]]
    density = _density(control, t, s, half_width)
    reached = np.concatenate(([0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(s))))
    chosen = [np.zeros(1)]
    for before, after in pairwise(np.searchsorted(t, breaks)):
        count = max(math.ceil((reached[after] - reached[before]) * (1 - 1e-12)), 1)
        wanted = np.linspace(reached[before], reached[after], count + 1)[1:]
        chosen.append(np.interp(wanted, reached, t))
    points = bezier(control, np.concatenate(chosen))
    points[0], points[-1] = control[0], control[3]
    return points


def spline_length(spline: Spline) -> float:
    """m, as drawn."""
    control = spline.control_G
    return float(_lengths_to(control, _places(control)[0])[-1])


def bezier(control: Array, t: Array) -> Array:
    """(4, 3) m, (N,) -> (N, 3) m (Bernstein's form)."""
    u = 1.0 - t
    weights = np.stack((u**3, 3 * u**2 * t, 3 * u * t**2, t**3), axis=1)
    points: Array = weights @ control
    return points


def _places(control: Array) -> tuple[Array, Array]:
    """((N,), (K,)): parameters to look at, and those of the ends and of where the curve nearly stands still.

    |B'|² is least where B'·B'' = 0, a cubic in t.
    """
    a, b, c = _slope(control)
    roots = np.roots([2 * c @ c, 3 * b @ c, b @ b + 2 * a @ c, a @ b])
    still = np.sort(roots.real[(np.abs(roots.imag) < STANDING) & (roots.real > 0.0) & (roots.real < 1.0)])
    speed = _norm(a + still[:, None] * (b + still[:, None] * c))
    polygon = float(_norm(np.diff(control, axis=0)).sum())
    breaks = np.unique(np.concatenate(([0.0], still[speed < SLOW * polygon], [1.0])))
    return np.union1d(np.arange(SAMPLES + 1) / SAMPLES, breaks), breaks


def _density(control: Array, t: Array, s: Array, half_width: float) -> Array:
    """(N,) 1/m: points for each metre of curve."""
    bend = _curvature(control, t)
    bend = np.maximum(bend, np.maximum(np.append(bend[1:], 0.0), np.insert(bend[:-1], 0, 0.0)))
    asked = np.sqrt(bend / (8 * CHORD_ERROR * SPARE))
    closest = 1.0 / float(asked.max()) if asked.any() else math.inf
    even = 1.0 / spacing(float(s[-1]), max(closest, half_width / EVEN), half_width)
    density: Array = np.maximum(asked, even)
    return density


def _lengths_to(control: Array, t: Array) -> Array:
    """(N,) m: length of the curve up to each parameter."""
    reached: Array = np.concatenate(([0.0], np.cumsum(_norm(np.diff(bezier(control, t), axis=0)))))
    return reached


def _curvature(control: Array, t: Array) -> Array:
    """(N,) 1/m: |B' x B''| / |B'|³; 0 where the curve stands still."""
    a, b, c = _slope(control)
    at = t[:, None]
    first, second = a + at * (b + at * c), b + 2 * at * c
    speed = _norm(first)
    moving = speed > STANDING * speed.max()
    bend: Array = np.where(moving, _norm(np.cross(first, second)), 0.0) / np.where(moving, speed, 1.0) ** 3
    return bend


def _slope(control: Array) -> Array:
    """(4, 3) m -> (3, 3): B'(t) = a + b t + c t²."""
    d = 3 * np.diff(control, axis=0)
    return np.stack((d[0], 2 * (d[1] - d[0]), d[2] - 2 * d[1] + d[0]))


def _norm(vectors: Array) -> Array:
    """(N, 3) -> (N,)."""
    lengths: Array = np.sqrt(np.einsum("nk,nk->n", vectors, vectors))
    return lengths
