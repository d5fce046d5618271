"""What the pulleys would cost: the nozzle's error with setpoints that take cables for straight lines."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.mechanism import (
    Cables,
    Give,
    Loads,
    forward,
    lengths,
    model_errors,
    slider,
    stretch_doubt,
    stretched_forward,
    tensions,
    uncompensated_error,
)
from cdhr_host.profile import Profile
from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class StretchEffect:
    """What elastic cables do to the nozzle along a trajectory, m, greatest along x, y and z."""

    ignored: Array
    """(3,) with setpoints for rigid cables"""
    doubt: Array
    """(3,) with setpoints that allow for the stretch, for what EA may be off"""


@dataclass(frozen=True, slots=True)
class Compensation:
    """Greatest |error| of the nozzle along a trajectory, m, for x, y and z."""

    uncompensated: Array
    """(3,) with setpoints ‖BA‖"""
    compensated: Array
    """(3,) with setpoints that follow the cable round its pulley"""


def compensation(profile: Profile, position: Array) -> Compensation:
    """(N, 3) m of displacement of both platforms -> greatest errors. Raises MotionError out of reach."""
    cables = Cables.from_profile(profile)
    nozzle, _ = uncompensated_error(cables, position, position)
    reached, _ = forward(cables, lengths(cables, position, position))
    return Compensation(np.abs(nozzle).max(axis=0), np.abs(reached - position).max(axis=0))


def stretch_effect(profile: Profile, position: Array) -> StretchEffect:
    """(N, 3) m -> StretchEffect of [stretch], resting at each place. Raises MotionError out of reach."""
    cables, loads, give = (
        Cables.from_profile(profile),
        Loads.from_profile(profile),
        Give.from_profile(profile),
    )
    tension = tensions(cables, loads, position, position)
    rigid = slider(cables, lengths(cables, position, position))
    hung, _ = stretched_forward(cables, loads, give, rigid)
    still = np.zeros((1, 3))
    home, _ = stretched_forward(cables, loads, give, slider(cables, lengths(cables, still, still)))
    off = stretch_doubt(cables, give, position, position, tension)
    return StretchEffect(np.abs(hung - home - position).max(axis=0), off.max(axis=0))


def models(profile: Profile, position: Array) -> dict[tuple[str, str], Array]:
    """(N, 3) m -> {(believed, actual): (3,) m}: setpoints by one pulley model on a machine like another."""
    return model_errors(Cables.from_profile(profile), position, position)
