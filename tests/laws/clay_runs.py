"""Programs of beads, played with overrides and holds on the simulated machine, measured by the millimetre."""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cdhr_host.extrusion import AirStage, ticks
from cdhr_host.job.changes import SHARES
from cdhr_host.motion.leg import FeedOverride
from cdhr_host.motion.playback import Pace, landing, ramp
from cdhr_host.motion.ramps import HISTORY, Ahead, choices, longest
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.course import Course, joined
from cdhr_host.pipeline.rig import Rig
from cdhr_host.pipeline.score import Part, Score
from cdhr_host.pipeline.tape import Tape
from cdhr_host.plant import Clay, Paste
from cdhr_host.units import MM, MM3

AREA = 11.16
"""mm² of the beads"""
CLAYS = ("earthenware", "porcelain", "stoneware")
PROFILES = {name: open_profile("paper-wide", name) for name in CLAYS}
RIGS = {name: Rig.from_profile(profile) for name, profile in PROFILES.items()}
CHUNK = 400
"""ticks handed on at a time"""
BUFFER = 125
"""ticks that are on their way when something changes"""


@dataclass(frozen=True)
class Change:
    """Something an operator does."""

    at: float
    """share of the plan"""
    rate: float
    """0 is a hold, from which the print goes on as it was"""


@dataclass(frozen=True)
class Printed:
    """N ticks of a print, and what came out."""

    nozzle: np.ndarray
    planned: np.ndarray
    command: np.ndarray
    deposited: np.ndarray
    period: float

    @property
    def speed(self):
        """(N,) m/s up to each tick"""
        return np.linalg.norm(np.diff(self.nozzle, axis=0, prepend=self.nozzle[:1]), axis=1) / self.period

    def by_millimetre(self):
        """mm³ planned and deposited on each mm of the way."""
        way = np.cumsum(self.speed) * self.period / MM
        place = np.floor(way + 1e-6).astype(int)
        volumes = [np.bincount(place, flow * self.period / MM3) for flow in (self.planned, self.deposited)]
        return volumes[0], volumes[1]


def program(beads, feed):
    """Each bead a list of points in mm; travels between."""
    lines = ["M83", f"G0 F3000 Z2.5 X{beads[0][0][0]:.3f} Y{beads[0][0][1]:.3f}"]
    for bead in beads:
        x, y = bead[0]
        lines.append(f"G0 X{x:.3f} Y{y:.3f} F3000")
        for end in bead[1:]:
            lines.append(f"G1 X{end[0]:.3f} Y{end[1]:.3f} E{AREA * math.dist((x, y), end):.4f} F{feed:g}")
            x, y = end
    return "\n".join([*lines, "G0 Z12 F3000"]).encode() + b"\n"


class Player:
    """Plays a program, its rows handed to the air's stage while they may still change."""

    def __init__(self, text, clay, factor=1.0, *, clean=True, paste=None):
        self.profile, rig = PROFILES[clay], RIGS[clay]
        self.period = self.profile.drives.period
        staircase = Staircase(self.profile, rig=rig)
        commands = list(staircase.commands([text]))
        override = FeedOverride(factor, rig.air.flow_max)
        self.course = Course(staircase.fork(override), Tape(iter(commands)))
        self.course.plan(10**9)
        self.end = self.course.stop().tick
        self.air, self.flow = rig.air, staircase.limits.flow
        self.awaited = ticks(rig.air.change_lead, self.period) if clean else 0
        self.stage = AirStage(rig.air, self.period)
        self.score = Score(self.course.staircase, (Part(0, self.course, Pace.of(rate=1.0)),))
        self.made, self.sent, self.asked = 0, [], None
        self.paste = paste or Paste.from_profile(self.profile)

    def play(self, changes):
        """All of it, with changes of pace on the way -> ``Printed``."""
        rate = 1.0
        for change in changes:
            now = self._tick_at(change.at)
            if now is None or self._ends_within(now):
                continue
            self._make(now + BUFFER + self.stage.lead)
            self._change(now, change.rate)
            if change.rate == 0.0:
                while not self._make(self.made + CHUNK):
                    pass
                self.sent.append(self.stage.flush())
                self._go_on(rate)
            else:
                rate = change.rate
        while not self._make(self.made + CHUNK):
            pass
        self.sent.append(self.stage.flush())
        return self._printed()

    def _tick_at(self, share):
        pace, last = self.score.last.pace, math.ceil(self.score.last.pace.settled)
        u = share * self.end
        if pace.target == 0.0 or pace.start(float(last)).u >= u:
            return None
        return last + math.ceil((u - pace.start(float(last)).u) / pace.target)

    def _ends_within(self, now):
        u = self.score.last.pace.start(float(now)).u
        return u + longest(self.profile) / self.period + BUFFER + self.stage.lead > self.end

    def _make(self, until):
        """Rows up to a tick; whether they end at rest."""
        stands = False
        while self.made < until and not stands:
            rows, _, stands = self.score.rows(self.made, min(self.made + CHUNK, until))
            self.made += len(rows)
            self.asked = joined([self.asked, rows]) if self.asked is not None else rows
            self.sent.append(self.stage.push(rows))
        return stands

    def _change(self, first, rate):
        """Another pace from a tick on, once the air can follow; what was made from there is replaced."""
        self._paced(first, first + self.awaited, rate)
        self.stage.restart(first)
        self.sent = [rows[rows.tick < first] for rows in self.sent]
        self.asked, self.made = self.asked[self.asked.tick < first], first

    def _go_on(self, rate):
        """From rest, once the air is ready."""
        self._paced(self.made - 1, self.made - 1 + ticks(self.air.start_lead, self.period), rate)

    def _paced(self, first, begin, rate):
        part = self.score.last

        def make(target, wait, lasting):
            shaped = landing if target == 1.0 else ramp
            return part.pace.then(shaped(part.pace.start(float(begin + wait)), lasting, target))

        now = part.pace.start(float(first))
        last = math.ceil(now.u + (longest(self.profile) + self.air.change_lead) / self.period)
        plan = part.course.rows(math.floor(now.u), min(last, self.end))
        before = self.asked[self.asked.tick < first][-HISTORY:]
        ahead = Ahead(plan, before, part.course.nozzle, self.profile, self.flow)
        targets = [rate if share == 1.0 else now.rate + share * (rate - now.rate) for share in SHARES]
        chosen = next(  # as ``job.changes`` does: part of the way where there is no room for all of it
            pace
            for target in (targets if rate else targets[:1])
            for pace in choices(ahead, partial(make, target), first, abs(target - now.rate))
        )
        self.score = self.score.with_part(Part(part.tick, part.course, chosen))

    def _printed(self):
        rows = joined([part for part in self.sent if part is not None and len(part)])
        if not (np.diff(rows.tick) == 1).all():
            raise AssertionError("rows are missing")
        clay = Clay(self.paste, self.period)
        _, _, deposited = clay.step(clay.standing(), rows.tick, rows.pressure)
        return Printed(rows.nozzle_G, rows.flow, rows.pressure, deposited, self.period)


def constant(printed, pressure, paste):
    """The same print with the valve at one pressure while clay is planned -> ``Printed``."""
    clay, command = Clay(paste, printed.period), np.where(printed.planned > 0.0, pressure, 0.0)
    _, _, deposited = clay.step(clay.standing(), np.arange(len(command)), command)
    return replace(printed, command=command, deposited=deposited)
