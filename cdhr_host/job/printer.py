"""The one owner of a machine: what is asked of it by any thread, done by its own.

A word is allowed or refused at once, by the table of ``job.states``. What it sets going is
done in ``turn``, which the printer's thread calls again and again, or a test that steps its
own clock.
"""

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from cdhr_host.drives.clock import Clock
from cdhr_host.drives.link import MachineLink
from cdhr_host.errors import CdhrError, JobError, Problem
from cdhr_host.job.acts import Acts
from cdhr_host.job.jogging import Jogging
from cdhr_host.job.player import Observer, Player
from cdhr_host.job.program import Program, ProgramFile, proven
from cdhr_host.job.recorder import Recorder
from cdhr_host.job.recovery import Recovery
from cdhr_host.job.sliding import Sliding, check_step
from cdhr_host.job.states import QUIET, Word, after
from cdhr_host.job.surface import JobState, LineFeed, Listener, Reply, Status
from cdhr_host.job.telling import Telling
from cdhr_host.job.typed import Typed
from cdhr_host.job.waiting import wait_a_little
from cdhr_host.profile import Profile
from cdhr_host.values import Array, Pause

LEAST, MOST = 0.01, 3.0
"""of an override"""
BUG = "please report this as a bug, with the program"
DRIVES = 6
IDLE = 0.02
"""s of real time between two looks when nothing moves"""


class Printer:
    """A ``Surface`` on an open link.

    ``executor`` proves programs (default: a thread). Without ``run_forever`` or ``begin``
    nothing happens but in ``turn``.
    """

    def __init__(
        self,
        link: MachineLink,
        clock: Clock,
        *,
        executor: Executor | None = None,
        recorder: Recorder | None = None,
    ) -> None:
        self._clock = clock
        self._lock = threading.RLock()
        self._wake = threading.Event()
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self._executor = executor or ThreadPoolExecutor(1, "cdhr-proof")
        self._asked: deque[Callable[[], None]] = deque()
        self._state = JobState.IDLE
        self._telling = Telling()
        self._acts = Acts(Player(link), clock, self._telling, self._happened, recorder)
        self._acts.player.homing = self._homing
        self._typed = Typed(self._acts.player)
        self._jogging = Jogging(self._acts.player, clock, self._limit_met)
        self._sliding = Sliding(self._acts.player, partial(self._telling.add, "message"))

    @property
    def profile(self) -> Profile:
        """The machine."""
        return self._acts.player.profile

    @property
    def state(self) -> JobState:
        """Where the job is."""
        return self._state

    def status(self) -> Status:
        """As of the last turn."""
        return self._acts.status(self._state)

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Be told of events from now on, from the printer's thread; the answer ends it."""
        return self._telling.listen(listener)

    def observe(self, observer: Observer) -> None:
        """Have every executed batch: setpoints and feedback, row by row. From the printer's thread."""
        self._ask(partial(self._acts.player.observers.append, observer))

    def load(self, path: Path, *, name: str | None = None) -> None:
        """Prove a file. Raises JobError for one that cannot be read."""
        file = ProgramFile(path, name)
        self._say(Word.LOAD, f"proving {file.name}")
        self._acts.forget()
        future = self._executor.submit(proven, file, self.profile)
        future.add_done_callback(lambda found: self._ask(partial(self._acts.proven, found)))

    def adopt(self, program: Program) -> None:
        """A program that is proven already. Raises JobError where the machine cannot do it."""
        if not program.proof.ok:
            raise JobError(program.proof.problems, total=program.proof.total_problems)
        self._say(Word.LOAD)
        self._acts.adopt(program)

    def unload(self) -> None:
        """Forget the program, and the clay: the part is taken off."""
        self._say(Word.UNLOAD)
        self._ask(self._acts.unload)

    def start(self, *, at_line: int | None = None) -> None:
        """Print the program. Raises JobError where the machine does not stand at the reference pose."""
        if at_line is not None:
            raise JobError(Problem("start", "a print begins at line 1", hint="cdhr resume goes on at a line"))
        with self._lock:
            after(self._state, Word.START)
            self._acts.check_start()
            self._say(Word.START)
        self._ask(self._acts.start)

    def recover(self, recovery: Recovery, *, goes_on: str = "") -> None:
        """READY -> HELD, in the middle of the program: ``resume`` goes there, then on.

        ``goes_on`` names the journal of the print that was interrupted.
        """
        with self._lock:
            self._acts.check_busy()
            self._say(Word.RECOVER, f"line {recovery.line}")
        self._ask(lambda: self._acts.recover(recovery, goes_on))

    def open_stream(self, name: str) -> LineFeed:
        """Print lines as a client sends them."""
        with self._lock:
            after(self._state, Word.OPEN)
            if self._acts.busy or self._typed.busy:
                raise JobError(Problem("busy", "the machine still moves", hint="wait until it stands"))
            self._acts.player.check_referenced()
            self._say(Word.OPEN, f"printing what {name} sends")
            return self._acts.open(name)

    def hold(self, reason: str = "") -> None:
        """Come to rest on the path; where only typed G-code or a jog moves, that ends."""
        with self._lock:
            if self._state in QUIET and self._state is not JobState.HELD:
                self._ask(self._end_quiet)
                return
            self._say(Word.HOLD, reason)
        self._ask(self._acts.hold)

    def resume(self) -> None:
        """Go on where it was held."""
        with self._lock:
            self._acts.check_resume()
            self._say(Word.RESUME)
        self._ask(self._acts.resume)

    def abort(self, reason: str = "") -> None:
        """Rest on the path, vent, lift."""
        self._say(Word.ABORT, reason)
        self._ask(self._end_quiet)
        self._ask(self._acts.abort)

    def emergency_stop(self, reason: str = "") -> None:
        """The link's own stop at once."""
        self._say(Word.FAIL, reason or "emergency stop")
        self._acts.player.link.interrupt()
        self._ask(self._acts.emergency_stop, first=True)

    def acknowledge(self) -> None:
        """An operator has seen to it."""
        self._say(Word.ACKNOWLEDGE)
        self._ask(self._acts.acknowledge)

    def override(self, *, feed: float | None = None, flow: float | None = None) -> None:
        """Other shares of feed and flow from now on. Raises JobError for what is out of range."""
        for what, share in (("feed", feed), ("flow", flow)):
            if share is not None and not LEAST <= share <= MOST:
                raise JobError(_out_of_range(what, share))
        self._acts.check_override(flow)
        self._ask(lambda: self._acts.override(feed, flow, self._state))

    def run(self, text: str) -> "Future[Reply]":
        """Typed G-code: proven, then run, one text after the other."""
        ended = text if text.endswith("\n") else f"{text}\n"
        return self._later(lambda: self._acts.player.typed(ended))

    def step(self, distance: Array) -> "Future[Reply]":
        """One straight move from where the nozzle stands."""
        way = np.array(distance, dtype=float)
        return self._later(lambda: self._acts.player.step(way))

    def step_slider(self, axis: int, distance: float) -> "Future[Reply]":
        """One slider alone, the others held; refused unless every tick of it is safe."""
        check_step(axis, distance)
        self._check_still()
        return self._later(lambda: self._slid(axis, distance))

    def jog(self, velocity: Array) -> None:
        """Go on so for a lease."""
        speed = np.array(velocity, dtype=float)
        with self._lock:
            if self._state not in QUIET:
                raise JobError(Problem("state", f"no jogging while the printer is {self._state.value}"))
        self._acts.player.check_referenced()
        if speed.shape != (3,) or not np.isfinite(speed).all():
            raise JobError(Problem("jog", f"a jog needs three finite speeds, not {velocity}"))
        self._ask(lambda: self._jogging.ask(speed))

    def begin(self) -> None:
        """Turn in a thread of its own until ``close``."""
        self._thread = threading.Thread(target=self._run, name="cdhr-printer", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Bring the machine to rest and end the thread; the link stays open."""
        self._ending.set()
        self._wake.set()
        if self._thread is not None:
            self._thread.join()
        self._acts.end(self._state)
        self._telling.tell(self.status)
        self._executor.shutdown(wait=False, cancel_futures=True)

    def turn(self) -> None:
        """Do what was asked, feed, collect, and tell what happened; never raises for the machine's faults."""
        try:
            while self._asked:
                self._asked.popleft()()
            self._acts.turn(self._state)
            if (found := self._sliding.alarm()) is not None:
                self._typed.end(found)
            self._typed.turn(self._state)
            self._jogging.turn(self._state)
        except CdhrError as error:
            self._acts.fail(error)
        self._telling.tell(self.status)

    @property
    def moving(self) -> bool:
        """Whether anything is being played or asked for."""
        return bool(self._asked) or self._acts.busy or self._typed.busy or self._jogging.busy

    def _check_still(self) -> None:
        """Raises JobError while there is a job: the pose must not be left under one."""
        if self._state not in {JobState.IDLE, JobState.STOPPED}:
            message = f"no single slider is moved while the printer is {self._state.value}"
            raise JobError(Problem("state", message, hint="unload the program, or abort it, first"))

    def _slid(self, axis: int, distance: float) -> bool:
        self._check_still()
        return self._sliding.begin(axis, distance)

    def _homing(self, drive: int) -> None:
        """Told at once: homing holds up the turn it is in."""
        self._telling.add("message", f"homing drive {drive} of {DRIVES}")
        self._telling.tell(self.status)

    def _limit_met(self, limit: Problem) -> None:
        self._telling.add("message", f"the jog ends here: {limit.message}", limit)

    def _end_quiet(self) -> None:
        """Typed moves and jogs end on their way."""
        self._typed.end()
        self._jogging.end()

    def _later(self, begin: Callable[[], bool]) -> "Future[Reply]":
        answer: Future[Reply] = Future()
        self._ask(lambda: self._typed.add(begin, answer))
        return answer

    def wait(self) -> None:
        """Let a little time pass before the next turn."""
        if self.moving:
            wait_a_little(self._acts.player.link, self._clock)
        else:
            self._wake.wait(IDLE)
            self._wake.clear()

    @property
    def fault(self) -> CdhrError | None:
        """What brought it to FAULT, if the machine did."""
        return self._acts.fault

    @property
    def pause(self) -> Pause | None:
        """The program's pause it stands at, if it does."""
        return self._acts.player.pause

    def _run(self) -> None:
        while not self._ending.is_set():
            try:
                self.turn()
            except Exception as error:
                self._acts.fail(JobError(Problem("bug", f"{type(error).__name__}: {error}", hint=BUG)))
            self.wait()

    def _say(self, word: Word, message: str = "") -> None:
        """A word from outside, or of the machine: the state it leads to, or JobError."""
        with self._lock:
            before, self._state = self._state, after(self._state, word)
            if before is not self._state:
                self._acts.message = message
                self._telling.add("state", message or self._state.value)

    def _happened(self, word: Word, message: str = "") -> None:
        """A word of the machine; one that an operator's has overtaken changes nothing."""
        with self._lock:
            try:
                self._say(word, message)
            except JobError:
                return

    def _ask(self, act: Callable[[], None], *, first: bool = False) -> None:
        """Have something done in the next turn."""
        if first:
            self._asked.appendleft(act)
        else:
            self._asked.append(act)
        self._wake.set()


def _out_of_range(what: str, share: float) -> Problem:
    return Problem(
        "override",
        f"a {what} override of {share:.4g} ({share:.0%}) is outside 1 % to 300 %",
        value=share * 100,
        limit=MOST * 100 if share > MOST else LEAST * 100,
        unit="%",
    )
