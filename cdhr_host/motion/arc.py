"""Arcs as chords the smoothing cannot tell from the arc."""

import math

import numpy as np

from cdhr_host.motion.limits import CHORD_ERROR
from cdhr_host.values import Arc, Array


def chords(arc: Arc, half_width: float) -> Array:
    """(M, 3) m: end points of the chords of an arc or helix; the last is the programmed end.

    Chords are at most half the kernel's half-width h, so that kernels overlap to an even
    curvature, and at most sqrt(8 R e) long, so that their sagitta stays below e. Where the
    slicer's rounding left the end at another radius than the start, the radius goes over
    from one to the other along the arc.
    """
    start, end = arc.start_G[:2] - arc.centre_G, arc.end_G[:2] - arc.centre_G
    r0, r1 = math.hypot(*start), math.hypot(*end)
    longest = min(half_width / 2, math.sqrt(8 * max(r0, r1) * CHORD_ERROR))
    count = max(math.ceil(max(r0, r1) * abs(arc.sweep) / longest), 2)
    u = np.arange(1, count + 1) / count
    angle = math.atan2(start[1], start[0]) + arc.sweep * u
    radius = r0 + (r1 - r0) * u
    points = np.empty((count, 3))
    points[:, 0] = arc.centre_G[0] + radius * np.cos(angle)
    points[:, 1] = arc.centre_G[1] + radius * np.sin(angle)
    points[:, 2] = arc.start_G[2] + (arc.end_G[2] - arc.start_G[2]) * u
    points[-1] = arc.end_G
    return points
