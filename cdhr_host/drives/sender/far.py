"""What runs in the sender's process: cycles, the ring, and one command at a time.

No logging, no garbage collection, no allocation that grows: the loop does a cycle, moves
rows, publishes where it is. The only other thread works out a stop, once it is wanted, and
gives way every SWITCH.
"""

import ctypes
import gc
import os
import select
import signal
import sys
from dataclasses import dataclass
from enum import IntEnum
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdhr_host.drives.address import port_of
from cdhr_host.drives.buffer import too_late
from cdhr_host.drives.checks import check_rows
from cdhr_host.drives.clock import MonotonicClock
from cdhr_host.drives.cyclic import CyclicLink
from cdhr_host.drives.faults import fault
from cdhr_host.drives.link import LinkState
from cdhr_host.drives.reference import ReferenceStore
from cdhr_host.drives.sender.ring import FEEDBACK, SETPOINTS, Ring, packed, setpoints, width
from cdhr_host.drives.timing import CycleTiming
from cdhr_host.errors import DriveError, Problem
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Feedback, Setpoints

PRIORITY: Final = 60
SWITCH: Final = 1e-4
"""s after which the thread that works out a stop gives way to the cycle"""
CAPACITY: Final = 1024
"""setpoints in the ring, besides those in the sender's own buffer"""
REVISION: Final = 4 * CAPACITY
"""setpoints of a revision at most: all in the ring and in the sender's own buffer, at any rate of ticks"""
RESULTS: Final = 16384
BATCH: Final = 16
"""rows moved from the ring at a time while cycles run: one check for all of them"""
IDLE: Final = 0.05
"""s between two looks for commands while there is no cycle"""
JITTER: Final = 0.5
"""of the period a cycle may at most be late in the timing test"""
STATES: Final = list(LinkState)


class Word(IntEnum):
    """Words of the status block."""

    CYCLES = 0
    STATE = 1
    STOP_TICK = 2
    FAULTS = 3
    EXECUTED = 4
    REVISABLE = 5
    INTERRUPT = 6


NOWHERE: Final = -(2**62)
"""stop tick while there is none"""


@dataclass(frozen=True, slots=True)
class Spec:
    """All a sender needs to know."""

    url: str
    profile: Profile
    store: Path
    rows: str
    results: str
    revisions: str
    status: str


def run(spec: Spec, commands: Connection) -> None:
    """The process's main function; ends when the link was closed, the host is gone, or by SIGTERM."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sender = Sender(spec, commands)
    signal.signal(signal.SIGTERM, lambda _number, _frame: sender.leave())
    real_time = hurry()
    try:
        sender.loop(real_time)
    finally:
        sender.end()
        gc.unfreeze()
        gc.enable()


def hurry() -> bool:
    """SCHED_FIFO for this and all later threads, memory locked, collector off; whether FIFO was allowed."""
    gc.collect()
    gc.freeze()
    gc.disable()
    sys.setswitchinterval(SWITCH)
    ctypes.CDLL(None).mlockall(3)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except PermissionError:
        return False
    return True


def timing_told(found: CycleTiming, profile: Profile) -> str:
    """What the timing test says to an operator."""
    limit = JITTER * profile.drives.period
    text = f"timing test: p99.9 {found.p999 * 1e3:.3f} ms, worst {found.max * 1e3:.3f} ms late"
    if not found.real_time:
        text += ", without real-time priority"
    if found.max < limit:
        return text
    then = (
        "the drives may stand still for moments"
        if profile.canopen.allow_soft_realtime
        else "nothing is armed"
    )
    return f"{text}: failed (limit {limit * 1e3:g} ms), {then}"


class Sender:
    """A CyclicLink driven by commands from a pipe and rows from a ring."""

    def __init__(self, spec: Spec, commands: Connection) -> None:
        self._profile = spec.profile
        self._commands = commands
        self._asked = select.poll()
        self._asked.register(commands.fileno(), select.POLLIN)
        self._rows = Ring(width(SETPOINTS, Setpoints), CAPACITY, spec.rows)
        self._results = Ring(width(FEEDBACK, Feedback), RESULTS, spec.results)
        self._revisions = Ring(width(SETPOINTS, Setpoints), REVISION, spec.revisions)
        self._memory = SharedMemory(spec.status)
        self._status = np.ndarray((len(Word),), np.int64, self._memory.buf)
        clock = MonotonicClock()
        self._link = CyclicLink(spec.profile, clock, lambda: port_of(spec.url), ReferenceStore(spec.store))
        self._alive = True
        self._punctual = True
        self._real_time = False

    def loop(self, real_time: bool) -> None:
        """Cycles until the end."""
        self._real_time = real_time
        while self._alive:
            waits = self._link.due == float("inf")
            self._obey(IDLE if waits else 0.0)
            if self._link.due != float("inf"):
                self._link.turn()
                self._move()
            self._publish()

    def leave(self) -> None:
        """End after this cycle: what moves is stopped on its path first."""
        self._alive = False

    def end(self) -> None:
        """Whatever happened: at rest, voltage off, memory given back."""
        try:
            self._link.close()
        except DriveError:
            self._link.state = LinkState.CLOSED
        self._publish()
        self._rows.close()
        self._results.close()
        self._revisions.close()
        del self._status
        self._memory.close()

    def _obey(self, patience: float) -> None:
        """Do what the host asks; a host that is gone asks for the end."""
        try:
            if not self._asked.poll(patience * 1e3):
                return
            name, *arguments = self._commands.recv()
        except (EOFError, OSError):
            self._abandoned()
            return
        try:
            answer: Any = getattr(self, f"_do_{name}")(*arguments)
            self._publish()
            self._say("done", answer)
        except DriveError as error:
            self._publish()
            self._say("refused", error.problems)

    def _say(self, what: str, answer: object) -> None:
        """To the host; one that is gone asks for the end."""
        try:
            self._commands.send((what, answer))
        except OSError:
            self._abandoned()

    def _abandoned(self) -> None:
        self._take_rows()
        self._alive = False

    def _do_ready(self) -> None:
        """All the shared memory is open."""

    def _do_open(self) -> list[str]:
        self._link.open()
        lateness = self._link.machine.lateness
        lateness.real_time = self._real_time
        lateness.reset()
        until = self._link.due + self._profile.canopen.jitter_test
        while self._link.due < until:
            self._link.turn()
        found = lateness.summary()
        self._punctual = found.max < JITTER * self._profile.drives.period
        return [*self._link.notes, timing_told(found, self._profile)]

    def _do_arm(self, start: list[float]) -> None:
        if not self._punctual and not self._profile.canopen.allow_soft_realtime:
            raise fault("jitter", "the timing test failed: setpoints would come too late")
        self._link.arm(np.array(start))
        self._rows.cut(0)

    def _do_stop(self) -> None:
        self._take_rows()
        self._link.stop()

    def _do_revise(self) -> None:
        """The revision's rows lie in their own ring, complete; the host waits for the answer.

        Nothing else reads or writes the rows meanwhile and no cycle runs: the next one sees
        either all of the revision or, when it is refused, nothing of it.
        """
        revised = setpoints(self._revisions.take(REVISION))
        self._take_rows()
        first = int(revised.tick[0])
        kept = max(first - self._link.next_tick, 0)
        if kept > self._rows.waiting:
            raise too_late(first, self._link.revisable, self._link.next_tick + self._rows.waiting)
        at_once = 0 if kept else min(len(revised), self._link.room_from(first))
        if kept + len(revised) - at_once > self._rows.capacity:
            raise DriveError(Problem("overflow", f"{len(revised)} rows from tick {first} on do not fit"))
        if kept:
            before = setpoints(self._rows.record(kept - 1)).slider[0]
            check_rows(revised, self._profile, tick=first, before=before, reach=None)
        else:
            check_rows(revised, self._profile, tick=first, before=revised.slider[0], reach=None)
            self._link.revise(revised[:at_once])
        self._rows.cut(kept)
        self._rows.write(packed(revised[at_once:], SETPOINTS))

    def _do_close(self) -> None:
        self._link.close()
        self._alive = False

    def _do_timing(self) -> object:
        return self._link.timing()

    def _do_referenced(self) -> bool:
        return self._link.referenced

    def _do_home(self) -> None:
        self._link.home(
            lambda drive: self._commands.send(("homing", drive)),
            should_stop=lambda: bool(self._status[Word.INTERRUPT]),
        )

    def _do_reference(self) -> None:
        self._link.set_reference()

    def _do_slider(self) -> list[float]:
        return [float(at) for at in self._link.slider]

    def _move(self) -> None:
        """Rows in, results out; a fault goes to the host once."""
        try:
            if self._link.free >= BATCH:
                self._take_rows()
            executed = self._link.feedback()
        except DriveError as error:
            self._say("fault", error.problems)
            self._status[Word.FAULTS] += 1
            return
        if len(executed):
            self._results.write(packed(executed, FEEDBACK))

    def _take_rows(self) -> None:
        free = self._link.free
        if free and len(records := self._rows.take(free)):
            self._link.feed(setpoints(records))

    def _publish(self) -> None:
        self._status[Word.STATE] = STATES.index(self._link.state)
        stop = self._link.stop_tick
        self._status[Word.STOP_TICK] = NOWHERE if stop is None else stop
        self._status[Word.REVISABLE] = self._link.revisable
        self._status[Word.EXECUTED] = self._results.written
        self._status[Word.CYCLES] += 1
