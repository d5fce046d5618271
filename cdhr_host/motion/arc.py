"""Arcs and helices as chords that the smoothing turns into the true curve again.

The kernel K of ``smooth_path`` is a triangle of half-width h: q = K * p, with p the chords.
Nothing of the chords' corners is left in q, for three reasons:

* Position. p differs from the arc g by the sagitta e at most, so |K * p - K * g| <= e: q is
  the smoothed true arc to a micrometre. K * g has the arc's own shape, only nearer to the
  axis: K averages the circle over the variance h²/6, which shrinks the radius by h²/(12 R).
* Continuity. q is a cubic spline in s: q'' is continuous and piecewise linear, so curvature
  is continuous wherever and however short the chords are.
* Evenness. Chords of one length c turn by one angle, so q'' is the arc's own curvature times
  c sum K(s - k c) = 1 + 2 sum sinc²(n h/c) cos(2 pi n s/c), n = 1, 2, ... (Poisson). That is
  1 without any ripple where h is a whole number of chords. ``spacing`` asks for m chords in
  h, m >= 2 whole, and at least SHORTEST in the arc; rounding their number up misses m by h/L
  at most, and the ripple that leaves is 2 (h / (m L))² <= 2 / SHORTEST² = 0.8 %.

So an arc is planned with the speed, curvature and jerk of an arc, not of its chords.
"""

import math

import numpy as np

from cdhr_host.motion.limits import CHORD_ERROR
from cdhr_host.values import Arc, Array

LEAST_IN_KERNEL = 2
"""Chords in the kernel's half-width."""
SHORTEST = 16
"""Chords in the shortest arc."""


def spacing(length: float, longest: float, half_width: float) -> float:
    """m, m, m -> m: chords of a curve, none above ``longest``, a whole number of them in the kernel."""
    in_kernel = max(LEAST_IN_KERNEL, half_width / longest, half_width * SHORTEST / length)
    return half_width / math.ceil(in_kernel)


def chords(arc: Arc, half_width: float) -> Array:
    """(M + 1, 3) m: corners of the chords of an arc or helix, from its start to its programmed end.

    Chords are at most sqrt(8 R e) long, so that their sagitta stays below e = CHORD_ERROR.
    Where the slicer's rounding left the end at another radius than the start, the radius goes
    over from one to the other along the arc.
    """
    first, second, along = arc.plane.value
    start, end = arc.start_G[[first, second]] - arc.centre_G, arc.end_G[[first, second]] - arc.centre_G
    rise = float(arc.end_G[along] - arc.start_G[along])
    r0, r1 = math.hypot(*start), math.hypot(*end)
    wide = max(r0, r1)
    length = math.hypot(wide * arc.sweep, rise)
    count = math.ceil(length / spacing(length, math.sqrt(8 * wide * CHORD_ERROR), half_width))
    u = np.arange(count + 1) / count
    angle = math.atan2(start[1], start[0]) + arc.sweep * u
    radius = r0 + (r1 - r0) * u
    points = np.empty((count + 1, 3))
    points[:, first] = arc.centre_G[0] + radius * np.cos(angle)
    points[:, second] = arc.centre_G[1] + radius * np.sin(angle)
    points[:, along] = arc.start_G[along] + rise * u
    points[0], points[-1] = arc.start_G, arc.end_G
    return points


def arc_length(arc: Arc) -> float:
    """m, along the helix, as drawn."""
    first, second, along = arc.plane.value
    radius = math.hypot(*(arc.start_G[[first, second]] - arc.centre_G))
    return math.hypot(radius * arc.sweep, float(arc.end_G[along] - arc.start_G[along]))
