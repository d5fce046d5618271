"""Turns of a rigid body as quaternions (w, x, y, z), in plain numbers."""

from math import atan2, cos, sin, sqrt

Turn = tuple[float, float, float, float]
Vector = tuple[float, float, float]


def rotation(turn: Turn) -> tuple[Vector, Vector, Vector]:
    """Unit quaternion -> the body's x, y and z axes in W."""
    w, x, y, z = turn
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, w * x, w * y, w * z
    return (
        (1.0 - 2.0 * (yy + zz), 2.0 * (xy + wz), 2.0 * (xz - wy)),
        (2.0 * (xy - wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz + wx)),
        (2.0 * (xz + wy), 2.0 * (yz - wx), 1.0 - 2.0 * (xx + yy)),
    )


def turned(turn: Turn, spin: Vector, inertia: tuple[float, float], dt: float) -> tuple[Turn, Vector]:
    """Free motion for ``dt`` s of a body that is round about its z, exactly: turn and spin after it.

    ``inertia`` is kg m² across and about z, ``spin`` rad/s in W. The angular momentum h stays in
    space, so the body turns about it at h over the inertia across while it turns about its own z
    at (1/about - 1/across) h·z.
    """
    (sx, sy, sz), (across, about) = spin, inertia
    if not (sx or sy or sz):
        return turn, spin
    w, x, y, z = turn
    ax, ay, az = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
    along = sx * ax + sy * ay + sz * az
    more = (about / across - 1.0) * along
    sx, sy, sz = sx + more * ax, sy + more * ay, sz + more * az
    own = 0.5 * dt * more
    rate = sqrt(sx * sx + sy * sy + sz * sz)
    half = 0.5 * dt * rate
    c, s = cos(half), sin(half) / rate if rate else 0.0  # a spin whose square is no number any more
    hx, hy, hz = s * sx, s * sy, s * sz
    a = c * w - hx * x - hy * y - hz * z
    b = c * x + hx * w + hy * z - hz * y
    d = c * y + hy * w + hz * x - hx * z
    e = c * z + hz * w + hx * y - hy * x
    c, s = cos(own), -sin(own)
    w, x, y, z = a * c - e * s, b * c + d * s, d * c - b * s, e * c + a * s
    size = 1.0 / sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w * size, x * size, y * size, z * size
    ax, ay, az = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
    return (w, x, y, z), (sx - more * ax, sy - more * ay, sz - more * az)


def spun(turn: Turn, spin: Vector, moment: Vector, inertia: tuple[float, float], dt: float) -> Vector:
    """The spin, rad/s in W, after a ``moment`` N m acted for ``dt`` s on a body round about its z."""
    (sx, sy, sz), (mx, my, mz), (w, x, y, z), (across, about) = spin, moment, turn, inertia
    ax, ay, az = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
    along = (ax * mx + ay * my + az * mz) * (1.0 / about - 1.0 / across)
    return (
        sx + dt * (mx / across + along * ax),
        sy + dt * (my / across + along * ay),
        sz + dt * (mz / across + along * az),
    )


def rotation_vector(turn: Turn) -> Vector:
    """rad: axis times angle, the short way round."""
    w, x, y, z = turn if turn[0] >= 0.0 else (-turn[0], -turn[1], -turn[2], -turn[3])
    size = sqrt(x * x + y * y + z * z)
    if size < 1e-9:
        return 2.0 * x, 2.0 * y, 2.0 * z
    factor = 2.0 * atan2(size, w) / size
    return factor * x, factor * y, factor * z
