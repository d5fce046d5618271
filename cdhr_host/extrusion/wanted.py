"""Planned flow -> the pressure wanted at the clay, and when the air is to be open.

While clay flows the pressure is that of its law. In short gaps between two beads (a corner
taken at rest) it stays at the clay's yield, where nothing flows; in longer ones the air is shut,
the pressure bleeds, and a smooth ramp restores it to the yield just before the next bead. In the
last moments before a bead it rises on to where the clay creeps: a paste needs most of its
pressure for its first flow.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdhr_host.extrusion.rheology import PressureFlow
from cdhr_host.values import Array, Flags, Ints

RISING: Final = 4
"""power of time by which the pressure nears creeping, so that it goes on rising as steeply with the bead"""
SLOW: Final = 0.02
"""of the flow that is about to be laid: creeping is slower than that"""
NEVER: Final = 2**40
"""ticks: further than any program is long"""


@dataclass(frozen=True, slots=True)
class Gaps:
    """How gaps between beads are passed, in ticks."""

    restore: int
    """length of the ramp before a bead"""
    longest: int
    """a gap up to this long is passed at yield"""
    creeps: int
    """length of the rise from the clay's yield to where it creeps"""


@dataclass(frozen=True, slots=True)
class Wanted:
    """N ticks."""

    pressure: Array
    """(N,) Pa at the clay"""
    open: Flags
    """(N,) whether the air is open"""
    since: Ints
    """(N,) ticks since clay flowed last; 0 while it flows"""


def wanted(flow: Array, since: int, law: PressureFlow, creep: float, gaps: Gaps) -> Wanted:
    """(N,) m³/s, all that is known, and ticks ``since`` the row before these flowed last.

    ``creep`` is the flow, m³/s, at which a bead may begin. Rows further than ``gaps.longest``
    from the end do not depend on what may follow.
    """
    flowing = flow > 0.0
    ago, ahead = _since(flowing, since), _until(flowing)
    short = ago + ahead - 1 <= gaps.longest
    near = ahead <= gaps.restore
    ramp = np.where(short, 1.0, _eased(ahead, gaps.restore))
    slow = np.minimum(creep, SLOW * _peak(flow, 2 * gaps.creeps))
    more = law.pressure(slow) - law.threshold if creep > 0.0 else 0.0
    creeping = _until(flowing & (flow >= slow))
    pressure = law.threshold * ramp + more * _nearing(creeping, gaps.creeps) ** RISING
    pressure[flowing] = np.maximum(law.pressure(flow[flowing]), pressure[flowing])
    opened = flowing | near | short
    return Wanted(np.where(opened, pressure, 0.0), opened, ago)


def _eased(ahead: Ints, length: int) -> Array:
    """(N,) ticks before a bead -> from 0, ``length`` ticks before it, smoothly to 1."""
    z = _nearing(ahead, length)
    return z * z * (3.0 - 2.0 * z)


def _nearing(ahead: Ints, length: int) -> Array:
    """(N,) ticks before a bead -> from 0, ``length`` ticks before it, to 1."""
    return np.asarray(np.clip(1.0 - ahead / max(length, 1), 0.0, 1.0))


def _peak(flow: Array, ahead: int) -> Array:
    """(N,) the greatest of each row and of ``ahead`` rows after it."""
    padded = np.concatenate((flow, np.zeros(ahead)))
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, ahead + 1).max(axis=1))


def _since(flowing: Flags, before: int) -> Ints:
    """(N,) ticks since the last true row."""
    at = np.arange(len(flowing))
    last = np.maximum.accumulate(np.where(flowing, at, -1 - before))
    return np.asarray(at - last, dtype=np.int64)


def _until(flowing: Flags) -> Ints:
    """(N,) ticks until the next true row; NEVER if there is none."""
    at = np.arange(len(flowing))
    following = np.minimum.accumulate(np.where(flowing, at, NEVER + len(flowing))[::-1])[::-1]
    return np.asarray(np.minimum(following - at, NEVER), dtype=np.int64)


def until_shut(opened: Flags) -> Ints:
    """(N,) ticks until the air is shut next; NEVER where it stays open in these rows."""
    return _until(~opened)


def coasted(flow: Array, path: Array, coast: float, gaps: Gaps) -> Array:
    """(N,) m³/s, (N,) m along the path -> flow without the last ``coast`` m of each bead.

    A bead ends where a gap longer than ``gaps.longest`` begins within these rows.
    """
    flowing = flow > 0.0
    ahead = _until(flowing)
    ends = np.flatnonzero(flowing[:-1] & (ahead[1:] > gaps.longest))
    if not len(ends):
        return flow
    at = np.minimum(np.searchsorted(ends, np.arange(len(flow))), len(ends) - 1)
    left = path[ends[at]] - path
    past = np.arange(len(flow)) > ends[-1]
    return np.asarray(np.where((left < coast) & ~past, 0.0, flow), dtype=np.float64)
