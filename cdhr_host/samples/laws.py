"""The paper's trajectories by the number of their equation: motion law, duration, and what it draws."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.mechanism import trajectories
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class Law:
    """One trajectory."""

    drawing: str
    duration: float
    """s"""
    position: Callable[[Array], Array]
    """(N,) s -> (N, 3) m of displacement"""

    def times(self, step: float) -> Array:
        """s: 0 to the duration in steps, the end left out when it is no whole step."""
        return np.arange(int(round(self.duration / step, 6)) + 1, dtype=np.float64) * step


LAWS: Final = {
    "15": Law("rising spiral", 200.0, trajectories.eq15),
    "35": Law("circle", 10.0, trajectories.eq35),
    "36": Law("flat spiral", 150.0, trajectories.eq36),
}
