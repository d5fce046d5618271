"""Commands -> stretches: legs run without stopping, and stands between them."""

import math
from collections.abc import Iterable, Iterator
from functools import singledispatchmethod

import numpy as np

from cdhr_host.motion.arc import chords
from cdhr_host.motion.leg import LegPlanner, Segments
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.motion.sampling import Stand, Stretch, Timeline
from cdhr_host.values import Arc, Array, Command, Dwell, Ints, Moves, Notice, Pause, Prime, Stop, ToolTrack


class Planner:
    """One machine's motion: where the nozzle stands, and what is drawn but not settled yet.

    Feed it commands in program order; it yields the stretches that are settled. It starts
    at rest in ``at_G`` (3,) m, and every ``close`` leaves it at rest.
    """

    def __init__(self, limits: MotionLimits, at_G: Array) -> None:
        self._limits = limits
        self._leg = LegPlanner(limits)
        self._direction: Array | None = None
        self._at = np.array(at_G, dtype=float)
        self._line = 0

    @property
    def standing(self) -> Stand:
        """Where the nozzle stands after ``close``, for no time."""
        return Stand(self._at, 0.0, 0.0, self._line)

    def stretches(self, command: Command) -> Iterator[Stretch]:
        """Stretches that a further command settles."""
        yield from self._take(command)

    def close(self) -> Iterator[Stretch]:
        """Bring the current leg to rest."""
        leg = self._leg.plan(closes=True)
        self._leg = LegPlanner(self._limits)
        self._direction = None
        if leg is not None:
            yield leg

    @singledispatchmethod
    def _take(self, command: Command) -> Iterator[Stretch]:
        raise TypeError(f"no motion for {command!r}")

    @_take.register
    def _(self, command: Moves) -> Iterator[Stretch]:
        points = np.concatenate((command.start_G[None], command.end_G))
        return self._draw(points, command.line, command.speed, command.clay, command.air)

    @_take.register
    def _(self, command: Arc) -> Iterator[Stretch]:
        points = np.concatenate((command.start_G[None], chords(command, self._limits.half_width)))
        same = np.ones(len(points) - 1)
        clay = same * command.clay / len(same)
        line = np.full(len(same), command.line)
        return self._draw(points, line, same * command.speed, clay, same * command.air)

    @_take.register
    def _(self, command: Dwell) -> Iterator[Stretch]:
        return self._stand(command.duration, 0.0, command.line)

    @_take.register
    def _(self, command: Prime) -> Iterator[Stretch]:
        return self._stand(command.clay / command.flow, command.flow, command.line)

    @_take.register(Pause | Stop)
    def _(self, _: Pause | Stop) -> Iterator[Stretch]:
        return self.close()

    @_take.register
    def _(self, _: Notice) -> Iterator[Stretch]:
        return iter(())

    def _draw(self, points: Array, line: Ints, speed: Array, clay: Array, air: Array) -> Iterator[Stretch]:
        """Add segments to the leg; close it where a corner is too sharp."""
        steps = np.diff(points, axis=0)
        length = np.sqrt(np.einsum("nk,nk->n", steps, steps))
        keep = length > 0.0
        if not keep.any():
            return
        direction = steps[keep] / length[keep, None]
        points = np.concatenate((points[:1], points[1:][keep]))
        feed = np.minimum(speed[keep], self._limits.speed)
        drawn = Segments(points, line[keep], feed, clay[keep] / length[keep], air[keep])
        first = 0
        for corner in [*self._sharp(direction), len(drawn)]:
            if corner > first:
                self._leg.add(drawn.part(first, corner))
            if corner < len(drawn):
                yield from self.close()
            elif self._leg.due and (leg := self._leg.plan(closes=False)) is not None:
                yield leg
            first = corner
        self._direction = direction[-1]
        self._at, self._line = points[-1], int(line[-1])

    def _sharp(self, direction: Array) -> list[int]:
        """Segments that begin with a corner sharper than the stop angle."""
        before = direction[:1] if self._direction is None else self._direction[None]
        cosine = np.einsum("nk,nk->n", np.concatenate((before, direction[:-1])), direction)
        sharp = cosine < math.cos(self._limits.stop_angle)
        found: list[int] = np.flatnonzero(sharp).tolist()
        return found

    def _stand(self, duration: float, flow: float, line: int) -> Iterator[Stretch]:
        yield from self.close()
        self._line = line
        yield Stand(self._at, duration, flow, line)


def all_tracks(planner: Planner, timeline: Timeline, commands: Iterable[Command]) -> Iterator[ToolTrack]:
    """Every sample of a program, from rest to rest."""
    for command in commands:
        for stretch in planner.stretches(command):
            yield from timeline.lay(stretch).tracks()
    for stretch in planner.close():
        yield from timeline.lay(stretch).tracks()
    yield from timeline.rest(planner.standing).tracks()
