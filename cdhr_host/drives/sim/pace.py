"""How fast a bridge plays what it has stored, in whole numbers with 16 fraction bits; docs/link.md."""

from collections import deque
from typing import Final

ONE: Final = 65536


def eased(step: int, ramp: int) -> int:
    """3 z² - 2 z³ with z = step / ramp."""
    z = step * ONE // ramp
    squared = z * z >> 16
    return 3 * squared - 2 * (squared * z >> 16)


class Pace:
    """Playback rate, now and during a change of it."""

    def __init__(self) -> None:
        self.rate = ONE
        self.target = ONE
        self._steps: deque[tuple[int, int]] = deque()

    @property
    def steady(self) -> bool:
        """Whether the rate is what was asked."""
        return not self._steps

    def change(self, permille: int, ramp: int, fraction: int) -> None:
        """Ramp to a rate; one to 1000 takes up to a tick more, spread, so that it ends on a stored tick."""
        self.target = permille * ONE // 1000
        start, change = self.rate, self.target - self.rate
        rates = [start + (change * eased(n, ramp) >> 16) for n in range(1, ramp + 1)]
        missing = -(fraction + sum(rates)) % ONE if self.target == ONE else 0
        spread = [missing * n // ramp - missing * (n - 1) // ramp for n in range(1, ramp + 1)]
        self._steps = deque(zip(rates, spread, strict=True))

    def step(self) -> int:
        """How far playback time goes until the next output."""
        if not self._steps:
            return self.rate
        self.rate, more = self._steps.popleft()
        return self.rate + more
