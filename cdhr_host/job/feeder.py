"""What is played on a link: rows fed ahead, and rows executed taken back."""

import math
from typing import Final

import numpy as np

from cdhr_host.drives.link import LinkState, MachineLink
from cdhr_host.drives.rows import RowQueue, joined
from cdhr_host.errors import DriveError, Problem
from cdhr_host.job.echo import check_echo, expect_stop
from cdhr_host.job.making import CHUNK, Making
from cdhr_host.motion.playback import Pace
from cdhr_host.motion.ramps import HISTORY
from cdhr_host.pipeline.course import Course, Stop
from cdhr_host.pipeline.score import Gain, Part, Score
from cdhr_host.values import Array, Feedback, Setpoints

PLAYING: Final = frozenset({LinkState.ARMED, LinkState.RUNNING})
STOOD: Final = frozenset({LinkState.STOPPED, LinkState.FAULT, LinkState.CLOSED})
KEPT: Final = 64
"""ticks of the plan kept behind what was executed"""


class Feeder:
    """One link, and what is played on it."""

    def __init__(self, link: MachineLink) -> None:
        self.link = link
        self.making: Making | None = None
        self.next_tick = 0
        """the next to feed"""
        self.last: Setpoints | None = None
        """the last row executed"""
        self.slider: Array = np.zeros(6)
        """(6,) m, where the sliders stand or were commanded last"""
        self._sent = RowQueue()
        self._done: Setpoints | None = None
        self._tick: int | None = None
        """executed last since the link was armed"""
        self._stop_known = False

    @property
    def score(self) -> Score | None:
        """What is being played."""
        return self.making.score if self.making is not None else None

    @property
    def stop(self) -> Stop | None:
        """The stop of the plan at which it will stand, if that is one."""
        return self.making.stop if self.making is not None else None

    @property
    def standing(self) -> bool:
        """Whether the last row fed is at rest and nothing follows."""
        return self.making is None or self.making.done

    @property
    def buffered(self) -> int:
        """Ticks fed and not executed yet."""
        return len(self._sent)

    @property
    def at_rest(self) -> bool:
        """Whether all that was fed is executed and ends at rest."""
        return self.standing and not len(self._sent)

    @property
    def period(self) -> float:
        """s"""
        return self.link.profile.drives.period

    @property
    def settled(self) -> bool:
        """Whether what was executed last was at a constant pace, or at rest."""
        if self.score is None or self._tick is None:
            return True
        return self._tick >= self.score.last.pace.settled

    @property
    def plays(self) -> bool:
        """Whether the link takes rows and executes them."""
        return self.link.state in PLAYING

    def begin(self, course: Course, rate: float, gain: Gain) -> None:
        """Play a course from its first tick; the machine is at rest."""
        if self.arm():
            self.next_tick = course.first
        pace = Pace.of(tick=self.next_tick, u=course.first, rate=rate)
        score = Score(course.staircase, (Part(self.next_tick, course, pace),), gain)
        self.making = Making(score, self.next_tick)

    def arm(self) -> bool:
        """Have the link take rows from where the sliders stand; whether it did not yet."""
        if self.link.state not in (LinkState.OPEN, LinkState.STOPPED):
            return False
        self.link.arm(self.slider)
        self._sent.clear()
        self._done, self._tick, self._stop_known = None, None, False
        return True

    def end(self) -> None:
        """The machine is at rest and stays so."""
        self.link.stop()
        self.making = None

    def drop(self) -> None:
        """Nothing more is fed; what the link still plays is expected."""
        self.making = None

    def feed(self) -> None:
        """Feed what there is credit for."""
        while self.making is not None and (free := self.link.free) > 0:
            self.making.make(min(free, CHUNK))
            if not (count := min(len(self.making.ready), free)):
                return
            rows = self.making.ready.take(count)
            if self.link.feed(rows) < len(rows):
                raise DriveError(Problem("credit", "the link took fewer rows than it had room for"))
            self._sent.append(rows)
            self.next_tick += len(rows)

    def collect(self) -> list[tuple[Setpoints, Feedback]]:
        """What was executed since the last call, compared with what was fed."""
        feedback = self.link.feedback()
        self._stop_known = self._stop_known or expect_stop(self._sent, self.link)
        if not len(feedback):
            self._check_alive()
            return []
        if len(feedback) > len(self._sent):
            raise DriveError(Problem("echo", "the drives executed more rows than were sent"))
        rows = self._sent.take(len(feedback))
        check_echo(rows, feedback, self.link.resolution)
        self.last, self.slider, self._tick = rows[-1:], rows.slider[-1], int(rows.tick[-1])
        self._done = rows[-HISTORY:] if self._done is None else joined([self._done, rows])[-HISTORY:]
        self._forget(int(rows.tick[-1]))
        return [(rows, feedback)]

    def _check_alive(self) -> None:
        """Raises DriveError where the link has stopped for good while something is to be played."""
        if self.making is not None and self.link.state in STOOD:
            raise DriveError(
                Problem("stopped", "the drives came to rest by themselves and take no more setpoints")
            )

    @property
    def changeable(self) -> int:
        """The first tick that may still be changed."""
        return min(self.link.revisable, self.next_tick) if len(self._sent) else self.next_tick

    def revise(self, score: Score, first: int) -> None:
        """Play another score from a tick on, at the link too.

        Raises MotionError for rows the machine cannot do up to a constant pace, DriveError of
        kind ``late-revision``; nothing is changed then.
        """
        assert self.making is not None
        made = self.making.revised(score, first)
        room = self.link.free + self.next_tick - first
        made.make(min(max(self.next_tick - first, CHUNK), room))
        made.look(math.ceil(max(score.last.pace.settled, score.gain.settled)) + HISTORY + 1)
        if len(self._sent) and first < self.next_tick:
            rows = made.ready.take(min(len(made.ready), room))
            self.link.revise(rows)
            self._sent.cut(first - self._sent.first_tick())
            self._sent.append(rows)
            self.next_tick = first + len(rows)
        self.making = made

    def before(self, first: int) -> Setpoints | None:
        """The rows already fed before a tick, as many as a change's jerk sees; None if there are none."""
        parts = [] if self._done is None else [self._done]
        if len(self._sent):
            waiting = self._sent.take(len(self._sent))
            self._sent.put_back(waiting)
            parts.append(waiting[: max(first - int(waiting.tick[0]), 0)])
        return joined(parts)[-HISTORY:] if parts else None

    def place(self) -> tuple[Course, float, float] | None:
        """Course, time of its plan in ticks and rate of what was executed last."""
        if self.score is None or self._tick is None:
            return None
        return self.score.beat(self._tick)

    def _forget(self, tick: int) -> None:
        """Let go of what lies well before an executed tick."""
        if self.making is None:
            return
        self.making.score = self.making.score.since(tick - KEPT)
        for part in self.making.score.parts:
            part.course.drop(math.floor(part.pace.start(float(max(tick - KEPT, part.tick))).u) - KEPT)
