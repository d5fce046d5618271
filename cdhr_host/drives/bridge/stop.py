"""What a bridge plays instead of its buffer when it stops: the rule of docs/link.md, section 7."""

import dataclasses

import numpy as np

from cdhr_host.drives.bridge.messages import ramp_ticks
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Ints, Setpoints

ONE = 1 << 16


def played(ahead: int, ramp: int) -> Ints:
    """(M,) playback time in 1/65536 ticks, M = ramp + 1; it never passes the last stored tick.

    Rate of step n is 1 - 3 z² + 2 z³ with z = n / ramp, in whole numbers.
    """
    z = np.arange(ramp + 1, dtype=np.int64) * ONE // ramp
    squared = z * z >> 16
    rate = ONE - 3 * squared + 2 * (squared * z >> 16)
    time = np.concatenate([[0], np.cumsum(rate[1:])])
    return np.asarray(np.minimum(time, (ahead - 1) * ONE), dtype=np.int64)


def stop_rows(ahead: Setpoints, counts: Ints, unit: float, profile: Profile) -> Setpoints:
    """Rows fed from the stop's first tick on, their (N, 6) position units -> the rows played."""
    time = played(len(ahead), ramp_ticks(profile))
    first, share = time >> 16, time & (ONE - 1)
    after = np.minimum(first + 1, len(ahead) - 1)
    at = counts[first] + ((counts[after] - counts[first]) * share[:, None] >> 16)
    tick = ahead.tick[:1] + np.arange(len(time), dtype=np.int64)
    none = np.zeros(len(time))
    blended = {name: _blend(getattr(ahead, name), first, after, share) for name in _BLENDED}
    return dataclasses.replace(
        ahead[np.zeros(1, dtype=np.int64)],
        tick=tick,
        t=np.asarray(tick * profile.drives.period, dtype=np.float64),
        line=ahead.line[first],
        slider=np.asarray(at * unit, dtype=np.float64),
        flow=none,
        pressure=none.copy(),
        **blended,
    )


_BLENDED = ("nozzle_G", "upper", "tension")


def _blend(values: Array, first: Ints, after: Ints, share: Ints) -> Array:
    part = (share / ONE)[:, None]
    return np.asarray(values[first] * (1.0 - part) + values[after] * part, dtype=np.float64)
