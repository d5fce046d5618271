"""Random numbers as a function of seed, stream and index: the same however often and in whatever order."""

from functools import lru_cache
from typing import Final

import numpy as np

from cdhr_host.values import Array

BLOCK: Final = 1024
"""rows drawn at a time"""


def normal(seed: int, stream: int, index: int, width: int) -> Array:
    """(width,) standard normal numbers of a row of a stream."""
    row: Array = _block(seed, stream, index // BLOCK, width, True)[index % BLOCK]
    return row


def uniform(seed: int, stream: int, index: int, width: int) -> Array:
    """(width,) numbers from 0 to 1."""
    row: Array = _block(seed, stream, index // BLOCK, width, False)[index % BLOCK]
    return row


@lru_cache(maxsize=64)
def _block(seed: int, stream: int, block: int, width: int, gaussian: bool) -> Array:
    draws = np.random.Generator(np.random.Philox(key=[seed, stream], counter=[0, 0, 0, block]))
    shape = BLOCK, width
    found = draws.standard_normal(shape) if gaussian else draws.random(shape)
    found.flags.writeable = False
    return found
