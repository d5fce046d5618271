"""The lower cables against the bed and against what is already printed, over a whole program."""

import numpy as np

from cdhr_host.errors import Problem
from cdhr_host.mechanism import Clearance
from cdhr_host.pipeline.survey import SPACING
from cdhr_host.profile import Profile
from cdhr_host.values import Setpoints

STEP = 250
"""rows laid before they are looked at: half a metre, little beside a layer of a part that could be hit"""


class Clearing:
    """Fed with setpoints in the order of the program.

    Where the profile only wants to be warned, the first collision ends the search.
    """

    def __init__(self, profile: Profile) -> None:
        self._clearance = Clearance.from_profile(profile)
        self._refuses = profile.bed.clearance == "refuse"
        self.warning: Problem | None = None

    def problems(self, setpoints: Setpoints) -> list[Problem]:
        """Collisions of further setpoints, one for each line and cable."""
        if self.warning is not None or not len(setpoints):
            return []
        rows = _spaced(setpoints)
        found: list[Problem] = []
        for first in range(0, len(rows), STEP):
            part = rows[first : first + STEP]
            found += self._clearance.block(part.nozzle_G, part.line, part.flow > 0.0)
        if self._refuses or not found:
            return found
        self.warning = found[0]
        return []


def _spaced(setpoints: Setpoints) -> Setpoints:
    """Rows at most SPACING apart, with the last one, of rows that may be far closer."""
    way = np.linalg.norm(np.diff(setpoints.nozzle_G, axis=0), axis=1)
    stride = max(1, int(SPACING / max(float(way.max(initial=0.0)), SPACING / len(setpoints))))
    kept = np.zeros(len(setpoints), dtype=bool)
    kept[::stride] = kept[-1] = True
    return setpoints[kept]
