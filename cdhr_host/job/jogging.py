"""Continuous motion on a lease: it goes on as long as it is asked for again and again.

The way is a straight one to the nearest limit of the machine, proven as a whole before it
moves; it ends at rest there. When the lease ends first, or another way is wanted, the machine
comes to rest on it as in a hold.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from cdhr_host.drives.clock import Clock
from cdhr_host.errors import Problem
from cdhr_host.job.player import Kind, Player
from cdhr_host.job.states import QUIET
from cdhr_host.job.surface import JobState
from cdhr_host.values import Array

LEASE: Final = 0.15
"""s of real time from the last wish until the stop has begun"""
NOTICE: Final = 0.02
"""s of it until a turn has seen it, and for the rows that cannot be replaced any more"""
ALIKE: Final = 1e-6
"""m/s between two wishes that are one"""


class Jogging:
    """One wish at a time; in the printer's thread."""

    def __init__(self, player: Player, clock: Clock, tell: Callable[[Problem], None]) -> None:
        """``tell`` hears the limit that ends a way."""
        self._player = player
        self._clock = clock
        self._tell = tell
        self._wish = np.zeros(3)
        self._going = np.zeros(3)
        self._until = 0.0
        self._limit: Problem | None = None
        self._against = np.zeros(3)
        """the wish that has met its limit already"""

    @property
    def busy(self) -> bool:
        """Whether something moves or is wished for."""
        return self._player.kind is Kind.JOG or self._wished

    def ask(self, velocity: Array) -> None:
        """(3,) m/s for another lease; zero ends it."""
        limit = self._player.profile.limits.speed_max
        speed = float(np.linalg.norm(velocity))
        self._wish = velocity if speed <= limit else velocity * (limit / speed)
        self._until = self._clock.now() + (LEASE - NOTICE) * max(min(self._clock.speed, 1e3), 1.0)

    def end(self) -> None:
        """Come to rest."""
        self._wish = np.zeros(3)

    def turn(self, state: JobState) -> None:
        """Begin, end, or come to the end of a way."""
        if self._clock.now() > self._until:
            self._wish = np.zeros(3)
        if not self._wish.any():
            self._against = np.zeros(3)
        player = self._player
        if player.kind is Kind.JOG:
            if not _alike(self._wish, self._going) and self._going.any():
                self._going = np.zeros(3)
                player.hold()
            if player.feeder.at_rest:
                self._rested()
        elif self._wished and state in QUIET and player.free:
            self._begin()

    @property
    def _wished(self) -> bool:
        return bool(self._wish.any()) and not _alike(self._wish, self._against)

    def _begin(self) -> None:
        speed = float(np.linalg.norm(self._wish))
        limit = self._player.jog(self._wish / speed, speed)
        if self._player.kind is Kind.JOG:
            self._going, self._limit = self._wish, limit
        else:
            self._meet(limit)

    def _rested(self) -> None:
        """The way has ended: at its limit, or before."""
        stop = self._player.feeder.stop
        self._player.over()
        if stop is not None and self._limit is not None and _alike(self._going, self._wish):
            self._meet(self._limit)
        self._going = np.zeros(3)

    def _meet(self, limit: Problem) -> None:
        self._against = self._wish
        self._tell(limit)


def _alike(one: Array, other: Array) -> bool:
    return bool(np.abs(one - other).max() <= ALIKE)
