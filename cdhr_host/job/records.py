"""What a printer has recorded, where it has a recorder at all."""

from contextlib import suppress

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.player import Kind, Player
from cdhr_host.job.program import ProgramFile
from cdhr_host.job.recorder import Plan, Recorder
from cdhr_host.job.surface import Event, JobState
from cdhr_host.job.telling import Telling
from cdhr_host.job.watchdogs import Alarm
from cdhr_host.values import Feedback, Setpoints


class Records:
    """Between a player, what is told, and a recorder; everything from the printer's thread."""

    def __init__(self, player: Player, recorder: Recorder | None, telling: Telling) -> None:
        self._player = player
        self._recorder = recorder
        self._telling = telling
        self._kept = False
        self._alarm: Alarm | None = None
        if recorder is not None:
            player.observers.append(self._executed)
            telling.listen(self._heard)

    def begin(self, file: ProgramFile, *, goes_on: str = "", tick: float = 0.0) -> None:
        """A print begins. Raises JobError where no journal can be written."""
        self._kept = False
        if self._recorder is not None:
            self._recorder.begin(file, goes_on=goes_on, tick=tick)

    def alarm(self, now: float) -> Alarm | None:
        """What a watchdog has found since the last call."""
        if self._recorder is None:
            return None
        found, self._alarm = self._alarm, None
        feeder = self._player.feeder
        waiting = feeder.link.free > 0 and not feeder.standing
        return found or self._recorder.look(now, feeder.next_tick, waiting=waiting)

    def hasten(self, feed: float) -> None:
        """The program is about to be played at another feed: a crash must find that written."""
        plan, last = self._plan(), self._player.feeder.last
        if self._recorder is not None and plan is not None and last is not None:
            fed = plan.executed + (plan.fed - plan.executed) * max(feed, 1.0)
            self._recorder.expect(int(last.line[-1]), Plan(plan.executed, fed, feed))

    def keep(self, why: Problem) -> None:
        """Write the black box, once until ``acknowledged``."""
        if self._recorder is None or self._kept:
            return
        self._kept = True
        try:
            path = self._recorder.keep(why)
        except JobError as error:
            self._telling.add("problem", error.problems[0].message, error.problems[0])
            return
        self._telling.add("message", f"the last minute is in {path}: cdhr plot draws it")

    def acknowledged(self) -> None:
        """The next fault has a black box of its own; what was found before is over."""
        self._kept, self._alarm = False, None
        if self._recorder is not None:
            self._recorder.rearm()

    def end(self) -> None:
        """Nothing more will be recorded."""
        if self._recorder is not None:
            self._recorder.end()

    def _executed(self, rows: Setpoints, feedback: Feedback) -> None:
        assert self._recorder is not None
        alarm = self._recorder.executed(rows, feedback, self._plan())
        self._alarm = self._alarm or alarm

    def _plan(self) -> Plan | None:
        """Where in the program the machine is, and how far what the link may hold could bring it."""
        player = self._player
        stopped = player.link.stop_tick is not None  # what a link plays then is not the plan's
        if stopped or player.kind is not Kind.PROGRAM or (now := player.feeds.plan_time()) is None:
            return None
        held = player.link.free + player.feeder.buffered
        steady = player.feeder.settled and player.feeds.right
        pace = 0.0 if steady and player.feed <= 1.0 else player.feed
        return Plan(now, now + held * max(player.feed, 1.0), pace, steady and player.gain <= 1.0)

    def _heard(self, event: Event) -> None:
        assert self._recorder is not None
        if event.kind != "state":
            self._recorder.event(event.kind, event.text)
            return
        state = event.status.state.value
        with suppress(JobError):  # a full disk has an alarm of its own, and must not end the telling
            self._recorder.turned(state, "" if event.text == state else event.text)
        if event.status.state is JobState.DONE:
            self._recorder.end()
