"""A leg: a stretch of path run without stopping, planned while it is still being drawn.

Segments are collected until there are enough to plan. What is planned is committed up to
the last border whose speed no further path can raise; the rest is planned again together
with what follows. So memory stays bounded however long a leg is, and the result does not
depend on when segments arrived.
"""

import copy
from dataclasses import dataclass

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.motion.budget import Bends
from cdhr_host.motion.cells import Cells, cells
from cdhr_host.motion.corner import Allowance, reaches
from cdhr_host.motion.flow import FlowLimits
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.look_ahead import border_speeds
from cdhr_host.motion.smooth_path import SmoothPath, norms, smooth
from cdhr_host.motion.time_law import TimeLaw, time_law
from cdhr_host.units import MM
from cdhr_host.values import Array, Flags, Ints

SHAPED = 3.0
"""half-widths from a path's end in which corners are rounded less, to leave room for the stop"""
BATCH = 4096
"""Segments collected before a plan is made."""
MORE_ROOM = 0.5
"""Of the way that braking to rest takes, kept in hand when a leg is committed."""


@dataclass(frozen=True, slots=True)
class FeedOverride:
    """A program run faster than it is written."""

    factor: float = 1.0
    """of every programmed speed, at least 1; slower is played, not planned (``motion.playback``)"""
    flow: float = 1.0
    """of the programmed flow, at least 1: what the air is to push"""


AS_PROGRAMMED = FeedOverride()


@dataclass(frozen=True, slots=True)
class Segments:
    """M drawn segments in a row, of positive length."""

    points: Array
    """(M+1, 3) m"""
    line: Ints
    """(M,) source line"""
    feed: Array
    """(M,) m/s"""
    clay: Array
    """(M,) m³ for each metre of path"""
    air: Array
    """(M,) Pa held by air words"""
    room: Array
    """(M,) share of the acceleration that the cables leave"""

    def __len__(self) -> int:
        return len(self.line)

    def wanted(self, override: "FeedOverride", flow: FlowLimits) -> Array:
        """(M,) m/s: the programmed speed, faster where the operator wants it and the air can follow."""
        if override == AS_PROGRAMMED:
            return self.feed
        return flow.feed(self.feed * override.factor, self.clay * override.flow)

    def part(self, first: int, last: int) -> "Segments":
        """Segments first to last - 1."""
        return Segments(
            self.points[first : last + 1],
            self.line[first:last],
            self.feed[first:last],
            self.clay[first:last],
            self.air[first:last],
            self.room[first:last],
        )

    def joined(self, other: "Segments") -> "Segments":
        """These, then the others, which begin where these end."""
        return Segments(
            np.concatenate((self.points, other.points[1:])),
            np.concatenate((self.line, other.line)),
            np.concatenate((self.feed, other.feed)),
            np.concatenate((self.clay, other.clay)),
            np.concatenate((self.air, other.air)),
            np.concatenate((self.room, other.room)),
        )

    def divided(self, count: Ints, room: Array) -> "Segments":
        """Each in (M,) equal parts in a row, with the room (sum(M),) of these."""
        whole = np.repeat(np.arange(len(self)), count)
        part = np.arange(len(whole)) - (np.cumsum(count) - count)[whole]
        start, way = self.points[:-1], np.diff(self.points, axis=0)
        begins = start[whole] + (part / count[whole])[:, None] * way[whole]
        points = np.concatenate((begins, self.points[-1:]))
        return Segments(points, self.line[whole], self.feed[whole], self.clay[whole], self.air[whole], room)


@dataclass(frozen=True, slots=True)
class Leg:
    """A committed stretch: its path, the time law along it, and what the segments carry."""

    path: SmoothPath
    bends: Bends
    """of each piece of the path"""
    law: TimeLaw
    segments: Segments
    number: int = 0
    """of the drawn leg, which may be committed in several stretches"""
    passed: float = 0.0
    """m of the drawn leg that lie before s = 0"""

    @property
    def duration(self) -> float:
        """s"""
        return self.law.duration


class LegPlanner:
    """Collects the segments of one leg and commits what is settled."""

    def __init__(self, limits: MotionLimits, number: int = 0, override: FeedOverride = AS_PROGRAMMED) -> None:
        self._limits = limits
        self._number = number
        self._override = override
        self._segments: Segments | None = None
        self._planned = 0
        self._first = 0.0
        self._entry = 0.0
        self._inside = False
        self._passed = 0.0

    def add(self, segments: Segments) -> None:
        """Draw on; the segments begin where the last ones ended."""
        self._segments = segments if self._segments is None else self._segments.joined(segments)

    def fork(self, override: FeedOverride) -> "LegPlanner":
        """This leg as it is now, to be planned on with another feed from its last border on."""
        other = copy.copy(self)
        other._override = override
        return other

    @property
    def drawn(self) -> float:
        """s that what is not committed would take at the feed asked for."""
        if self._segments is None:
            return 0.0
        lengths = norms(np.diff(self._segments.points, axis=0))
        return max(float((lengths / self._segments.feed).sum()), 0.0)

    @property
    def due(self) -> bool:
        """Whether enough has been drawn since the last plan to make another."""
        return self._segments is not None and len(self._segments) - self._planned >= BATCH

    def plan(self, *, closes: bool) -> Leg | None:
        """What can be committed; everything if the leg closes here. None if nothing is settled."""
        segments = self._segments
        if segments is None:
            return None
        h = self._limits.half_width
        allowed = self._allowed(segments)
        path = smooth(segments.points, h, passed=self._passed, closes=closes, allowed=allowed)
        self._planned = len(segments)
        last = float(norms(np.diff(segments.points[-2:], axis=0))[0])
        known = path.end if closes else path.end - max(SHAPED * h, last / 2)
        span = (self._first, float(known))
        if span[1] <= span[0]:
            return None
        feed, share = self._paces(segments)
        bends = Bends.of(path)
        found = cells(
            path,
            bends,
            feed[path.segment],
            span,
            self._limits,
            share=(share[path.segment], segments.room[path.segment]),
            passed=self._passed,
            long=(self._inside or self._first + self._passed == 0.0, closes),
        )
        speeds, forward = border_speeds(found, self._entry, 0.0)
        self._check_entry(speeds[0])
        count = len(found.start) if closes else _settled(found, speeds == forward)
        if count == 0:
            return None
        law = time_law(found.only(slice(count)), speeds[: count + 1])
        leg = Leg(path, bends, law, segments, self._number, self._passed)
        if not closes:
            self._advance(path, found, count, float(speeds[count]))
        return leg

    def _allowed(self, segments: Segments) -> Allowance:
        """As programmed, so that the path is the same with any feed."""
        limits = self._limits
        share = limits.flow.share(segments.feed, segments.clay, limits.acceleration)
        return Allowance(segments.feed, np.minimum(share, segments.room), limits.acceleration, limits.jerk)

    def _paces(self, segments: Segments) -> tuple[Array, Array]:
        """(M,) m/s wanted, (M,) share of acceleration and jerk that the air leaves for changing it."""
        limits = self._limits
        feed = segments.wanted(self._override, limits.flow)
        return feed, limits.flow.share(feed, segments.clay, limits.acceleration)

    def _advance(self, path: SmoothPath, found: Cells, count: int, speed: float) -> None:
        """Forget what is committed, but for the path the kernel still reaches back to."""
        segments = self._segments
        assert segments is not None
        border = float(found.start[count])
        drawn = path.drawn
        lengths = norms(np.diff(segments.points, axis=0))
        over = np.maximum.accumulate(drawn + reaches(lengths, self._limits.half_width))
        first = max(int(np.searchsorted(over, border, side="right")) - 1, 0)
        self._segments = segments.part(first, len(segments))
        self._planned = len(self._segments)
        self._first = border - drawn[first]
        self._passed += float(drawn[first])
        self._entry = speed
        self._inside = bool(found.bent[count])

    def _check_entry(self, speed: float) -> None:
        if speed < self._entry * (1 - 1e-9):
            assert self._segments is not None
            raise MotionError(
                Problem(
                    "unplannable",
                    f"cannot slow down from {self._entry / MM:.6g} to {speed / MM:.6g} mm/s in time",
                    line=int(self._segments.line[0]),
                    hint="please report this as a bug, with the program",
                )
            )


def _settled(found: Cells, final: Flags) -> int:
    """How many cells can be committed: up to a border whose speed nothing further can raise.

    Braking to rest begins at the last such border. What follows may instead end the leg in
    a slower cell, and slowing down to a third of a speed takes 9 % more way than to rest; so
    the border is taken that leaves MORE_ROOM beyond the way that rest would need. A straight after
    a corner that is braked into stays with that corner.
    """
    usable = np.flatnonzero(final[:-1] & (found.start < found.settled) & (found.pulls[0] == 0.0))
    if not len(usable):
        return 0
    room = np.concatenate(([0.0], np.cumsum(np.where(found.acceleration > 0.0, found.length, 0.0))))
    braking = room[-1] - room[usable[-1]]
    early = usable[room[usable] <= room[usable[-1]] - MORE_ROOM * braking]
    return int(early[-1]) if len(early) else 0
