"""Time that passes when a test says so."""


class Stepped:
    """A clock; ``wait_until`` is what makes it go."""

    speed = 1.0

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """s"""
        return self._now

    def wait_until(self, when: float) -> None:
        """Never back."""
        self._now = max(self._now, when)
