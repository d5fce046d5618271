"""Which poses to measure: from the machine's own workspace, the most telling ones, in a short way round."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.mechanism import Cables, Workspace, lengths, slider
from cdhr_host.mechanism.calibration_model import Doubts
from cdhr_host.mechanism.observability import best_poses, in_turn
from cdhr_host.profile import Profile
from cdhr_host.units import MINUTE, MM
from cdhr_host.values import Array, Flags

RADII, AZIMUTHS, HEIGHTS = 6, 12, 6
SHARES: Final = (1.0, 0.8, 0.6, 0.4, 0.2)
"""of the grid of candidates over the bed, and of that grid drawn in towards the program's origin"""
MARGINS: Final = (0.05, 0.1, 0.2, 0.4)
"""of the force windows that poses keep, in half-widths: the first that the ways between them keep up"""
ALONG: Final = 40
"""places looked at between two poses"""
SPEED: Final = 30.0 * MM
"""m/s between poses"""
SETTLE: Final = 2.0
"""s at rest before a pose is measured"""


@dataclass(frozen=True, slots=True)
class Poses:
    """Places to measure, in the order they are visited."""

    position_G: Array
    """(N, 3) m in program coordinates"""
    slider: Array
    """(N, 6) m"""


def candidates(profile: Profile, margin: float = MARGINS[0]) -> Poses:
    """Every grid place of the bed that cables and sliders bear; raises MotionError without any."""
    bed = profile.bed
    r, turn, z = np.meshgrid(
        bed.radius * np.sqrt(np.linspace(0.0, 1.0, RADII)),
        np.linspace(0.0, 2.0 * np.pi, AZIMUTHS, endpoint=False),
        np.linspace(0.0, bed.height, HEIGHTS),
        indexing="ij",
    )
    places = np.column_stack([(r * np.cos(turn)).ravel(), (r * np.sin(turn)).ravel(), z.ravel()])
    scaled = np.vstack([places * share for share in SHARES])
    kept = np.unique(np.round(scaled[_bears(profile, scaled, margin)], 6) + 0.0, axis=0)
    if not len(kept):
        raise MotionError(
            Problem(
                "force",
                "no place over the bed keeps all cables well inside their windows",
                key="forces",
                hint="cdhr workspace shows what the windows allow",
            )
        )
    return poses_at(profile, kept)


def _bears(profile: Profile, position_G: Array, margin: float) -> Flags:
    """(N, 3) m -> (N,): places where the machine may accelerate with that margin left."""
    space = Workspace.from_profile(profile)
    q = position_G - space.cables.reference_G
    moving = space.margin(q, profile.limits.acceleration_max)
    return np.asarray(space.within_limits(q) & (moving > margin))


def poses_at(profile: Profile, position_G: Array) -> Poses:
    """(N, 3) m -> with the sliders that the profile's policy has there."""
    space = Workspace.from_profile(profile)
    q = position_G - space.cables.reference_G
    return Poses(position_G, slider(space.cables, lengths(space.cables, q, space.policy.upper(q))))


def planned(profile: Profile, doubts: Doubts, count: int, noise: float, known: Array | None = None) -> Poses:
    """The ``count`` most telling places in a short way round, which the machine bears throughout.

    Raises MotionError where there is no such way.
    """
    start = Cables.from_profile(profile).reference_G
    for margin in MARGINS:
        could = candidates(profile, margin)
        rows = best_poses(
            Cables.from_profile(profile), doubts, could.slider[:, :3], count, noise, known=known
        )
        rows = rows[in_turn(could.position_G[rows], start)]
        found = Poses(could.position_G[rows], could.slider[rows])
        if _bears(profile, _way(found.position_G, start), 0.0).all():
            return found
    raise MotionError(
        Problem(
            "force",
            f"no way from pose to pose keeps the force windows, even at {MARGINS[-1]:g} of margin",
            hint="fewer poses, or lower limits.acceleration_max_mm_s2",
        )
    )


def _way(position_G: Array, start: Array) -> Array:
    """(N, 3) m, (3,) m -> (M, 3) m along the straight lines from the start through all and back."""
    stops = np.vstack([start, position_G, start])
    share = np.linspace(0.0, 1.0, ALONG, endpoint=False)[:, None]
    legs = [a + share * (b - a) for a, b in pairwise(stops)]
    return np.vstack([*legs, start])


def program(poses: Poses, told: str) -> Iterator[str]:
    """G-code that rests at each pose until the operator goes on; air stays off."""
    yield f"; {told}"
    yield "; at each M0: read the encoders, measure the nozzle, fill in the row, then go on"
    yield from ("G21", "G90", "G28")
    for number, (x, y, z) in enumerate(poses.position_G / MM, 1):
        yield f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f} F{SPEED / MM * MINUTE:g} ; pose {number}"
        yield f"G4 P{SETTLE * 1e3:g}"
        yield f"M0 pose {number}"
    yield "G28"


def sheet(poses: Poses, measured: Array | None = None) -> Iterator[str]:
    """The table: sliders as planned, the columns to fill in empty, or (N, 3) m that were measured."""
    yield ",".join([*(f"slider{i}_mm" for i in range(1, 7)), "x_mm", "y_mm", "z_mm"])
    for number, row in enumerate(poses.slider / MM):
        place = ["", "", ""] if measured is None else [f"{value:.4f}" for value in measured[number] / MM]
        yield ",".join([*(f"{value:.6f}" for value in row), *place])
