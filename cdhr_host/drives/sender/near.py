"""The host's side of the sender: a MachineLink that fills a ring."""

import math
import multiprocessing
import time
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdhr_host.drives.checks import STANDS_WITHIN, check_rows, check_shapes
from cdhr_host.drives.faults import fault
from cdhr_host.drives.link import LinkState, Told, untold
from cdhr_host.drives.rows import no_feedback
from cdhr_host.drives.sender.far import CAPACITY, NOWHERE, RESULTS, REVISION, STATES, Spec, Word, run
from cdhr_host.drives.sender.ring import FEEDBACK, SETPOINTS, Ring, feedback, packed, width
from cdhr_host.drives.timing import CycleTiming
from cdhr_host.errors import DriveError, Problem
from cdhr_host.motion.hold import path_true_stop
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Feedback, Setpoints

SILENCE: Final = 1.0
"""s without a cycle after which a sender counts as dead"""
GUARD: Final = 0.02
"""s between asking for a revision and the cycle before which the sender carries it out"""
ANSWER: Final = 180.0
"""s a command may take; homing takes longest"""


class SenderLink:
    """MachineLink whose cycles run in a process of their own; see ``MachineLink``."""

    def __init__(self, url: str, profile: Profile, store: Path) -> None:
        self.profile = profile
        self.state = LinkState.CLOSED
        self.stop_tick: int | None = None
        self.resolution = profile.canopen.position_unit
        self.notes: list[str] = []
        self._url, self._store = url, store
        self._process: BaseProcess | None = None
        self._fault: DriveError | None = None
        self._untold = False
        self._tail = np.zeros(6)
        self._next_tick: int | None = None
        self._fed = self._collected = self._seen_cycles = 0
        self._timing: CycleTiming | None = None

    @property
    def free(self) -> int:
        """Rows that ``feed`` would accept."""
        return self._rows.space if self.state in (LinkState.ARMED, LinkState.RUNNING) else 0

    @property
    def buffered(self) -> int:
        """Rows accepted whose outcome has not come back."""
        return self._fed - self._collected

    @property
    def slider(self) -> Array:
        """(6,) m, as last answered by the drives."""
        return np.array(self._ask("slider"))

    @property
    def pid(self) -> int | None:
        """Of the sender."""
        return self._process.pid if self._process is not None else None

    def timing(self) -> CycleTiming | None:
        """Lateness of the cycles since arming."""
        if self._process is not None and self._process.is_alive():
            self._timing = self._ask("timing")
        return self._timing

    def stop_rows(self, ahead: Setpoints) -> Setpoints:
        """What is played instead of ``ahead`` once the link stops."""
        return path_true_stop(ahead, self.profile)

    def open(self) -> None:
        """CLOSED -> OPEN: start the sender, bring-up, timing test."""
        if self.state is not LinkState.CLOSED:
            raise DriveError(Problem("state", f"the drives are {self.state.value}, not closed"))
        self._start()
        try:
            self._ask("ready")
            self._unlink()
            self.notes = self._ask("open")
        except BaseException:
            self._end()
            raise

    def arm(self, start: Array) -> None:
        """OPEN or STOPPED -> ARMED, holding (6,) m ``start``."""
        self._fault_if_known()
        self._ask("arm", [float(at) for at in np.ravel(start)])
        self._tail, self._next_tick = np.array(start), None
        self._results.take(RESULTS)
        self._fed = self._collected = 0
        self.stop_tick = None

    def feed(self, setpoints: Setpoints) -> int:
        """Put the first rows there is room for into the ring; how many."""
        self._look()
        self._expect_moving()
        if not len(setpoints):
            return 0
        reach = STANDS_WITHIN if self._next_tick is None else None
        check_rows(setpoints, self.profile, tick=self._next_tick, before=self._tail, reach=reach)
        accepted = setpoints[: self.free]
        if len(accepted):
            self._rows.write(packed(accepted, SETPOINTS))
            self._fed += len(accepted)
            self._tail, self._next_tick = accepted.slider[-1], int(accepted.tick[-1]) + 1
        return len(accepted)

    @property
    def revisable(self) -> int:
        """First tick that ``revise`` may still replace."""
        if self._next_tick is None:
            return 0
        guard = math.ceil(GUARD / self.profile.drives.period)
        return min(int(self._status[Word.REVISABLE]) + guard, self._next_tick)

    def revise(self, rows: Setpoints) -> None:
        """Replace what is buffered from ``rows.tick[0]`` on: the sender does it between two cycles."""
        self._look()
        self._expect_moving()
        if self._next_tick is None:
            raise DriveError(Problem("state", "there is nothing to revise: no row was fed yet"))
        if not len(rows):
            return
        check_shapes(rows)
        if len(rows) > REVISION:
            message = f"a revision of {len(rows)} rows does not fit: there is room for {REVISION}"
            raise DriveError(Problem("overflow", message, value=len(rows), limit=REVISION))
        self._revisions.write(packed(rows, SETPOINTS))
        self._ask("revise")
        after = int(rows.tick[-1]) + 1
        self._fed += after - self._next_tick
        self._tail, self._next_tick = rows.slider[-1], after

    def feedback(self) -> Feedback:
        """What was executed since the last call."""
        self._look()
        if self._process is None:
            return no_feedback()
        rows = feedback(self._results.take(RESULTS))
        self._collected += len(rows)
        return rows

    def stop(self) -> None:
        """Come to rest on the path, air off."""
        if self._process is None:
            raise DriveError(Problem("state", "the drives are closed, not open"))
        self._status[Word.INTERRUPT] = 0
        if self.state is not LinkState.FAULT:
            self._ask("stop")

    @property
    def referenced(self) -> bool:
        """Whether every axis knows the reference pose."""
        return bool(self._ask("referenced"))

    def home(self, told: Told = untold) -> None:
        """Reference every axis by homing, one after the other."""
        try:
            self._ask("home", told=told)
        finally:
            self._status[Word.INTERRUPT] = 0

    def interrupt(self) -> None:
        """End homing within a cycle; from any thread."""
        if self._process is not None:
            self._status[Word.INTERRUPT] = 1

    def set_reference(self) -> None:
        """The machine stands at its reference pose: remember it."""
        self._ask("reference")

    def close(self) -> None:
        """-> CLOSED; what moves is stopped on the path first."""
        if self._process is None:
            return
        try:
            if self._process.is_alive():
                self._ask("close")
        except DriveError:
            self._process.kill()
        self._end()

    def _start(self) -> None:
        self._rows = Ring(width(SETPOINTS, Setpoints), CAPACITY)
        self._results = Ring(width(FEEDBACK, Feedback), RESULTS)
        self._revisions = Ring(width(SETPOINTS, Setpoints), REVISION)
        self._memory = SharedMemory(create=True, size=8 * len(Word))
        self._named = True
        self._status = np.ndarray((len(Word),), np.int64, self._memory.buf)
        self._status[:] = 0
        self._status[Word.STOP_TICK] = NOWHERE
        context = multiprocessing.get_context("spawn")
        self._pipe: Connection
        self._pipe, far = context.Pipe()
        rings = (self._rows.name, self._results.name, self._revisions.name)
        spec = Spec(self._url, self.profile, self._store, *rings, self._memory.name)
        self._process = context.Process(target=run, args=(spec, far), name="cdhr-sender", daemon=True)
        self._process.start()
        far.close()
        self._fault, self._untold = None, False
        self._progress = time.monotonic()

    def _end(self) -> None:
        """The sender has ended or must."""
        assert self._process is not None
        self._pipe.close()
        self._process.join(10.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._process = None
        del self._status
        self._unlink()
        self._memory.close()
        for ring in (self._rows, self._results, self._revisions):
            ring.close()
        self.state = LinkState.CLOSED

    def _unlink(self) -> None:
        """Both sides have the memory open: without a name it ends with them, killed or not."""
        if self._named:
            self._named = False
            self._memory.unlink()
        for ring in (self._rows, self._results, self._revisions):
            ring.unlink()

    def _ask(self, name: str, *arguments: Any, told: Told = untold) -> Any:
        """A command and its answer; raises DriveError when it is refused or the sender is dead."""
        if self._process is None:
            raise DriveError(Problem("state", "the drives are closed, not open"))
        try:
            self._pipe.send((name, *arguments))
            while True:
                if not self._pipe.poll(ANSWER):
                    raise self._dead("does not answer")
                kind, answer = self._pipe.recv()
                if kind == "homing":
                    told(answer)
                elif kind == "fault":
                    self._fault, self._untold = DriveError(answer), True
                else:
                    break
        except (EOFError, OSError) as error:
            raise self._dead("ended") from error
        self._read_status()
        if kind == "refused":
            raise DriveError(answer)
        return answer

    def _look(self) -> None:
        """Read the status; raises a fault that is new."""
        if self._process is None:
            raise DriveError(Problem("state", "the drives are closed, not open"))
        self._read_status()
        if self._untold and self._fault is not None:
            self._untold = False
            raise self._fault
        try:
            while self._pipe.poll():
                _, problems = self._pipe.recv()
                self._fault = DriveError(problems)
                raise self._fault
        except (EOFError, OSError) as error:
            raise self._dead("ended") from error
        cycles = int(self._status[Word.CYCLES])
        if cycles != self._seen_cycles:
            self._seen_cycles, self._progress = cycles, time.monotonic()
        elif time.monotonic() - self._progress > SILENCE and self.state is not LinkState.FAULT:
            raise self._dead("stands still")

    def _read_status(self) -> None:
        if self._fault is not None and self._fault.problems[0].kind == "sender":
            return
        self.state = STATES[int(self._status[Word.STATE])]
        stop = int(self._status[Word.STOP_TICK])
        self.stop_tick = None if stop == NOWHERE else stop

    def _dead(self, how: str) -> DriveError:
        if self._fault is None or self._fault.problems[0].kind != "sender":
            self._fault = fault("sender", f"the sending process {how}")
        self.state = LinkState.FAULT
        return self._fault

    def _expect_moving(self) -> None:
        if self.state not in (LinkState.ARMED, LinkState.RUNNING):
            self._fault_if_known()
            raise DriveError(Problem("state", f"the drives are {self.state.value}, not armed or running"))

    def _fault_if_known(self) -> None:
        if self._fault is not None and self.state is LinkState.FAULT:
            raise self._fault
