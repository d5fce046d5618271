"""The second reading of a proven file: into the drives, with pauses, progress and the run's log."""

import select
import sys
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cdhr_host.cli.interrupt import StopRequest
from cdhr_host.cli.keys import Keys
from cdhr_host.cli.progress import Progress
from cdhr_host.cli.refusals import say, writing
from cdhr_host.cli.source import Source

if TYPE_CHECKING:
    from cdhr_host.drives import Clock, MachineLink
    from cdhr_host.job import RunSummary
    from cdhr_host.job.closed_loop import Loop
    from cdhr_host.job.player import Observer
    from cdhr_host.job.printer import Printer
    from cdhr_host.job.program import Program
    from cdhr_host.job.recorder import Recorder
    from cdhr_host.job.recovery import Recovery
    from cdhr_host.job.surface import Event
    from cdhr_host.pipeline import Checked
    from cdhr_host.profile import Profile
    from cdhr_host.report.log import RunLog
    from cdhr_host.values import Command, Feedback, Pause, Setpoints

ANSWER_TIME = 0.1
"""s between two looks at a stop request while an operator is waited for"""


@dataclass(frozen=True, slots=True)
class Run:
    """What to run where."""

    source: Source
    machine: "Profile"
    program: "Program"
    link: "MachineLink"
    clock: "Clock"
    stop: StopRequest
    waits: bool
    """whether pauses wait for the operator"""
    recorder: "Recorder"
    loop: "Loop | None" = None
    """the simulated machine's control loop, where there is one"""
    recovery: "Recovery | None" = None
    """where it goes on; None for a fresh print"""
    goes_on: str = ""
    """the journal of the print it goes on with"""


class Stretches:
    """A program cut at its pauses; ``pause`` is the one that ended the last stretch, if any."""

    def __init__(self, steps: "Iterable[Command | Checked]") -> None:
        self._steps = iter(steps)
        self.pause: Pause | None = None

    def following(self) -> "Iterator[Setpoints]":
        """Setpoints up to the next pause or the end; raises MotionError like the proof would."""
        from cdhr_host.errors import MotionError
        from cdhr_host.pipeline import Checked
        from cdhr_host.values import Pause

        self.pause = None
        for step in self._steps:
            if isinstance(step, Pause):
                self.pause = step
                return
            if isinstance(step, Checked):
                if step.problems:
                    raise MotionError(step.problems)
                yield step.setpoints


def printed(run: Run, log: Path | None) -> "RunSummary":
    """Print the file; what was done stays in the log, however it ends."""
    run.source.still_the_same()
    with ExitStack() as stack:
        out = stack.enter_context(_kept(log, run)) if log else None
        progress = stack.enter_context(Progress("printing"))
        done = _ignored if out is None else out.add_run
        if run.loop is not None:
            return _in_a_loop(run, run.loop, done, _shown(run, progress))
        return _by_printer(run, done, progress, stack.enter_context(Keys()))


def _ignored(rows: "Setpoints", feedback: "Feedback") -> None:
    """No log is kept."""


def _by_printer(run: Run, done: "Observer", progress: Progress, keys: Keys) -> "RunSummary":
    """Have a printer do it, in this thread; raises what brought it to a fault, at rest."""
    from cdhr_host.job import Tally
    from cdhr_host.job.printer import Printer
    from cdhr_host.job.surface import JobState

    printer, tally = Printer(run.link, run.clock, recorder=run.recorder), Tally()
    printer.observe(tally.add)
    printer.observe(done)
    printer.listen(_told)
    try:
        printer.adopt(run.program)
        _begun(printer, run)
        while printer.state is not JobState.DONE and not _ended(printer, run, keys):
            printer.turn()
            _show(printer, progress, run.clock.speed)
            printer.wait()
    finally:
        printer.close()
    if printer.fault is not None:
        raise printer.fault
    interrupted = printer.state is not JobState.DONE
    return tally.summary(run.machine.drives.period, interrupted=interrupted, timing=run.link.timing())


def _show(printer: "Printer", progress: Progress, speed: float) -> None:
    """Where the print is in its plan, and what the machine does while it does not print."""
    from cdhr_host.job.surface import JobState

    if not progress.due or (done := (status := printer.status()).progress) is None:
        return
    parts = [] if status.state is JobState.PRINTING else [status.state.value]
    parts += [f"layer {done.layer}/{done.layers}"] if done.layers else []
    progress.show(done.fraction, "  ".join([*parts, f"line {done.line}"]), left=done.left / speed)


def _begun(printer: "Printer", run: Run) -> None:
    """At the beginning, or where an interrupted print goes on."""
    from cdhr_host.job.surface import JobState

    if run.recovery is None:
        printer.start()
        return
    printer.recover(run.recovery, goes_on=run.goes_on)
    printer.turn()
    if printer.state is JobState.HELD:  # otherwise the drives have tripped, which is told by the caller
        printer.resume()


def _ended(printer: "Printer", run: Run, keys: Keys) -> bool:
    """Whether nothing more is to be printed; asks for a hold, or goes on from one, where that is wished."""
    from cdhr_host.job.states import Word, can
    from cdhr_host.job.surface import JobState

    if printer.state is JobState.FAULT:
        return True
    if run.stop():
        if can(printer.state, Word.HOLD) and printer.state not in {JobState.HOLDING, JobState.HELD}:
            printer.hold("stopped on request")
        return printer.state is JobState.HELD
    keys.obey(printer)
    if printer.pause is None or printer.state is not JobState.HELD:
        return False
    return _ended_by_pause(printer, run)


def _ended_by_pause(printer: "Printer", run: Run) -> bool:
    """Go on from a pause, when the operator says so; True if that is never."""

    def stopped() -> bool:
        printer.turn()
        return run.stop()

    assert printer.pause is not None
    if run.waits and not _goes_on(printer.pause, stopped):
        return True
    printer.resume()
    return False


def _told(event: "Event") -> None:
    if event.kind in {"message", "override"}:
        say(f"cdhr: {event.text}")


def _in_a_loop(run: Run, loop: "Loop", done: "Observer", show: "Callable[[Setpoints], None]") -> "RunSummary":
    """Stretch after stretch through a simulated control loop, each from where the last came to rest."""
    import numpy as np

    from cdhr_host.job import stream
    from cdhr_host.job.closed_loop import closed_loop
    from cdhr_host.pipeline import Staircase
    from cdhr_host.report.run import joined

    program, start = Stretches(Staircase(run.machine).walk(run.source.chunks())), [np.zeros(6)]

    def note(rows: "Setpoints", feedback: "Feedback") -> None:
        start[0] = rows.slider[-1]
        show(rows)
        done(rows, feedback)

    summaries: list[RunSummary] = []
    while not summaries or not (summaries[-1].interrupted or program.pause is None):
        rows = closed_loop(program.following(), loop, run.machine, say)
        summary = stream(rows, run.link, run.clock, start=start[0], on_rows=note, should_stop=run.stop)
        if program.pause is not None and run.waits and not summary.interrupted:
            summary = replace(summary, interrupted=not _goes_on(program.pause, run.stop))
        summaries.append(summary)
    return joined(summaries)


def _goes_on(pause: "Pause", stop: "Callable[[], bool]") -> bool:
    """Wait for the operator: True for Enter, False for a stop request or the end of input."""
    message = f": {pause.message}" if pause.message else ""
    say(f"paused at line {pause.line}{message}\nEnter goes on, Ctrl-C ends")
    while not stop():
        if select.select([sys.stdin], [], [], ANSWER_TIME)[0]:
            return bool(sys.stdin.readline())
    return False


@contextmanager
def _kept(log: Path, run: Run) -> "Iterator[RunLog]":
    """A run log that is kept however the run ends: it is the machine's black box."""
    from cdhr_host.report.log import RunLog, about

    known = about(run.machine, run.source.name)
    with writing(log, "; the machine stopped on its path, air off"), RunLog(log, known) as out:
        try:
            yield out
        finally:
            out.keep()


def _shown(run: Run, progress: Progress) -> "Callable[[Setpoints], None]":
    """A function that shows where a run is, from the rows just executed."""
    layer_lines = [line for line, _ in run.program.proof.layers]
    duration = run.program.proof.duration

    def show(rows: "Setpoints") -> None:
        t, line = float(rows.t[-1]), int(rows.line[-1])
        layer = bisect_right(layer_lines, line)
        where = f"layer {layer}/{len(layer_lines)}  line {line}" if layer_lines else f"line {line}"
        fraction = min(1.0, t / duration) if duration else 1.0
        progress.show(fraction, where, left=(duration - t) / run.clock.speed)

    return show
