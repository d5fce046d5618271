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


def turned(turn: Turn, spin: Vector, dt: float) -> Turn:
    """A quaternion after turning at ``spin`` rad/s, given in W, for ``dt`` s; a unit one again."""
    sx, sy, sz = spin
    rate = sqrt(sx * sx + sy * sy + sz * sz)
    if rate == 0.0:
        return turn
    half = 0.5 * rate * dt
    c, s = cos(half), sin(half) / rate
    sx, sy, sz = s * sx, s * sy, s * sz
    w, x, y, z = turn
    a = c * w - sx * x - sy * y - sz * z
    b = c * x + sx * w + sy * z - sz * y
    d = c * y + sy * w + sz * x - sx * z
    e = c * z + sz * w + sx * y - sy * x
    size = 1.0 / sqrt(a * a + b * b + d * d + e * e)
    return a * size, b * size, d * size, e * size


def rotation_vector(turn: Turn) -> Vector:
    """rad: axis times angle, the short way round."""
    w, x, y, z = turn if turn[0] >= 0.0 else (-turn[0], -turn[1], -turn[2], -turn[3])
    size = sqrt(x * x + y * y + z * z)
    if size < 1e-9:
        return 2.0 * x, 2.0 * y, 2.0 * z
    factor = 2.0 * atan2(size, w) / size
    return factor * x, factor * y, factor * z
