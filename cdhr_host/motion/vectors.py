"""Rows of vectors in space."""

import numpy as np

from cdhr_host.values import Array


def norms(vectors: Array) -> Array:
    """(N, 3) -> (N,): lengths of vectors."""
    return np.asarray(np.sqrt(np.einsum("nk,nk->n", vectors, vectors)), dtype=np.float64)


def units(vectors: Array) -> Array:
    """(N, 3) -> (N, 3): vectors of length 1 in the same directions; 0 stays 0."""
    length = np.maximum(norms(vectors), np.finfo(float).tiny)
    return np.asarray(vectors / length[:, None], dtype=np.float64)
