"""Things that go wrong with a slider, to give to ``Machine``."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.values import Array, Ints


@dataclass(frozen=True, slots=True)
class Stuck:
    """The slider of cable ``axis`` (0-5) stays where it is from ``tick`` on."""

    axis: int
    tick: int

    def __call__(self, tick: Ints, slider: Array, last: Array) -> Array:
        """See ``Disturbance``."""
        first = int(np.searchsorted(tick, self.tick))
        real = slider.copy()
        real[first:, self.axis] = real[first - 1, self.axis] if first else last[self.axis]
        return real


@dataclass(frozen=True, slots=True)
class Slipped:
    """The coupling of cable ``axis`` (0-5) slips by ``distance`` m at ``tick``."""

    axis: int
    tick: int
    distance: float

    def __call__(self, tick: Ints, slider: Array, last: Array) -> Array:  # noqa: ARG002
        """See ``Disturbance``."""
        real = slider.copy()
        real[:, self.axis] += np.where(tick >= self.tick, self.distance, 0.0)
        return real
