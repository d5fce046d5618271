"""How full the bus is: worst-case bits of every frame in a cycle, 1 Mbit/s classic CAN."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cdhr_host.drives.canopen.pdo import all_maps
from cdhr_host.errors import Problem, ProfileError
from cdhr_host.profile.schema import Profile

BIT_RATE: Final = 1_000_000
REFUSED_ABOVE: Final = 0.70
BACKGROUND: Final = 8 * 10 + 20
"""frames of one byte a second that are not cyclic: heartbeats"""


@dataclass(frozen=True, slots=True)
class BusLoad:
    """Worst case of one cycle."""

    bits: float
    """in a cycle, on average over the cycles"""
    share: float
    """of the bus"""


def frame_bits(length: int) -> int:
    """Worst-case bits of an 11-bit data frame with ``length`` bytes, stuffing and gap included.

    47 + 8 n bits, and a stuff bit after every fourth of the 34 + 8 n that are stuffed.
    """
    return 47 + 8 * length + (34 + 8 * length - 1) // 4


def bus_load(profile: Profile, bit_rate: int = BIT_RATE) -> BusLoad:
    """The load of this profile's period and PDO map."""
    bits = sum(_cyclic(profile)) + frame_bits(1 if profile.canopen.sync_counter else 0)
    background = BACKGROUND * frame_bits(1) / bit_rate
    return BusLoad(bits, bits / (profile.drives.period * bit_rate) + background)


def bus_share(profile: Profile, bit_rate: int = BIT_RATE) -> float:
    """The share of the bus a profile fills in the worst case; ProfileError above REFUSED_ABOVE."""
    load = bus_load(profile, bit_rate)
    if load.share > REFUSED_ABOVE:
        raise ProfileError(
            Problem(
                "bus-load",
                f"the CAN bus would be {load.share:.0%} full in the worst case "
                f"(limit {REFUSED_ABOVE:.0%}) at {bit_rate // 1000} kbit/s",
                key="canopen.feedback_every",
                value=round(100 * load.share, 1),
                limit=100 * REFUSED_ABOVE,
                unit="percent",
                hint="a longer [drives] period_ms, or feedback_every = 4, or the framed link",
            )
        )
    return load.share


def _cyclic(profile: Profile) -> Iterator[float]:
    for node_maps in all_maps(profile.canopen).values():
        for pdo in node_maps:
            if pdo.type <= 240:
                yield frame_bits(pdo.bytes) / pdo.type
            elif pdo.event_ms:
                yield frame_bits(pdo.bytes) * profile.drives.period / (pdo.event_ms * 1e-3)
