"""Bounds of a motion on short pieces, with its parts as they are together, not as if each were at its worst.

On a piece of the path q''' is constant, on one of the law s'''. Acceleration and jerk of the nozzle then have

    d²/dt² (q'' v² + q' a)             = 6 q''' v² a + 3 q'' a² + 4 q'' v j
    d²/dt² (q''' v³ + 3 q'' v a + q' j) = 15 q''' v a² + 10 q''' v² j + 10 q'' a j

and over a time t no function is further from the straight between its ends than t²/8 of that.
"""

from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.smooth_path import SmoothPath
from cdhr_host.values import Array, Ints

REST = 1e-12
"""m/s, is no motion"""
HALVINGS = 50
"""of a piece of the law, in search of where the path's next piece begins"""


@dataclass(frozen=True, slots=True)
class Pieces:
    """P pieces of a time law."""

    state: Array
    """(4, P) s, s', s'' at the start, s'''"""
    lasting: Array
    """(P,) s"""
    reached: Array
    """(2, P) m, s at both ends"""

    def only(self, which: Ints) -> "Pieces":
        """Some of them, or some several times."""
        return Pieces(self.state[:, which], self.lasting[which], self.reached[:, which])

    def way(self, x: Array) -> Array:
        """(P,) s after the start of each -> m from its start."""
        _, v, a, j = self.state
        return np.asarray(x * (v + x * (a / 2 + x * (j / 6))))

    def rate(self, x: Array) -> Array:
        """(P,) s -> m/s."""
        _, v, a, j = self.state
        return np.asarray(v + x * (a + x * (j / 2)))

    def when(self, s: Array) -> Array:
        """(P,) m -> (P,) s after the start of each, by halving."""
        low, high = np.zeros_like(s), self.lasting
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            before = self.way(middle) < s - self.state[0]
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return low

    def fastest(self) -> Array:
        """(P,) m/s, the greatest s' on each."""
        _, first, a, j = self.state
        with np.errstate(divide="ignore", invalid="ignore"):
            top = np.where(j < 0.0, np.clip(-a / j, 0.0, self.lasting), self.lasting)
        return np.asarray(np.maximum(first, self.rate(top)))

    @property
    def onward(self) -> bool:
        """Whether s' is nowhere negative."""
        _, first, a, j = self.state
        with np.errstate(divide="ignore", invalid="ignore"):
            bottom = np.where(j > 0.0, np.clip(-a / j, 0.0, self.lasting), self.lasting)
        return bool((np.minimum(first, self.rate(bottom)) >= -REST).all())


def overlapped(pieces: Array, start: Array, end: Array) -> Ints:
    """(2 K,) first path piece of each stretch of s, and the one after its last, in turn."""
    first = np.maximum(np.searchsorted(pieces, start, side="right") - 1, 0)
    last = np.maximum(np.searchsorted(pieces, end, side="left"), first + 1)
    return np.column_stack((first, last)).ravel()


def met(rows: Ints) -> tuple[Ints, Ints, Ints]:
    """Path pieces that K stretches meet, by pairs of rows (2 K,) as ``overlapped`` gives them.

    (M,) the stretch, (M,) the piece, and (K,) where each stretch begins among these.
    """
    first, last = rows.reshape(-1, 2).T
    count = last - first
    which, heads = np.repeat(np.arange(len(count)), count), np.cumsum(count) - count
    return which, first[which] + np.arange(len(which)) - heads[which], heads


def close_bounds(path: SmoothPath, law: Pieces) -> tuple[Array, Array]:
    """(P,) m/s², (P,) m/s³: no less than the nozzle's acceleration and jerk on each piece of a law."""
    which, piece, heads = met(overlapped(path.start, *law.reached))
    found = _pair_bounds(path, piece, law.only(which))
    return np.maximum.reduceat(found[0], heads), np.maximum.reduceat(found[1], heads)


def _pair_bounds(path: SmoothPath, piece: Ints, law: Pieces) -> tuple[Array, Array]:
    """Of pieces of a law on one of those of the path (P,) each that they meet."""
    ends = np.append(path.start[1:], path.end)
    s = np.stack((np.maximum(law.reached[0], path.start[piece]), np.minimum(law.reached[1], ends[piece])))
    x = np.zeros_like(s)
    x[1] = law.lasting
    for end in range(2):
        cut = np.flatnonzero(s[end] != law.reached[end])
        x[end, cut] = law.only(cut).when(s[end, cut])
    _, slope, bend, third = path.coefficients[:, :, piece]
    offset = s - path.start[piece]
    q3 = third[:, None]
    q2 = bend[:, None] + offset * q3
    q1 = slope[:, None] + offset * (bend[:, None] + offset * (q3 / 2))
    j = law.state[3]
    v, a = np.maximum(law.rate(x), 0.0), law.state[2] + x * j
    pulled = _lengths(q2 * v**2 + q1 * a).max(axis=0)
    jerked = _lengths(q3 * v**3 + 3 * q2 * (v * a) + q1 * j).max(axis=0)
    sharp, turn = _lengths(third), _lengths(q2).max(axis=0)
    harsh, hard, fast = np.abs(j), np.abs(a).max(axis=0), law.fastest()
    far = (x[1] - x[0]) ** 2 / 8
    snap = 6 * sharp * fast**2 * hard + turn * (3 * hard**2 + 4 * fast * harsh)
    crackle = sharp * fast * (15 * hard**2 + 10 * fast * harsh) + 10 * turn * hard * harsh
    return pulled + far * snap, jerked + far * crackle


def _lengths(vectors: Array) -> Array:
    """(3, ...) -> (...)"""
    return np.asarray(np.sqrt((vectors**2).sum(axis=0)))
