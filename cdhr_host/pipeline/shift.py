"""The upper platform on its way between the reference offset and the policy's, the nozzle standing."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.mechanism import UpperMotion, transition
from cdhr_host.motion.sampling import Stand
from cdhr_host.pipeline.rig import Rig
from cdhr_host.values import Array, ToolTrack

SAME = 1e-9
"""m: nearer than this the upper platform need not move"""


@dataclass(frozen=True, slots=True)
class Shift:
    """Ticks at which only the upper platform moves."""

    track: ToolTrack
    """the nozzle, standing"""
    upper: UpperMotion


def shift(rig: Rig, at_G: Array, offsets: tuple[Array, Array], period: float) -> UpperMotion | None:
    """The upper platform's way from one offset (3,) m from the nozzle's displacement to another.

    From its first place on, one for each period, at rest at both ends. None if it need not move.
    """
    start, end = offsets
    if np.linalg.norm(end - start) < SAME:
        return None
    sliders = rig.profile.sliders
    limits = sliders.speed_max / 2, sliders.acceleration_max / 2, sliders.jerk_max / 2
    q = at_G - rig.cables.reference_G
    way, still = transition(q + start, q + end, limits, period), np.zeros((1, 3))
    place = np.concatenate(((q + start)[None], way.place))
    return UpperMotion(
        place, np.concatenate((still, way.velocity)), np.concatenate((still, way.acceleration))
    )


def nozzle_standing(stand: Stand, ticks: range) -> ToolTrack:
    """The nozzle at rest over a range of ticks."""
    tick = np.arange(ticks.start, ticks.stop)
    still, nothing = np.zeros((len(tick), 3)), np.zeros(len(tick))
    line = np.full(len(tick), stand.line)
    return ToolTrack(tick, line, still + stand.at_G, still, still.copy(), nothing, nothing.copy())
