"""Commands -> the nozzle over time, on the drives' ticks."""

import math
from collections.abc import Iterable, Iterator
from functools import singledispatchmethod

import numpy as np

from cdhr_host.motion.arc import chords
from cdhr_host.motion.leg import Leg, LegPlanner, Segments
from cdhr_host.motion.limits import MotionLimits
from cdhr_host.values import Arc, Array, Command, Dwell, Ints, Moves, Notice, Pause, Prime, Stop, ToolTrack

BLOCK = 4096
"""Samples handed on at a time."""
EARLY = 1e-9
"""Share of a period by which a tick may come early through rounding."""


class Planner:
    """One machine's motion: where the nozzle stands, when, and at which tick.

    Feed it commands in program order; it yields samples up to the time that is settled. It
    starts at rest in ``at_G`` (3,) m, and every ``finish`` leaves it at rest on a tick.
    """

    def __init__(self, limits: MotionLimits, period: float, at_G: Array) -> None:
        self._limits = limits
        self._period = period
        self._leg = LegPlanner(limits)
        self._direction: Array | None = None
        self._at = np.array(at_G, dtype=float)
        self._line = 0
        self._time = 0.0
        self._tick = 0

    def tracks(self, command: Command) -> Iterator[ToolTrack]:
        """Samples that a further command settles."""
        yield from self._take(command)

    def finish(self) -> Iterator[ToolTrack]:
        """Come to rest, up to and with the first tick at which the nozzle stands."""
        yield from self._close()
        ticks = math.ceil(self._time / self._period - EARLY) + 1 - self._tick
        yield from self._stand(max(ticks, 1) * self._period, 0.0, self._line)
        self._time = (self._tick - 1) * self._period

    @singledispatchmethod
    def _take(self, command: Command) -> Iterator[ToolTrack]:
        raise TypeError(f"no motion for {command!r}")

    @_take.register
    def _(self, command: Moves) -> Iterator[ToolTrack]:
        points = np.concatenate((command.start_G[None], command.end_G))
        return self._draw(points, command.line, command.speed, command.clay, command.air)

    @_take.register
    def _(self, command: Arc) -> Iterator[ToolTrack]:
        points = np.concatenate((command.start_G[None], chords(command, self._limits.half_width)))
        same = np.ones(len(points) - 1)
        clay = same * command.clay / len(same)
        line = np.full(len(same), command.line)
        return self._draw(points, line, same * command.speed, clay, same * command.air)

    @_take.register
    def _(self, command: Dwell) -> Iterator[ToolTrack]:
        yield from self._close()
        yield from self._stand(command.duration, 0.0, command.line)

    @_take.register
    def _(self, command: Prime) -> Iterator[ToolTrack]:
        yield from self._close()
        yield from self._stand(command.clay / command.flow, command.flow, command.line)

    @_take.register(Pause | Stop)
    def _(self, _: Pause | Stop) -> Iterator[ToolTrack]:
        return self._close()

    @_take.register
    def _(self, _: Notice) -> Iterator[ToolTrack]:
        return iter(())

    def _draw(self, points: Array, line: Ints, speed: Array, clay: Array, air: Array) -> Iterator[ToolTrack]:
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
                yield from self._close()
            elif self._leg.due:
                yield from self._commit(self._leg.plan(closes=False))
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

    def _close(self) -> Iterator[ToolTrack]:
        """Bring the current leg to rest."""
        yield from self._commit(self._leg.plan(closes=True))
        self._leg = LegPlanner(self._limits)
        self._direction = None

    def _commit(self, leg: Leg | None) -> Iterator[ToolTrack]:
        """Samples of a committed leg."""
        if leg is None:
            return
        for tick in self._ticks(leg.duration):
            t = np.clip(tick * self._period - self._time, 0.0, leg.duration)
            yield _sampled(leg, tick, t)
        self._time += leg.duration

    def _stand(self, duration: float, flow: float, line: int) -> Iterator[ToolTrack]:
        """Samples of standing still."""
        for tick in self._ticks(duration):
            still = np.zeros((len(tick), 3))
            nothing = np.zeros(len(tick))
            lines = np.full(len(tick), line)
            yield ToolTrack(tick, lines, still + self._at, still, still.copy(), nothing + flow, nothing)
        self._time += duration
        self._line = line

    def _ticks(self, duration: float) -> Iterator[Ints]:
        """Ticks from the next one on that fall before the end of a duration, in blocks."""
        end = math.ceil((self._time + duration) / self._period - EARLY)
        while self._tick < end:
            block = np.arange(self._tick, min(self._tick + BLOCK, end))
            self._tick = int(block[-1]) + 1
            yield block


def _sampled(leg: Leg, tick: Ints, t: Array) -> ToolTrack:
    """The nozzle at times t (N,) s since the leg began."""
    s, rate, change = leg.law.at(t)
    piece, position, slope, bend = leg.path.at(s)
    velocity = slope * rate[:, None]
    acceleration = bend * (rate**2)[:, None] + slope * change[:, None]
    segment = leg.path.segment[piece]
    speed = np.sqrt(np.einsum("nk,nk->n", velocity, velocity))
    carried = leg.segments
    air = np.where(speed > 0.0, carried.air[segment], 0.0)
    flow = carried.clay[segment] * speed
    return ToolTrack(tick, carried.line[segment], position, velocity, acceleration, flow, air)


def all_tracks(planner: Planner, commands: Iterable[Command]) -> Iterator[ToolTrack]:
    """Every sample of a program, from rest to rest."""
    for command in commands:
        yield from planner.tracks(command)
    yield from planner.finish()
