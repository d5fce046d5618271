"""The bridge's clock as the host sees it: round trips, drift, and the tick being played."""

from collections import deque
from typing import Final

import numpy as np

KEPT: Final = 64
"""exchanges looked at, 16 s of them"""
NEAR_BEST: Final = 1.5
"""times the shortest round trip: exchanges slower than that say little about the offset"""


class ClockSync:
    """From CLOCK_REQ and CLOCK: the bridge answers somewhere within the round trip.

    The middle of a round trip is its time at the bridge but for half of what the trip took
    longer than the shortest one; so only the quick exchanges count, and the drift is the slope
    of the bridge's time over the host's through them (least squares).
    """

    def __init__(self) -> None:
        self.round_trip = 0.0
        """s, the shortest of the last exchanges; 0 before the first"""
        self._exchanges: deque[tuple[float, float, float]] = deque(maxlen=KEPT)
        self._tick = (0.0, 0)

    @property
    def exchanges(self) -> int:
        """How many are remembered."""
        return len(self._exchanges)

    def add(self, sent: float, received: float, far: float, tick: int) -> None:
        """One exchange: S of the host when asked and answered, s of the bridge, its next tick."""
        middle = (sent + received) / 2.0
        self._exchanges.append((received - sent, middle, far))
        self.round_trip = min(trip for trip, _, _ in self._exchanges)
        self._tick = (middle, tick)

    @property
    def drift(self) -> float:
        """How much faster the bridge's clock goes than the host's, as a share; 0 while unknown."""
        table = np.array(self._exchanges).reshape(-1, 3)
        quick = table[table[:, 0] <= NEAR_BEST * self.round_trip]
        if len(quick) < 3 or np.ptp(quick[:, 1]) <= 0.0:
            return 0.0
        near, far = quick[:, 1] - quick[0, 1], quick[:, 2] - quick[0, 2]
        return float(np.polyfit(near, far, 1)[0] - 1.0)

    def playing(self, now: float, period: float) -> int:
        """The tick the bridge plays by now if it plays at full rate, counted from the last exchange."""
        asked, tick = self._tick
        return tick + int(np.ceil((now - asked) * (1.0 + self.drift) / period))
