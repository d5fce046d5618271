"""The path as it will be drawn: fed during the proof, in memory that does not grow with the program."""

from typing import Final

import numpy as np

from cdhr_host.errors import Problem
from cdhr_host.mechanism import Windows
from cdhr_host.motion.vectors import norms
from cdhr_host.pipeline import Checked
from cdhr_host.profile import Profile
from cdhr_host.report.page.places import place_of
from cdhr_host.report.thinning import Thinner
from cdhr_host.units import MM
from cdhr_host.values import Array, Flags

COLUMNS: Final = ("x", "y", "z", "speed", "margin", "pressure", "flow", "t", "line")
"""of a vertex, SI; floats of 32 bits hold 4 ms in ten hours, and lines up to 16 million"""
STEPPED: Final = [COLUMNS.index("flow"), COLUMNS.index("line")]
"""columns that have no values in between: those of a segment are its end's"""
BUDGET: Final = 300_000
"""vertices a page holds at most"""
TOLERANCE: Final = 0.02 * MM
"""m a drawn path may be off to begin with"""
SHADE: Final = 0.01
"""of a colour's range that a drawn quantity may be off to begin with"""
BETWEEN: Final = (0.25, 0.5, 0.75)
"""where vertices are put between two samples that are more than a tick apart"""
OUTSIDE: Final = -1.0
"""margin shown where cables are further outside than that, or the nozzle is off the bed"""


class Trail:
    """Vertices of the nozzle's path with what is shown of each, and where the problems are.

    ``watch`` takes the blocks of a proof. Tolerances double whenever more than twice the budget is held.
    """

    def __init__(self, profile: Profile, budget: int = BUDGET) -> None:
        self._profile = profile
        self._windows = Windows.from_profile(profile)
        self._last: Array | None = None
        self._thinner = Thinner(_scale(profile), _laying, budget)
        self.places: dict[tuple[int | None, str | None], Array] = {}
        """of problems, by line and key: (3,) m, ``_G``"""

    @property
    def tolerance(self) -> float:
        """m: how far the drawn path is from the planned one at most."""
        return TOLERANCE * self._thinner.coarser

    def watch(self, checked: Checked) -> None:
        """Take in a block."""
        for problem in checked.problems:
            self.places[problem.line, problem.key] = place_of(problem, checked)
        if len(checked.track.tick):
            self._thinner.add(self._filled(checked))

    def vertices(self) -> Array:
        """(M, 9) of COLUMNS, M at most the budget; float32."""
        return self._thinner.vertices().astype(np.float32)

    def place(self, problem: Problem, rows: Array) -> Array | None:
        """(3,) m: where a problem is; the first vertex of its line where nothing nearer is known."""
        known = self.places.get((problem.line, problem.key))
        if known is not None or problem.line is None or not len(rows):
            return known
        at = min(int(np.searchsorted(rows[:, -1], problem.line)), len(rows) - 1)
        return np.asarray(rows[at, :3], dtype=np.float64)

    def _filled(self, checked: Checked) -> Array:
        """The samples of a block as vertices, with more of them along the curve between two."""
        track = checked.track
        margin, pressure = np.full(len(track.tick), OUTSIDE), np.zeros(len(track.tick))
        on_bed = np.isin(track.tick, checked.setpoints.tick, assume_unique=True)
        margin[on_bed] = np.maximum(self._windows.least_margin(checked.nine), OUTSIDE)
        pressure[on_bed] = checked.setpoints.pressure
        t = track.tick * self._period(checked)
        quantities = norms(track.velocity), margin, pressure, track.flow, t, track.line, *track.velocity.T
        rows = np.column_stack([track.position_G, *quantities])
        rows = np.concatenate([rows[:1] if self._last is None else self._last[None], rows])
        self._last = rows[-1]
        return _between(rows)

    def _period(self, checked: Checked) -> float:
        rows = checked.setpoints
        if len(rows) and rows.tick[-1]:
            return float(rows.t[-1] / rows.tick[-1])
        return self._profile.drives.period


def _scale(profile: Profile) -> Array:
    """Tolerances of COLUMNS to begin with."""
    limits, extruder = profile.limits, profile.extruder
    shades = SHADE * np.array([limits.speed_max, 1.0, extruder.pressure_max])
    return np.array([*[TOLERANCE] * 3, *shades, 0.0, 0.0, 0.0])


def _laying(rows: Array) -> Flags:
    """(M, 9) -> (M,): whether clay is laid."""
    return np.asarray(rows[:, COLUMNS.index("flow")] > 0.0, dtype=np.bool_)


def _between(rows: Array) -> Array:
    """(M, 9 + 3) with velocities -> (M', 9) float32: cubic Hermite curves between the samples, cut in four.

    Samples of a proof are up to 2 mm apart; curves keep the rounding of a corner visible.
    """
    start, end = rows[:-1], rows[1:]
    span = (end[:, 7] - start[:, 7])[:, None]
    far = np.flatnonzero(norms(end[:, :3] - start[:, :3]) > 5.0 * TOLERANCE)
    start, end, span = start[far], end[far], span[far]
    made, where = [rows[1:]], [np.arange(1.0, len(rows))]
    if not where[0].size:
        made, where = [rows], [np.zeros(1)]
    for u in BETWEEN:
        middle = (1.0 - u) * start + u * end
        middle[:, :3] = _hermite(start, end, span, u)
        middle[:, STEPPED] = end[:, STEPPED]
        made.append(middle)
        where.append(far + u)
    order = np.argsort(np.concatenate(where), kind="stable")
    return np.concatenate(made)[order, : len(COLUMNS)].astype(np.float32)


def _hermite(start: Array, end: Array, span: Array, u: float) -> Array:
    """Places at ``u`` of the cubic with these places and velocities."""
    a, b = 2 * u**3 - 3 * u**2 + 1, 3 * u**2 - 2 * u**3
    c, d = u**3 - 2 * u**2 + u, u**3 - u**2
    places = a * start[:, :3] + b * end[:, :3] + span * (c * start[:, 9:] + d * end[:, 9:])
    return np.asarray(places, dtype=np.float64)
