"""How often each millimetre of a program's bead was laid, from what a far side executed."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cdhr_host.drives.rows import joined
from cdhr_host.pipeline import Staircase

CELL = 0.05e-3
"""m of bead in one count"""
ASTRAY = 0.1e-3
"""m of a slider beside every setpoint of the bead: clay that is not on the path"""
MENDED = 0.15e-3
"""m of bead that rounding at a seam may leave out or lay twice: two periods at the fastest"""


@dataclass
class Seam:
    """Where a print was gone on with."""

    begin: float
    """m of bead"""
    stated: float
    """m of overlap that were told"""


@dataclass
class Verdict:
    """m of bead"""

    once: float
    skipped: float
    twice: float
    beyond: float
    """laid twice outside of what was stated"""
    astray: int
    """periods with clay beside the path"""
    astray_m: float
    """m of a slider, the greatest"""
    seams: list[tuple[float, float]]
    """of each seam what was laid twice, and what was stated"""


class Bead:
    """The bead of a program, by the dry run's setpoints."""

    def __init__(self, profile, chunks):
        plan = joined([rows for rows in Staircase(profile).setpoints(chunks) if len(rows)])
        steps = np.linalg.norm(np.diff(plan.nozzle_G, axis=0, prepend=plan.nozzle_G[:1]), axis=1)
        clay = plan.flow > 0.0
        self.length = float(steps[clay].sum())
        self.slider, self.at = plan.slider[clay], np.cumsum(steps[clay])
        self.step, self.nozzle_G = steps[clay], plan.nozzle_G[clay]
        self._tree = cKDTree(self.slider)
        self._places = cKDTree(self.nozzle_G)

    def place(self, slider):
        """(N, 6) m -> (N,) m of bead, and m of a slider that they are beside it."""
        _, near = self._tree.query(slider, workers=1)
        best, away = self.at[near].copy(), np.full(len(slider), np.inf)
        for low in (np.maximum(near - 1, 0), np.minimum(near, len(self.at) - 2)):
            along = self.slider[low + 1] - self.slider[low]
            share = np.sum((slider - self.slider[low]) * along, axis=1)
            share = np.clip(share / np.maximum(np.sum(along**2, axis=1), 1e-18), 0.0, 1.0)[:, None]
            beside = np.abs(self.slider[low] + share * along - slider).max(axis=1)
            found = self.at[low] + share[:, 0] * (self.at[low + 1] - self.at[low])
            nearer = beside < away
            best[nearer], away[nearer] = found[nearer], beside[nearer]
        return best, away

    def begin(self, nozzle_G):
        """m of bead at a place, where a seam is said to begin."""
        return float(self.at[self._places.query(nozzle_G)[1]])

    def judged(self, record, unit, seams, *, whole=True):
        """A far side's record against the bead; ``whole`` says that all of it should be there."""
        here, before = self._laid(record, unit)
        counts = np.zeros(int(self.length / CELL) + 2, dtype=np.int64)
        place, away = self.place(here)
        came, _ = self.place(before)
        jumped = np.abs(place - came) > 10 * MENDED  # between the end of one bead and the next
        first = np.where(jumped, place - self.step.min(), came)
        low, high = np.minimum(first, place), np.maximum(first, place)
        np.add.at(counts, np.rint(low / CELL).astype(int), 1)
        np.add.at(counts, np.rint(high / CELL).astype(int), -1)
        counts = np.cumsum(counts)[: int((self.length if whole else place.max()) / CELL)]
        return self._verdict(counts, seams, away)

    def _laid(self, record, unit):
        """(N, 6) m each: where the sliders were sent with air on, and the period before."""
        told = record["told"] * unit
        air = np.flatnonzero((record["air"] > 0) & (np.arange(len(record)) > 0))
        return told[air], told[air - 1]

    def _verdict(self, counts, seams, away):
        cells = np.arange(len(counts)) * CELL
        told, twice = np.zeros(len(counts), dtype=bool), counts > 1
        found = []
        for seam in seams:
            within = (cells >= seam.begin - MENDED) & (cells <= seam.begin + seam.stated + MENDED)
            found.append((float((twice & within).sum() * CELL), seam.stated))
            told |= within
        return Verdict(
            once=float((counts == 1).sum() * CELL),
            skipped=_runs(counts == 0),
            twice=float(twice.sum() * CELL),
            beyond=_runs(twice & ~told),
            astray=int((away > ASTRAY).sum()),
            astray_m=float(away.max(initial=0.0)),
            seams=found,
        )


def _runs(flags):
    """m of bead in flagged stretches longer than rounding at their ends explains."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(int), [0]))))
    lengths = (edges[1::2] - edges[::2]) * CELL
    return float(lengths[lengths > 2 * MENDED].sum())
