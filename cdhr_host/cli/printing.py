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
from cdhr_host.cli.progress import Progress
from cdhr_host.cli.refusals import say, writing
from cdhr_host.cli.source import Source

if TYPE_CHECKING:
    from cdhr_host.drives import Clock, MachineLink
    from cdhr_host.job import RunSummary
    from cdhr_host.job.closed_loop import Loop
    from cdhr_host.pipeline import Checked, Proof
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
    proof: "Proof"
    link: "MachineLink"
    clock: "Clock"
    stop: StopRequest
    waits: bool
    """whether pauses wait for the operator"""
    loop: "Loop | None" = None
    """the simulated machine's control loop, where there is one"""


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
    from cdhr_host.pipeline import Staircase
    from cdhr_host.report.run import joined

    run.source.still_the_same()
    with ExitStack() as stack:
        out = stack.enter_context(_kept(log)) if log else None
        show = _shown(run, stack.enter_context(Progress("printing")))

        def done(rows: "Setpoints", feedback: "Feedback") -> None:
            show(rows)
            if out is not None:
                out.add_run(rows, feedback)

        program = Stretches(Staircase(run.machine).walk(run.source.chunks()))
        return joined(list(_stretches(run, program, done)))


def _stretches(
    run: Run, program: Stretches, done: "Callable[[Setpoints, Feedback], None]"
) -> "Iterator[RunSummary]":
    """Run stretch after stretch, each from where the one before it came to rest."""
    import numpy as np

    from cdhr_host.job import stream
    from cdhr_host.job.closed_loop import closed_loop

    start = np.zeros(6)

    def note(rows: "Setpoints", feedback: "Feedback") -> None:
        nonlocal start
        start = rows.slider[-1]
        done(rows, feedback)

    while True:
        rows = program.following()
        if run.loop is not None:
            rows = closed_loop(rows, run.loop, run.machine, say)
        summary = stream(rows, run.link, run.clock, start=start, on_rows=note, should_stop=run.stop)
        over = summary.interrupted or program.pause is None
        if not over and program.pause is not None and run.waits and not _goes_on(program.pause, run.stop):
            over, summary = True, replace(summary, interrupted=True)
        yield summary
        if over:
            return


def _goes_on(pause: "Pause", stop: StopRequest) -> bool:
    """Wait for the operator: True for Enter, False for a stop request or the end of input."""
    message = f": {pause.message}" if pause.message else ""
    say(f"paused at line {pause.line}{message}\nEnter goes on, Ctrl-C ends")
    while not stop():
        if select.select([sys.stdin], [], [], ANSWER_TIME)[0]:
            return bool(sys.stdin.readline())
    return False


@contextmanager
def _kept(log: Path) -> "Iterator[RunLog]":
    """A run log that is kept however the run ends: it is the machine's black box."""
    from cdhr_host.report.log import RunLog

    with writing(log, "; the machine stopped on its path, air off"), RunLog(log) as out:
        try:
            yield out
        finally:
            out.keep()


def _shown(run: Run, progress: Progress) -> "Callable[[Setpoints], None]":
    """A function that shows where a run is, from the rows just executed."""
    layer_lines = [line for line, _ in run.proof.layers]
    duration = run.proof.duration

    def show(rows: "Setpoints") -> None:
        t, line = float(rows.t[-1]), int(rows.line[-1])
        layer = bisect_right(layer_lines, line)
        where = f"layer {layer}/{len(layer_lines)}  line {line}" if layer_lines else f"line {line}"
        fraction = min(1.0, t / duration) if duration else 1.0
        progress.show(fraction, where, left=(duration - t) / run.clock.speed)

    return show
