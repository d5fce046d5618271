"""What measured points say of the machine, judged by points it has not seen; a new profile."""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism import Cables
from cdhr_host.mechanism.calibration import Calibrated, Points, before, calibrate
from cdhr_host.mechanism.calibration_model import (
    ATTACHMENTS,
    PULLEYS,
    RADIUS,
    SHIFT,
    SIZE,
    Doubts,
    Frame,
    nozzle,
    predicted,
)
from cdhr_host.mechanism.observability import Direction, unobservable
from cdhr_host.profile import Profile
from cdhr_host.profile.calibration import Calibration
from cdhr_host.report.studies.poses import Poses, candidates, planned
from cdhr_host.units import MM
from cdhr_host.values import Array, Flags

FOLDS: Final = 5
"""every fifth point judges a fit of the others, five times"""
BETTER: Final = 0.9
"""of the drawing's error at most: less of a gain may be chance"""
FEWEST: Final = 10
"""points for that"""
DIGITS: Final = 6
"""of a millimetre in a profile"""


@dataclass(frozen=True, slots=True)
class Judged:
    """rms distances, m: by the drawing, and each by a fit that did not see the point."""

    points: int
    before: float
    after: float

    @property
    def better(self) -> bool:
        """Whether the fit tells more than the drawing."""
        return self.after < BETTER * self.before


@dataclass(frozen=True, slots=True)
class GeometryFit:
    """Everything to be told."""

    profile: Profile
    points: Points
    found: Calibrated
    judged: Judged | None
    """None with too few points"""
    open_: list[Direction]
    add: Poses
    doubt: tuple[float, float]
    """m: greatest standard deviation of the nozzle over the workspace, before and after"""

    @property
    def first(self) -> Array:
        """(N, 3) m: measured less what the drawing predicts."""
        return before(self.found.cables, self.found.frame, self.points)


def fit(
    profile: Profile, points: Points, doubts: Doubts, noise: float | None, *, free_frame: bool, add: int = 5
) -> GeometryFit:
    """Calibrate, judge, and look at what is left open; raises MotionError for sliders without a pose."""
    cables = Cables.from_profile(profile)
    frame = _frame(cables, points) if free_frame else Frame.same()
    found = calibrate(cables, points, doubts, frame, noise)
    could = candidates(profile).slider[:, :3]
    nothing = replace(found, parameters=np.zeros(SIZE), covariance=np.diag(doubts.each() ** 2))
    own = np.arange(SIZE) < SHIFT.start
    doubt = tuple(float(_own(which, own).nozzle_doubt(could).max()) for which in (nothing, found))
    return GeometryFit(
        profile,
        points,
        found,
        _judged(cables, points, doubts, frame, found.noise),
        unobservable(found.information, doubts),
        planned(profile, doubts, add, found.noise, known=found.information),
        (doubt[0], doubt[1]),
    )


def without_pose(profile: Profile, points: Points, lines: list[int]) -> list[Problem]:
    """Rows whose sliders fit no pose of the drawing."""
    cables, problems = Cables.from_profile(profile), []
    for row, line in zip(points.slider, lines, strict=True):
        try:
            nozzle(cables, np.zeros(SIZE), row[None])
        except MotionError as error:
            first = error.problems[0]
            hint = "sliders are in millimetres paid out from the reference pose"
            problems.append(Problem(first.kind, first.message, line=line, hint=hint))
    return problems


def calibrated_profile(fit: GeometryFit) -> Profile:
    """The profile with what was found.

    Reference offsets become the place where the sliders stand at 0. The program's origin goes
    with it: the reference pose keeps its program coordinates.
    """
    found, old = fit.found, fit.profile.calibration
    pulleys, arms = np.array(old.pulleys()), np.array(old.arms())
    pulleys[:3] += found.parameters[PULLEYS].reshape(3, 3)
    arms[:3] += found.parameters[ATTACHMENTS].reshape(3, 3)
    rest = nozzle(found.cables, found.parameters, np.zeros((1, 3)))[0]
    section = Calibration(
        pulley_shift_mm=_mm(pulleys),
        attachment_shift_mm=_mm(arms),
        reference_shift_mm=_mm(old.reference() + rest),
    )
    radius = fit.profile.geometry.pulley_radius + float(found.parameters[RADIUS])
    shape = fit.profile.geometry.model_copy(update={"pulley_radius": radius})
    bed = fit.profile.bed
    names = ("origin_x", "origin_y", "origin_z")
    moved = (section.reference() - old.reference()).tolist()
    origin = {name: getattr(bed, name) + part for name, part in zip(names, moved, strict=True)}
    changed = {"calibration": section, "geometry": shape, "bed": bed.model_copy(update=origin)}
    return fit.profile.model_copy(update=changed)


def _frame(cables: Cables, points: Points) -> Frame:
    """The measuring frame by the whole points; raises MotionError with too few of them."""
    whole = np.isfinite(points.place).all(axis=1)
    if whole.sum() < 4:
        raise MotionError(
            Problem(
                "missing",
                f"{int(whole.sum())} points with x, y and z: too few to find the measuring frame",
                hint="measure four or more, or leave out --frame free",
            )
        )
    drawn = predicted(cables, Frame.same(), np.zeros(SIZE), points.slider[whole])
    return Frame.aligned(drawn, points.place[whole])


def _judged(cables: Cables, points: Points, doubts: Doubts, frame: Frame, noise: float) -> Judged | None:
    """Each point is predicted by a fit that has not seen it."""
    if len(points) < FEWEST:
        return None
    left = np.empty_like(points.place)
    for fold in range(FOLDS):
        aside = np.arange(len(points)) % FOLDS == fold
        others = calibrate(cables, points[~aside], doubts, frame, noise)
        left[aside] = points.place[aside] - others.predicted(points.slider[aside])
    return Judged(len(points), rms(before(cables, frame, points)), rms(left))


def _own(found: Calibrated, own: Flags) -> Calibrated:
    """With nothing but the machine's own parameters in doubt: the measuring frame is not the nozzle's."""
    return replace(found, covariance=found.covariance * np.outer(own, own))


def distance(residual: Array) -> Array:
    """(N, 3) m -> (N,) m, of the coordinates that were measured."""
    return np.asarray(np.sqrt(np.nansum(residual**2, axis=1)))


def rms(residual: Array) -> float:
    """(N, 3) m -> m of distance."""
    return float(np.sqrt(np.mean(distance(residual) ** 2)))


def _mm(shift: Array) -> Any:
    return np.round(shift / MM, DIGITS).tolist()
