"""What the corners of a polyline become: where each is left and reached, and how q''' changes on the way."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.values import Array, Flags, Ints


@dataclass(frozen=True, slots=True)
class Inner:
    """Places within corners, besides begin, middle and end, at which q''' changes."""

    corner: Ints
    """(E,)"""
    at: Array
    """(E,) m in s after its middle"""
    step: Array
    """(2, E) 1/m², along d0 and d1"""


@dataclass(frozen=True, slots=True)
class Spatial:
    """All places of pairs of corners at which q''' changes, in any direction."""

    corner: Ints
    """(P,)"""
    at: Array
    """(P,) m in s after its middle"""
    step: Array
    """(P, 3) 1/m²"""


@dataclass(frozen=True, slots=True)
class Rounding:
    """The stretches of s in which K corners are rounded; rows of pairs are before and after the middle."""

    half: Array
    """(2, K) m in s"""
    saved: Array
    """(2, K) m, by which each half is longer than the drawn way it stands for"""
    gear: Array
    """(2, K) |q'| where its shape begins and where that ends; two corners may share one"""
    steep: Array
    """(2, K) greatest |q'| in each half"""
    step: Array
    """(3, 2, K) 1/m², by which q''' changes at the begin, in the middle and at the end, along d0 and d1"""
    shaped: Flags
    """(K,) whether it is a shape, not a kernel"""
    follows: Flags
    """(K,) whether it begins where the one before it ends, in one shape with it"""
    inner: Inner
    spatial: Spatial


def kernels(half: Array) -> Rounding:
    """Kernels of half-widths (K,) m."""
    one, none, steep = np.ones((2, len(half))), np.zeros((2, len(half))), 1 / half**2
    step = steep * np.array([[[-1], [1]], [[2], [-2]], [[-1], [1]]])
    nowhere, at = np.zeros(0, dtype=np.intp), np.zeros(0)
    inner, spatial = Inner(nowhere, at, np.zeros((2, 0))), Spatial(nowhere, at, np.zeros((0, 3)))
    shaped, follows = np.zeros((2, len(half)), dtype=np.bool_)
    return Rounding(np.stack((half, half)), none, one, one.copy(), step, shaped, follows, inner, spatial)
