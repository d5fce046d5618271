"""Motion that no program draws: the upper platform alone, or whatever one slider moves."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.mechanism import UpperMotion, transition
from cdhr_host.motion.playback import Beat
from cdhr_host.motion.sampling import Stand
from cdhr_host.pipeline.rig import Rig
from cdhr_host.values import Array, Ints, ToolTrack

SAME = 1e-9
"""m: nearer than this the upper platform need not move"""


@dataclass(frozen=True, slots=True)
class Shift:
    """Ticks at which the upper platform moves otherwise than the policy has it."""

    track: ToolTrack
    """the nozzle: standing, but where one slider moves it"""
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


def nozzle_standing_at(track: ToolTrack, tick: Ints) -> ToolTrack:
    """Ticks (N,) at which the nozzle stands where ``track`` begins."""
    still, nothing = np.zeros((len(tick), 3)), np.zeros(len(tick))
    line = np.full(len(tick), track.line[0])
    return ToolTrack(tick, line, still + track.position_G[0], still, still.copy(), nothing, nothing.copy())


def played_shift(step: Shift, tick: Ints, beat: Beat, period: float) -> Shift:
    """A shift played at ``beat.u`` (N,), ticks of the plan within it.

    Between two ticks of the plan it is the quintic that has their places, velocities and
    accelerations.
    """
    u = np.clip(beat.u - float(step.track.tick[0]), 0.0, len(step.track.tick) - 1.0)
    before = np.minimum(u.astype(np.int64), len(step.track.tick) - 2)
    rate, slope = beat.rate[:, None], beat.slope[:, None] / period

    def paced(motion: UpperMotion) -> UpperMotion:
        place, velocity, acceleration = _quintic(motion, before, (u - before)[:, None], period)
        return UpperMotion(place, rate * velocity, rate**2 * acceleration + slope * velocity)

    track = step.track
    nozzle = paced(UpperMotion(track.position_G, track.velocity, track.acceleration))
    return Shift(nozzle_moving(nozzle, tick, int(track.line[0])), paced(step.upper))


def nozzle_moving(motion: UpperMotion, tick: Ints, line: int) -> ToolTrack:
    """The nozzle (N, 3) m in G, moved without clay."""
    nothing = np.zeros(len(tick))
    moved = motion.place, motion.velocity, motion.acceleration
    return ToolTrack(tick, np.full(len(tick), line), *moved, nothing, nothing.copy())


def _quintic(motion: UpperMotion, k: Ints, z: Array, period: float) -> tuple[Array, Array, Array]:
    """Place, velocity and acceleration at the share z (N, 1) of the way from row k (N,) to the next."""
    c0, c1, c2 = motion.place[k], motion.velocity[k] * period, motion.acceleration[k] * period**2 / 2
    value = motion.place[k + 1] - c0 - c1 - c2
    first = motion.velocity[k + 1] * period - c1 - 2 * c2
    second = motion.acceleration[k + 1] * period**2 - 2 * c2
    c3 = 10 * value - 4 * first + second / 2
    c4 = -15 * value + 7 * first - second
    c5 = 6 * value - 3 * first + second / 2
    return (
        c0 + z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * c5)))),
        (c1 + z * (2 * c2 + z * (3 * c3 + z * (4 * c4 + z * 5 * c5)))) / period,
        (2 * c2 + z * (6 * c3 + z * (12 * c4 + z * 20 * c5))) / period**2,
    )
