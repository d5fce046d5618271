"""What a printer's words set going, and what follows when something has come to rest."""

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress

from cdhr_host.drives.clock import Clock
from cdhr_host.drives.link import LinkState
from cdhr_host.drives.rows import joined
from cdhr_host.errors import CdhrError, DriveError, JobError, MotionError, Problem
from cdhr_host.job.line_stream import LineStream
from cdhr_host.job.lines import Lines
from cdhr_host.job.player import Kind, Player, Rest
from cdhr_host.job.program import Program
from cdhr_host.job.reading import Count, Reader, Seen
from cdhr_host.job.recorder import Recorder
from cdhr_host.job.records import Records
from cdhr_host.job.recovery import Recovery, Resuming
from cdhr_host.job.states import MOVING, Word
from cdhr_host.job.surface import JobState, Status
from cdhr_host.job.telling import Telling
from cdhr_host.job.watchdogs import Alarm, Reaction
from cdhr_host.values import Feedback, Setpoints

LIFTS = (1.0, 0.5, 0.25)
"""of the profile's lift, tried in this order after an abort"""
UNFINISHED = MOVING | {JobState.HELD}
"""states in which a print is not over"""
Happen = Callable[[Word, str], None]


class Acts:
    """Everything here runs in the printer's thread, but for the checks and ``status``."""

    def __init__(
        self,
        player: Player,
        clock: Clock,
        telling: Telling,
        happened: Happen,
        recorder: Recorder | None = None,
    ) -> None:
        self.player = player
        self.records = Records(player, recorder, telling)
        self.message = ""
        self.fault: CdhrError | None = None
        self._clock = clock
        self._telling = telling
        self._happened = happened
        self._reader = Reader(player.profile)
        self._program: Program | None = None
        self._count: Count | None = None
        self._seen = Seen()
        self._over = False
        self._lines = Lines(player, clock, telling, happened)
        player.observers.append(self._executed)

    @property
    def busy(self) -> bool:
        """Whether the machine moves or is to move."""
        return self.player.busy or self._lines.idle or self.player.link.state is LinkState.STOPPING

    def status(self, state: JobState) -> Status:
        """As of the last turn."""
        player, count = self.player, self._count
        now = self._clock.now()
        progress = (
            count.progress(now, player.feed, over=state is JobState.DONE) if count else self._lines.progress()
        )
        return self._reader.status(
            state,
            self.message,
            self._seen,
            standing=player.standing,
            overrides=(player.feed, player.gain),
            homed=player.homed,
            referenced=player.referenced,
            buffered=player.feeder.buffered,
            progress=progress,
        )

    def forget(self) -> None:
        """Another program is on its way."""
        self._program = self._count = None

    def unload(self) -> None:
        """No program, and no clay on the bed."""
        self.forget()
        self.player.cleared()

    def proven(self, found: "Future[Program]") -> None:
        """A proof has ended."""
        try:
            program = found.result()
        except CdhrError as error:
            self._refused(error.problems, error.total)
            return
        if not program.proof.ok:
            self._refused(program.proof.problems, program.proof.total_problems)
            return
        for warning in program.proof.warnings:
            self._telling.add("message", warning.message, warning)
        self.adopt(program)

    def adopt(self, program: Program) -> None:
        """A program that can be printed."""
        self._program = program
        self._count = Count(program, self._clock.now())
        self._happened(Word.PROVEN, f"{program.file.name} can be printed")

    def check_start(self) -> None:
        """Raises JobError where no print can begin."""
        self.player.check_referenced()
        if not self.player.homed:
            self.player.refuse_start()
        self.check_busy()

    def check_busy(self) -> None:
        """Raises JobError while something moves."""
        if self.player.busy:
            raise JobError(Problem("busy", "the machine still moves", hint="wait until it stands"))

    def start(self) -> None:
        """Begin the program."""
        assert self._program is not None
        self._count = Count(self._program, self._clock.now())
        self.records.begin(self._program.file)
        self.player.print(self._program)

    def recover(self, recovery: Recovery, goes_on: str) -> None:
        """Take the program up in its middle, as if it had been held there."""
        program = self._program
        assert program is not None
        self._count = Count(program, self._clock.now(), line=recovery.line)
        self._count.plan = recovery.tick * self.player.profile.drives.period
        self.player.recover(Resuming(program, self.player.staircase.rig).aside(recovery.tick))
        self.records.begin(program.file, goes_on=goes_on, tick=recovery.tick)

    def open(self, name: str) -> LineStream:
        """Print what a client sends."""
        self.forget()
        return self._lines.open(name)

    def hold(self) -> None:
        """Come to rest on the path."""
        if self._lines.idle:
            self._happened(Word.RESTED, self.message)
        else:
            self.player.hold()

    def check_resume(self) -> None:
        """Raises JobError where a print cannot go on yet."""
        if self.player.kind not in {None, Kind.PROGRAM}:
            raise JobError(Problem("busy", "the machine still moves", hint="wait until it stands"))
        self._lines.check_resume()

    def resume(self) -> None:
        """Back to speed on the path."""
        player = self.player
        if self._lines.resumed():
            return
        try:
            returning = player.aside is not None and player.back()
        except MotionError as error:
            self._telling.add("problem", error.problems[0].message, error.problems[0])
            self._happened(Word.PAUSED, "the way back is not free: move the nozzle above the held place")
            return
        if not returning:
            self._go_on()

    def _go_on(self) -> None:
        """From rest on the path."""
        if self.player.aside is not None:
            self.player.take_up()
        self.records.hasten(self.player.feed)
        self.player.go_on()

    def abort(self) -> None:
        """Come to rest; the lift follows."""
        if self._lines.idle or self.player.aside is not None:
            self.player.leave()
        if self._lines.idle:
            self._lift()
        elif self.player.kind is Kind.PROGRAM:
            self.player.hold()

    def emergency_stop(self) -> None:
        """The link's own stop."""
        self.player.link.stop()

    def acknowledge(self) -> None:
        """A link that tripped is opened again; the machine stands where it is."""
        link = self.player.link
        if link.state is LinkState.FAULT:
            link.close()
        if link.state is LinkState.CLOSED:
            link.open()
        self.player.refer()
        self.player.over()
        self.records.acknowledged()

    def check_override(self, flow: float | None) -> None:
        """Raises JobError for more flow where what is to come is not known."""
        if flow is not None and flow > 1.0 and self._lines.progress() is not None:
            raise JobError(
                Problem(
                    "override",
                    f"a flow of {flow:.0%} is not possible while lines are printed as they come",
                    value=flow * 100,
                    limit=100,
                    unit="%",
                    hint="send M221 with the lines, or print a file",
                )
            )

    def override(self, feed: float | None, flow: float | None, state: JobState) -> None:
        """Other shares from now on."""
        self.records.hasten(max(feed or 0.0, self.player.feed))
        self.player.override(feed, flow, moving=state in {JobState.PRINTING, JobState.RESUMING})
        if feed is not None:
            self._lines.hasten(feed)
        told = [
            f"{what} {share:.0%}" for what, share in (("feed", feed), ("flow", flow)) if share is not None
        ]
        self._telling.add("override", ", ".join(told))

    def fail(self, error: CdhrError) -> None:
        """A fault: the machine comes to rest by its link, and stands until somebody has seen to it."""
        self.fault = error
        for problem in error.problems:
            self._telling.add("problem", problem.message, problem)
        self._happened(Word.FAIL, error.problems[0].message)
        with suppress(CdhrError):
            self.player.link.stop()
        self.player.give_up()

    def end(self, state: JobState) -> None:
        """Bring the machine to rest for good; a print that is left so has its black box."""
        with suppress(CdhrError):
            self.player.link.stop()
        self._collect_rest()
        while self.player.link.state is LinkState.STOPPING:
            self._clock.wait_until(self._clock.now() + self.player.profile.drives.period)
            self._collect_rest()
        if self.fault is not None:
            self.records.keep(self.fault.problems[0])
        elif state in UNFINISHED:
            self.records.keep(Problem("interrupted", self.message or f"ended while {state.value}"))
        self.records.end()

    def _collect_rest(self) -> None:
        """What a machine that is being stopped has executed; a further fault changes nothing."""
        with suppress(CdhrError):
            self.player.collect()

    def turn(self, state: JobState) -> None:
        """Feed, collect, and what follows from it."""
        if state is JobState.FAULT:
            self._lines.end()
            self._collect_rest()
            if self.player.link.state is not LinkState.STOPPING:
                known = self.fault.problems[0] if self.fault is not None else None
                self.records.keep(known or Problem("emergency-stop", self.message))
            return
        self._lines.turn(state)
        rest = self.player.turn()
        if (alarm := self.records.alarm(self._clock.now())) is not None:
            self._alarmed(alarm, state)
        if self._count is not None:
            self._count.plan = self.player.plan_time(self._count.plan)
        if rest is None:
            if state is JobState.RESUMING and self.player.up_to_speed:
                self._happened(Word.UP, "")
            elif state is JobState.STOPPING and self.player.kind is None:
                self._lift()
        elif rest.kind is Kind.PROGRAM:
            self._rested(rest, state)
        elif rest.kind is Kind.LIFT:
            self.player.over()
            self._aborted(self.message)
        elif rest.kind is Kind.BACK:
            self.player.over()
            if state is JobState.RESUMING:
                self._go_on()
            self._happened(Word.RESTED, self.message)

    def _alarmed(self, alarm: Alarm, state: JobState) -> None:
        """Raises DriveError for what must stop at once, whatever moves; holds a print for the rest."""
        if alarm.reaction is Reaction.STOP:
            raise DriveError(alarm.problem)
        if state not in {JobState.PRINTING, JobState.RESUMING}:
            return
        self._telling.add("problem", alarm.problem.message, alarm.problem)
        self._happened(Word.HOLD, alarm.problem.message)
        self.player.hold()

    def _rested(self, rest: Rest, state: JobState) -> None:
        """The program stands."""
        if rest.stop is not None and rest.stop.waits and state in {JobState.PRINTING, JobState.RESUMING}:
            self._lines.rested(rest.stop, state)
        elif rest.stop is not None and rest.stop.waits and state is JobState.HOLDING:
            self._happened(Word.RESTED, self.message)
        elif rest.stop is not None and rest.stop.waits and state is not JobState.STOPPING:
            return
        elif rest.stop is not None and rest.stop.pause is None and not rest.stop.waits:
            self.player.over()
            if state is JobState.STOPPING:
                self._aborted("")
            self._happened(Word.FINISHED, "")
        elif state is JobState.STOPPING:
            self._lift()
        elif rest.stop is not None and state in MOVING:
            assert rest.stop.pause is not None
            message = rest.stop.pause.message
            self._telling.add("pause", f"line {rest.stop.pause.line}: {message}")
            self._happened(Word.PAUSED, message)
        elif state is JobState.HOLDING:
            self._happened(Word.RESTED, self.message)

    def _lift(self) -> None:
        """After an abort: up and away from the clay, if that can be done."""
        self._lines.end()
        self.player.over()
        wanted = self.player.profile.job.lift
        height = self.player.lift([share * wanted for share in LIFTS]) if wanted else 0.0
        if not wanted:
            self._aborted(self.message)
        elif not height:
            text = "no way straight up is free: the nozzle stays where it stopped"
            self._telling.add("message", text)
            self._aborted(text)

    def _aborted(self, text: str) -> None:
        """At rest after an abort, lifted or not."""
        self._happened(Word.LIFTED, text)
        self.records.keep(Problem("abort", text or "aborted"))

    def _executed(self, rows: Setpoints, feedback: Feedback) -> None:
        before = self._seen.rows
        last = rows[-2:] if len(rows) > 1 or before is None else joined([before[-1:], rows])
        self._seen = Seen(last, feedback)
        if self.player.kind is Kind.PROGRAM and self._count is not None:
            layer = self._count.program.layer(self._count.line)
            self._count.add(rows, self.player.profile.drives.period)
            if (now := self._count.program.layer(self._count.line)) != layer:
                self._telling.add("layer", f"layer {now} of {len(self._count.program.proof.layers)}")

    def _refused(self, problems: tuple[Problem, ...], total: int) -> None:
        for problem in problems:
            self._telling.add("problem", problem.message, problem)
        self._happened(
            Word.REFUSED, f"refused: {problems[0].message}" + (f" and {total - 1} more" if total > 1 else "")
        )
