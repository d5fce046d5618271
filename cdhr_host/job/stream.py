"""Streaming: setpoints into a link within its credit, feedback out of it."""

from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np

from cdhr_host.drives.clock import Clock
from cdhr_host.drives.link import LinkState, MachineLink
from cdhr_host.drives.rows import RowQueue
from cdhr_host.errors import DriveError, JobError, Problem
from cdhr_host.job.echo import check_echo, expect_stop
from cdhr_host.job.tally import RunSummary, Tally
from cdhr_host.job.waiting import wait_for_credit
from cdhr_host.motion.hold import ends_at_rest
from cdhr_host.values import Array, Feedback, Setpoints

Observer = Callable[[Setpoints, Feedback], None]


def _ignore(rows: Setpoints, feedback: Feedback) -> None:
    """Observe nothing."""


def _never() -> bool:
    return False


def stream(
    setpoints: Iterator[Setpoints],
    link: MachineLink,
    clock: Clock,
    *,
    start: Array,
    on_rows: Observer = _ignore,
    should_stop: Callable[[], bool] = _never,
) -> RunSummary:
    """Arm an open link at (6,) m ``start``, run all setpoints, leave it stopped at rest.

    ``on_rows`` gets each executed batch, setpoints and feedback aligned row by row, the rows
    of a stop included. ``should_stop`` is asked at least every 50 ms; once true the machine
    comes to rest on the path and the summary says ``interrupted``. Raises DriveError from
    the link or when the far side did not get what was sent, JobError when the setpoints end
    while moving, and whatever the generator or the observer raises; always at rest, air off.
    """
    return Streamer(setpoints, link, clock, start=start, on_rows=on_rows, should_stop=should_stop).run()


class Streamer:
    """One run; see ``stream``."""

    def __init__(
        self,
        setpoints: Iterator[Setpoints],
        link: MachineLink,
        clock: Clock,
        *,
        start: Array,
        on_rows: Observer = _ignore,
        should_stop: Callable[[], bool] = _never,
    ) -> None:
        self._setpoints = setpoints
        self._link = link
        self._clock = clock
        self._start = start
        self._on_rows = on_rows
        self._should_stop = should_stop
        self._pending: Setpoints | None = None
        self._exhausted = False
        self._sent = RowQueue()
        self._tail = np.stack([start, start])
        self._silent = True
        self._interrupted = False
        self._stop_known = False
        self._tally = Tally()

    def run(self) -> RunSummary:
        """Run to the end."""
        self._link.arm(self._start)
        try:
            while not self._turn():
                wait_for_credit(self._link, self._clock)
            self._link.stop()
        except BaseException:
            self._bring_to_rest()
            raise
        period = self._link.profile.drives.period
        return self._tally.summary(period, interrupted=self._interrupted, timing=self._link.timing())

    def _turn(self) -> bool:
        """Feed and collect once; whether the run is over."""
        if not self._interrupted and self._should_stop():
            self._interrupted = True
            self._link.stop()
        if not self._interrupted:
            self._feed()
        self._collect()
        if self._interrupted:
            return self._link.state is not LinkState.STOPPING
        return self._exhausted and not len(self._sent)

    def _feed(self) -> None:
        """Feed what there is credit for, and have the next batch ready."""
        while (rows := self._ahead()) is not None and self._link.free:
            accepted = self._link.feed(rows[: self._link.free])
            if not accepted:
                return
            self._remember(rows[:accepted])
            self._pending = rows[accepted:]

    def _ahead(self) -> Setpoints | None:
        """Rows to feed next; None when there are no more."""
        while not self._exhausted and not self._pending:
            self._pending = next(self._setpoints, None)
            if self._pending is None:
                self._exhausted = True
                self._check_end()
        return self._pending

    def _remember(self, rows: Setpoints) -> None:
        self._sent.append(rows)
        self._tail = np.vstack([self._tail, rows.slider[-2:]])[-2:]
        self._silent = bool(rows.pressure[-1] == 0.0)

    def _check_end(self) -> None:
        if not self._silent or not ends_at_rest(self._tail, self._link.profile):
            what = "moving" if self._silent else "with the air on"
            raise JobError(Problem("stream", f"the setpoints end while the machine is {what}"))

    def _collect(self) -> None:
        """Take what was executed, compare it with what was sent, hand it on."""
        feedback = self._link.feedback()
        self._stop_known = self._stop_known or expect_stop(self._sent, self._link)
        if not len(feedback):
            return
        if len(feedback) > len(self._sent):
            raise DriveError(Problem("echo", "the drives executed more rows than were sent"))
        rows = self._sent.take(len(feedback))
        check_echo(rows, feedback, self._link.resolution)
        self._tally.add(rows, feedback)
        self._on_rows(rows, feedback)

    def _bring_to_rest(self) -> None:
        """Stop; further errors on the way give way to the one that is being raised."""
        self._link.stop()
        with suppress(Exception):
            self._collect()
        while self._link.state is LinkState.STOPPING:
            wait_for_credit(self._link, self._clock)
            with suppress(Exception):
                self._collect()
