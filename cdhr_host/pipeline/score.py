"""A score: which course is played at which pace, on the ticks of the drives.

What is played at tick t is the plan at u(t), all of it worked out anew: velocities and
accelerations are those of the played motion, and so are forces, sliders and flow. Where the
plan is played as it is, tick for tick, the rows are the dry run's. An input shaper works on
the ticks of the drives: its copies are delayed in time, not in the plan.
"""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from cdhr_host.errors import MotionError
from cdhr_host.motion.playback import Beat, Pace, played
from cdhr_host.motion.ramps import HISTORY
from cdhr_host.motion.sampling import mean
from cdhr_host.pipeline.course import Course, Stop, joined
from cdhr_host.pipeline.shift import played_shift
from cdhr_host.pipeline.staircase import Checked, Staircase
from cdhr_host.profile import Extruder
from cdhr_host.values import Array, Ints, Setpoints, ToolTrack


@dataclass(frozen=True, slots=True)
class Part:
    """From a tick of the drives on: a course, and how it is played."""

    tick: int
    course: Course
    pace: Pace


@dataclass(frozen=True, slots=True)
class Gain:
    """The operator's share of the flow, going linearly from one value to another."""

    before: float = 1.0
    after: float = 1.0
    begin: int = 0
    duration: int = 1
    """ticks"""

    def at(self, tick: Ints) -> Array:
        """(N,) ticks -> (N,)."""
        share: Array = np.clip((tick - self.begin) / self.duration, 0.0, 1.0)
        return self.before + share * (self.after - self.before)

    @property
    def settled(self) -> int:
        """Tick from which on it is constant."""
        return self.begin + self.duration if self.before != self.after else self.begin


@dataclass(frozen=True, slots=True)
class Prime:
    """Clay pushed while the nozzle stands, before a print goes on."""

    begin: int = 0
    """tick"""
    end: int = 0
    """the first tick after it"""
    flow: float = 0.0
    """m³/s"""

    def at(self, tick: Ints) -> Array:
        """(N,) ticks -> (N,) m³/s."""
        return np.where((tick >= self.begin) & (tick < self.end), self.flow, 0.0)


@dataclass(frozen=True, slots=True)
class Score:
    """What the machine plays; ``parts`` in order."""

    staircase: Staircase
    parts: tuple[Part, ...]
    gain: Gain = Gain()
    prime: Prime = Prime()

    @property
    def last(self) -> Part:
        """What is played in the end."""
        return self.parts[-1]

    def with_part(self, part: Part) -> "Score":
        """This score up to a part's tick, then the part."""
        return replace(self, parts=(*(each for each in self.parts if each.tick < part.tick), part))

    def alone(self, part: Part) -> "Score":
        """Nothing but a part, at the same share of the flow."""
        share = self.gain.after
        return Score(self.staircase, (part,), Gain(share, share))

    def since(self, tick: int) -> "Score":
        """Without what was over before a tick."""
        keep = [k for k, each in enumerate(self.parts) if each.tick <= tick]
        parts = self.parts[keep[-1] :] if keep else self.parts
        return replace(self, parts=tuple(replace(each, pace=each.pace.since(tick)) for each in parts))

    def part_at(self, tick: int) -> Part:
        """What is played at a tick."""
        return next((each for each in reversed(self.parts) if each.tick <= tick), self.parts[0])

    def beat(self, tick: int) -> tuple[Course, float, float]:
        """Course, time of its plan in ticks, and rate at a tick of the drives."""
        part = self.part_at(tick)
        start = part.pace.start(float(tick))
        return part.course, start.u, start.rate

    def before(self, tick: int) -> Setpoints | None:
        """The rows just before a tick, as many as a change's jerk sees; None at the beginning."""
        first = max(tick - HISTORY, self.parts[0].tick)
        return self.rows(first, tick)[0] if first < tick else None

    def rows(self, first: int, last: int) -> tuple[Setpoints, Stop | None, bool]:
        """Rows of ticks first to last - 1 at most, the stop they reach, and whether they end at rest.

        They end where the plan must stand, where the pace has come to rest, and with a part.
        Raises MotionError for what the machine cannot do.
        """
        part = self.part_at(first)
        after = [each.tick for each in self.parts if each.tick > first]
        last = min([last, *after])
        rests = part.pace.target == 0.0 and not after
        if rests:
            last = max(min(last, math.ceil(part.pace.settled) + 2), first)
        tick = np.arange(first, last)
        beat = part.pace.at(tick.astype(np.float64))
        part.course.plan(math.ceil(beat.u[-1] if len(tick) else 0.0) + 1)
        stop = part.course.stop()
        stands = rests and last >= math.ceil(part.pace.settled) + 2
        reached = stop is not None and len(tick) > 0 and beat.u[-1] >= stop.tick - 1
        if stop is not None and reached:
            count = int(np.searchsorted(beat.u, stop.tick - 1)) + 1
            tick, beat = tick[:count], _standing(Beat(*(each[:count] for each in beat)), stop)
        rows = self._sampled(part, tick, beat)
        return rows, stop if reached else None, stands or reached

    def _sampled(self, part: Part, tick: Ints, beat: Beat) -> Setpoints:
        """The rows of a part."""
        seen = (
            int(tick[0]) - math.ceil(self.staircase.shaper.length / self.staircase.period) if len(tick) else 0
        )
        steady = self.gain.after == 1.0 and len(tick) > 0 and self.gain.settled <= tick[0]
        if steady and part.pace.whole(seen) and (seen >= part.tick or part is self.parts[0]):
            first = round(float(beat.u[0]))
            return renumbered(part.course.rows(first, first + len(tick)), tick, self.staircase.period)
        checked = [
            self._run(part, tick[run], Beat(*(each[run] for each in beat))) for run in _runs(part, beat)
        ]
        problems = [problem for each in checked for problem in each.problems]
        if problems:
            raise MotionError(problems)
        return joined([each.setpoints for each in checked])

    def _run(self, part: Part, tick: Ints, beat: Beat) -> Checked:
        """Ticks that all fall on shifts, or all beside them."""
        shift = part.course.shift_at(float(beat.u[0]))
        if shift is not None:
            return self.staircase.afresh().shifted(played_shift(shift, tick, beat, self.staircase.period))
        shaper = self.staircase.shaper
        copies = [self._copy(tick, delay / self.staircase.period, part, beat) for delay in shaper.delay]
        track = copies[0] if len(copies) == 1 else mean(copies, shaper)
        return self.staircase.afresh().checked(self._pushed(track))

    def _copy(self, tick: Ints, delay: float, part: Part, beat: Beat) -> ToolTrack:
        """The nozzle a while ago, unshaped."""
        period, extruder = self.staircase.period, self.staircase.profile.extruder
        if delay == 0.0:
            return held_air(played(part.course.unshaped(tick, beat.u), beat, period), beat.rate, extruder)
        tracks, when = [], tick - delay
        owner = np.searchsorted([each.tick for each in self.parts[1:]], when, side="right")
        for k, each in enumerate(self.parts):
            mine = owner == k
            if mine.any():
                then = _standing(each.pace.at(when[mine]), each.course.stop())
                track = played(each.course.unshaped(tick[mine], then.u), then, period)
                tracks.append(held_air(track, then.rate, extruder))
        return ToolTrack.joined(tracks)

    def _pushed(self, track: ToolTrack) -> ToolTrack:
        """With the operator's share of the flow, and what is primed."""
        gain, prime = self.gain.at(track.tick), self.prime.at(track.tick)
        if np.all(gain == 1.0) and not prime.any():
            return track
        return held_air(
            replace(track, flow=gain * (track.flow + prime)), gain, self.staircase.profile.extruder
        )


def held_air(track: ToolTrack, share: Array, extruder: Extruder) -> ToolTrack:
    """Air held by air words, for a share (N,) of its flow; 0 where there is none."""
    if not track.air.any():
        return track
    over = np.maximum(track.air - extruder.pressure_threshold, 0.0)
    air = np.minimum(track.air, extruder.pressure_threshold) + share * over
    return replace(track, air=np.where((share > 0.0) & (track.air > 0.0), air, 0.0))


def renumbered(rows: Setpoints, tick: Ints, period: float) -> Setpoints:
    """Rows of a plan on other ticks."""
    if len(rows) and rows.tick[0] == tick[0]:
        return rows
    return replace(rows, tick=tick, t=(tick * period).astype(np.float64))


def _standing(beat: Beat, stop: Stop | None) -> Beat:
    """No further than the stop, where the plan stands."""
    if stop is None:
        return beat
    there = beat.u >= stop.tick - 1
    return Beat(
        np.minimum(beat.u, stop.tick - 1.0),
        np.where(there, 0.0, beat.rate),
        np.where(there, 0.0, beat.slope),
    )


def _runs(part: Part, beat: Beat) -> list[slice]:
    """Ticks cut where shifts begin and end."""
    edges = part.course.shift_edges()
    cuts = sorted({0, len(beat.u), *np.searchsorted(beat.u, edges).tolist()})
    return [slice(a, b) for a, b in pairwise(cuts)]
