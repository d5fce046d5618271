"""Commands -> stretches: legs run without stopping, and stands between them."""

import copy
import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import singledispatchmethod

import numpy as np

from cdhr_host.motion.arc import chords
from cdhr_host.motion.curves import points_on
from cdhr_host.motion.leg import AS_PROGRAMMED, BATCH, FeedOverride, LegPlanner, Segments
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.sampling import Stand, Stretch, Timeline
from cdhr_host.motion.vectors import norms
from cdhr_host.values import (
    Arc,
    Array,
    Blend,
    Command,
    Dwell,
    Flags,
    Moves,
    Notice,
    Pause,
    Prime,
    Spline,
    Stop,
    ToolTrack,
)


class Planner:
    """One machine's motion: where the nozzle stands, and what is drawn but not settled yet.

    Feed it commands in program order; it yields the stretches that are settled. It starts
    at rest in ``at_G`` (3,) m, and every ``close`` leaves it at rest.
    """

    def __init__(self, limits: MotionLimits, at_G: Array) -> None:
        self._usual = self._limits = limits
        self._exact = False
        self.override = AS_PROGRAMMED
        self._number = 0
        self._leg = LegPlanner(limits)
        self._direction: Array | None = None
        self._clay = 0.0
        self._at = np.array(at_G, dtype=float)
        self._line = 0

    @property
    def standing(self) -> Stand:
        """Where the nozzle stands after ``close``, for no time."""
        return Stand(self._at, 0.0, 0.0, self._line, self._number)

    def moved_to(self, at_G: Array) -> "Planner":
        """A planner that takes corners as this one does, at rest in (3,) m, with nothing drawn."""
        moved = Planner(self._usual, at_G)
        moved._blend(self._limits, exact=self._exact)
        return moved

    def fork(self, override: FeedOverride = AS_PROGRAMMED) -> "Planner":
        """This planner as it is now, to be fed on apart from it, with another feed."""
        other = copy.copy(self)
        other.override, other._leg = override, self._leg.fork(override)
        return other

    def stretches(self, command: Command) -> Iterator[Stretch]:
        """Stretches that a further command settles."""
        yield from self._take(command)

    @property
    def drawn(self) -> float:
        """s, roughly, of the current leg that are not settled yet."""
        return self._leg.drawn

    def advance(self) -> Iterator[Stretch]:
        """What is settled of the current leg, however little was drawn since the last look."""
        leg = self._leg.plan(closes=False)
        if leg is not None:
            yield leg

    def close(self) -> Iterator[Stretch]:
        """Bring the current leg to rest."""
        leg = self._leg.plan(closes=True)
        self._number += 1
        self._leg = LegPlanner(self._limits, self._number, self.override)
        self._direction = None
        if leg is not None:
            yield leg

    @singledispatchmethod
    def _take(self, command: Command) -> Iterator[Stretch]:
        raise TypeError(f"no motion for {command!r}")

    @_take.register
    def _(self, command: Moves) -> Iterator[Stretch]:
        points = np.concatenate((command.start_G[None], command.end_G))
        steps = np.diff(points, axis=0)
        length = norms(steps)
        keep = length > 0.0
        if not keep.any():
            return iter(())
        drawn = Segments(
            np.concatenate((points[:1], points[1:][keep])),
            command.line[keep],
            command.speed[keep],
            command.clay[keep] / length[keep],
            command.air[keep],
            np.ones(int(keep.sum())),
        )
        return self._draw(drawn, np.full(len(drawn), self._exact))

    @_take.register
    def _(self, command: Arc) -> Iterator[Stretch]:
        return self._curve(command, chords(command, self._limits.half_width))

    @_take.register
    def _(self, command: Spline) -> Iterator[Stretch]:
        return self._curve(command, points_on(command, self._limits.half_width))

    @_take.register
    def _(self, command: Blend) -> Iterator[Stretch]:
        limits = self._usual if command.tolerance is None else self._usual.within(command.tolerance)
        if limits != self._limits or command.exact != self._exact:
            yield from self.close()
            self._blend(limits, exact=command.exact)

    @_take.register
    def _(self, command: Dwell) -> Iterator[Stretch]:
        return self._stand(command.duration, 0.0, command.line)

    @_take.register
    def _(self, command: Prime) -> Iterator[Stretch]:
        flow = min(command.flow, self._limits.flow.greatest / self.override.flow)
        return self._stand(command.clay / flow, flow, command.line)

    @_take.register(Pause | Stop)
    def _(self, _: Pause | Stop) -> Iterator[Stretch]:
        return self.close()

    @_take.register
    def _(self, _: Notice) -> Iterator[Stretch]:
        return iter(())

    def _blend(self, limits: MotionLimits, *, exact: bool) -> None:
        """Take corners so from here on; the nozzle is at rest."""
        self._limits, self._exact = limits, exact
        self._leg = LegPlanner(limits, self._number, self.override)

    def _curve(self, command: Arc | Spline, points: Array) -> Iterator[Stretch]:
        """Draw a curve through (M + 1, 3) m; clay is even along it."""
        steps = np.diff(points, axis=0)
        length = norms(steps)
        points = np.concatenate((points[:1], points[1:][length > 0.0]))
        count, whole = len(points) - 1, float(length.sum())
        for first in range(0, count, BATCH):
            part = points[first : first + BATCH + 1]
            same = np.ones(len(part) - 1)
            line = np.full(len(same), command.line)
            drawn = Segments(
                part, line, same * command.speed, same * command.clay / whole, same * command.air, same
            )
            stops = np.zeros(len(same), dtype=np.bool_)
            stops[0] = self._exact and first == 0
            yield from self._draw(drawn, stops)

    def _draw(self, drawn: Segments, stops: Flags) -> Iterator[Stretch]:
        """Add segments to the leg; close it before those in ``stops`` (M,), sharp corners, jumps of flow."""
        flow = self._limits.flow
        drawn, stops = self._eased(drawn, stops)
        drawn = replace(drawn, feed=flow.feed(np.minimum(drawn.feed, self._limits.speed), drawn.clay))
        steps = np.diff(drawn.points, axis=0)
        direction = steps / norms(steps)[:, None]
        stops = stops | self._sharp(direction) | flow.jumps(drawn.clay, self._clay)
        first = 0
        for corner in [*np.flatnonzero(stops).tolist(), len(drawn)]:
            if corner > first:
                self._leg.add(drawn.part(first, corner))
            if corner < len(drawn):
                yield from self.close()
            elif self._leg.due and (leg := self._leg.plan(closes=False)) is not None:
                yield leg
            first = corner
        self._direction, self._clay = direction[-1], float(drawn.clay[-1])
        self._at, self._line = drawn.points[-1], int(drawn.line[-1])

    def _eased(self, drawn: Segments, stops: Flags) -> tuple[Segments, Flags]:
        """Segments divided where the cables' forces leave less than the usual acceleration; (M,) stops."""
        limits = self._limits
        found = limits.room.along(drawn.points, limits.acceleration, limits.deviation)
        if found is None:
            return drawn, stops
        count, room = found
        divided = np.zeros(len(room), dtype=np.bool_)
        divided[np.cumsum(count) - count] = stops
        return drawn.divided(count, room), divided

    def _sharp(self, direction: Array) -> Flags:
        """(M,) whether a segment begins with a corner sharper than the stop angle."""
        before = direction[:1] if self._direction is None else self._direction[None]
        cosine = np.einsum("nk,nk->n", np.concatenate((before, direction[:-1])), direction)
        sharp: Flags = np.maximum(cosine, -1.0) < math.cos(self._limits.stop_angle)
        return sharp

    def _stand(self, duration: float, flow: float, line: int) -> Iterator[Stretch]:
        yield from self.close()
        self._line = line
        yield Stand(self._at, duration, flow, line, self._number)


def all_tracks(planner: Planner, timeline: Timeline, commands: Iterable[Command]) -> Iterator[ToolTrack]:
    """Every sample of a program, from rest to rest."""
    for command in commands:
        for stretch in planner.stretches(command):
            yield from timeline.lay(stretch).tracks()
    for stretch in planner.close():
        yield from timeline.lay(stretch).tracks()
    yield from timeline.rest(planner.standing).tracks()
