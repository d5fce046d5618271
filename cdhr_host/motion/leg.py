"""A leg: a stretch of path run without stopping, planned while it is still being drawn.

Segments are collected until there are enough to plan. What is planned is committed up to
the last border whose speed no further path can raise; the rest is planned again together
with what follows. So memory stays bounded however long a leg is. The path does not depend on
when segments arrived; the time law does by little, where turning holds the nozzle up (motion.hastened).
"""

import copy
import math
from dataclasses import dataclass, replace

import numpy as np

from cdhr_host.errors import MotionError, Problem
from cdhr_host.motion import approach, chords, corner
from cdhr_host.motion.beside import Allowance, way
from cdhr_host.motion.budget import Bends
from cdhr_host.motion.cells import TOUCHING, Cells, cells
from cdhr_host.motion.flow import FlowLimits
from cdhr_host.motion.hastened import hastened
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.look_ahead import border_speeds, stoppable
from cdhr_host.motion.nodes import Road
from cdhr_host.motion.smooth_path import SmoothPath, smooth
from cdhr_host.motion.time_law import TimeLaw, time_law
from cdhr_host.motion.vectors import norms
from cdhr_host.units import MM
from cdhr_host.values import Array, Ints

BATCH = 4096
"""Segments collected before a plan is made."""


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


@dataclass(frozen=True, slots=True)
class _Begin:
    """Where a leg goes on that is committed so far."""

    point: int = 0
    """the drawn point before it, of those that are not forgotten"""
    onwards: float = 0.0
    """m in s after the place of that point"""
    passed: float = 0.0
    """m in s since the leg's start"""
    dropped: float = 0.0
    """m, drawn, that are forgotten"""


class LegPlanner:
    """Collects the segments of one leg and commits what is settled."""

    def __init__(self, limits: MotionLimits, number: int = 0, override: FeedOverride = AS_PROGRAMMED) -> None:
        self._limits = limits
        self._number = number
        self._override = override
        self._segments: Segments | None = None
        self._planned = 0
        self._begin = _Begin()
        self._entry = 0.0
        self._inside = False

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
        begin, segments = self._begin, self._segments
        lengths = norms(np.diff(segments.points[begin.point :], axis=0))
        lasting = float((lengths / segments.feed[begin.point :]).sum())
        if len(lengths):
            lasting -= begin.onwards / float(segments.feed[begin.point])
        return max(lasting, 0.0)

    @property
    def due(self) -> bool:
        """Whether enough has been drawn since the last plan to make another."""
        return self._segments is not None and len(self._segments) - self._planned >= BATCH

    def plan(self, *, closes: bool) -> Leg | None:
        """What can be committed; everything if the leg closes here. None if nothing is settled."""
        segments = self._segments
        if segments is None:
            return None
        self._planned = len(segments)
        path, segments = self._path(segments, closes=closes)
        known = path.end if closes else path.known
        first = float(path.drawn[self._begin.point] + self._begin.onwards)
        passed = self._begin.passed - first
        span = (first, known)
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
            passed=passed,
            long=self._always_long(closes=closes),
        )
        if not closes:
            ends = found.start + found.length
            found = found.only(slice(int(np.searchsorted(ends, found.settled + TOUCHING, side="right"))))
        if not len(found.start):
            return None
        speeds, forward = border_speeds(found, self._entry, 0.0)
        slower = bool(speeds[0] < self._entry * (1 - 1e-9))
        if closes and slower:
            raise self._too_fast(speeds[0])
        count = len(found.start) if closes else 0 if slower else _settled(found, forward)
        if count == 0:
            return None
        settled, borders = found.only(slice(count)), speeds[: count + 1]
        allowed = np.minimum(feed, self._limits.speed)[path.segment] / path.steep
        road = Road(path, bends, allowed, segments.room[path.segment], self._limits)
        law = hastened(time_law(settled, borders), settled, borders, road)
        leg = Leg(path, bends, law, segments, self._number, passed)
        if not closes:
            self._advance(path, found, count, passed)
            self._entry = float(speeds[count])
        return leg

    def _always_long(self, *, closes: bool) -> tuple[float, float]:
        """m from both ends of what is planned in which a bend counts as long.

        It was begun earlier, or kernels become narrower there towards a stop.
        """
        narrow = 2 * self._limits.half_width
        first = narrow if self._begin.passed == 0.0 else 0.0 if self._inside else -math.inf
        return first, narrow if closes else -math.inf

    def _path(self, segments: Segments, *, closes: bool) -> tuple[SmoothPath, Segments]:
        """The smoothed path of what is not forgotten, and the segments as it follows them."""
        h, dropped = self._limits.half_width, self._begin.dropped
        points, moved = approach.straightened(segments.points, segments.feed, segments.clay > 0.0, h)
        allowed = self._allowed(segments)
        path = smooth(points, h, passed=dropped, closes=closes, allowed=allowed, moved=moved)
        return path, replace(segments, points=points)

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

    def _advance(self, path: SmoothPath, found: Cells, count: int, passed: float) -> None:
        """Forget what is committed, but for the path on which what follows depends."""
        segments, begin = self._segments, self._begin
        assert segments is not None
        border = float(found.start[count])
        drawn = np.concatenate(([0.0], np.cumsum(norms(np.diff(segments.points, axis=0)))))
        point = int(np.searchsorted(path.drawn, border, side="right")) - 1
        needed = drawn[point] - self._reach(float(segments.feed[: point + 1].max()))
        first = max(int(np.searchsorted(drawn, needed, side="right")) - 3, 0)
        self._segments = segments.part(first, len(segments))
        self._planned = len(self._segments)
        onwards, dropped = border - float(path.drawn[point]), begin.dropped + float(drawn[first])
        self._begin = _Begin(point - first, onwards, border + passed, dropped)
        self._inside = bool(found.bent[count])

    def _reach(self, speed: float) -> float:
        """m of path drawn before a place on which the path there depends, at speeds up to this.

        A corner whose rounding goes on there lies at most one room before. It depends on the corner before it
        where they share a straight, two rooms more, and that on what lies beside it, as far again, and once
        more if both may be a pair; a turn depends on where points were moved, a corner on those in its row,
        and how wide a kernel is on the turns around it.
        """
        limits = self._limits
        room = max(float(way(np.array(speed), limits.acceleration, limits.jerk)), 2 * limits.half_width)
        before = 2 * approach.reach(limits.half_width) + chords.reach(limits.half_width)
        before += 2 * corner.ROW * limits.half_width
        return 7 * room + before

    def _too_fast(self, speed: float) -> MotionError:
        assert self._segments is not None
        return MotionError(
            Problem(
                "unplannable",
                f"cannot slow down from {self._entry / MM:.6g} to {speed / MM:.6g} mm/s in time",
                line=int(self._segments.line[0]),
                hint="please report this as a bug, with the program",
            )
        )


def _settled(found: Cells, forward: Array) -> int:
    """How many cells can be committed: up to a border with way enough to brake, whatever follows."""
    apart = np.diff(found.together, prepend=-1) != 0
    usable = np.flatnonzero(stoppable(found, forward)[:-1] & (apart | (found.together < 0)))
    return int(usable[-1]) if len(usable) else 0
