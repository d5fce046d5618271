"""What every surface (command line, console, servers) sees of the machine, and may ask of it.

One ``Printer`` owns the link and the job. Its methods may be called from any thread: each
returns at once or refuses at once; what happens then is seen in ``status`` and told to listeners.
"""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Protocol

from cdhr_host.errors import Problem
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array


class JobState(Enum):
    """Where a job is; the table of what leads where is ``job.states``."""

    IDLE = "idle"
    """the machine stands, no program is loaded"""
    PROVING = "proving"
    """a program is being walked, nothing moves"""
    READY = "ready"
    """a proven program waits to be started"""
    PRINTING = "printing"
    HOLDING = "holding"
    """coming to rest on the path"""
    HELD = "held"
    """at rest on the path, air off; can go on"""
    RESUMING = "resuming"
    """priming, then up to speed on the path"""
    STOPPING = "stopping"
    """coming to rest for good, then lifting"""
    STOPPED = "stopped"
    """at rest after an abort; ``cdhr resume`` may go on"""
    FAULT = "fault"
    """at rest after a fault, nothing moves before it is acknowledged"""
    DONE = "done"
    """all of it was executed, at rest, air off"""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a program is."""

    file: str
    """its name, as a person knows it"""
    lines: int
    line: int
    """being executed"""
    position: int
    """bytes of the text up to that line"""
    size: int
    """bytes of the text"""
    layer: int
    layers: int
    """0 where the program names none"""
    elapsed: float
    """s since printing began, holds included"""
    printing: float
    """s of it spent moving or dwelling"""
    left: float
    """s at the present feed override"""
    duration: float
    """s of the whole program at 100 %"""
    extruded: float
    """m³ laid so far, as planned"""
    total: float
    """m³ of the whole program"""
    planned: float = 0.0
    """s of the program as written that are done"""

    @property
    def fraction(self) -> float:
        """0 ... 1 by time."""
        return min(1.0, max(0.0, self.planned / self.duration)) if self.duration > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Status:
    """The machine at one moment."""

    state: JobState
    message: str
    """why it is so, for a person; empty when there is nothing to say"""
    line: int
    nozzle_G: Array
    """(3,) m, setpoint"""
    upper: Array
    """(3,) m, displacement of the upper platform, setpoint"""
    velocity: float
    """m/s of the nozzle, setpoint"""
    slider: Array
    """(6,) m, measured"""
    slider_setpoint: Array
    """(6,) m"""
    tension: Array
    """(9,) N, planned, of the nine cables in the order 1L 1R 2L 2R 3L 3R 4 5 6"""
    window: Array
    """(9, 2) N, least and greatest allowed"""
    force: Array
    """(3,) N measured of cables 1-3; NaN where there are no sensors"""
    torque: Array
    """(6,) N m, measured"""
    flow: float
    """m³/s, planned"""
    pressure: float
    """Pa, measured"""
    pressure_setpoint: float
    """Pa"""
    feed_override: float
    """1.0 is 100 %"""
    flow_override: float
    referenced: bool
    homed: bool
    """whether the machine stands at the reference pose"""
    tick: int
    buffered: int
    """ticks fed and not executed yet"""
    progress: Progress | None
    """of the program loaded; None without one"""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened, told once."""

    kind: str
    """``"state"``, ``"problem"``, ``"message"``, ``"layer"``, ``"pause"`` or ``"override"``"""
    text: str
    status: Status
    problem: Problem | None = None


Listener = Callable[[Event], None]
"""Called from the printer's own thread; must return at once."""


@dataclass(frozen=True, slots=True)
class Reply:
    """What became of a short text of G-code."""

    ok: bool
    lines: tuple[str, ...]
    """for a person: ``X:.. Y:..`` of M114, or refusals each followed by its hint"""
    problems: tuple[Problem, ...] = ()
    exit_code: int = 0
    """what a command ends with that fails for this"""


class LineFeed(Protocol):
    """A client's lines, printed as they come: one look-ahead over all that is there.

    No whole file is proven here. Each line is checked before any of it moves: words, places and
    forces at rest. One that is refused is told as a ``"problem"`` event with its number; what was
    taken before it is executed to its end, at rest, and the state becomes HELD. When lines run
    out, the machine comes to rest at the end of the last one and stays PRINTING.
    """

    def offer(self, line: str, *, typed: bool = False) -> bool:
        """Take one line of G-code, without its end; False, and not taken, while there is no room.

        A refused line that was ``typed`` by a person, alone, is only told; nothing is held for it.
        """
        ...

    @property
    def pending(self) -> int:
        """Lines taken whose motion has not ended; 0 says the machine stands after the last of them."""
        ...

    def finish(self) -> None:
        """No more lines: all that were taken are executed, then DONE. Harmless when over."""
        ...


class Surface(Protocol):
    """What a ``Printer`` offers. A word that the present state does not allow raises JobError."""

    @property
    def profile(self) -> Profile:
        """The machine."""
        ...

    @property
    def state(self) -> JobState:
        """Where the job is now; costs nothing."""
        ...

    def status(self) -> Status:
        """As of now; cheap."""
        ...

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Be told of events from now on; the answer ends it."""
        ...

    def load(self, path: Path, *, name: str | None = None) -> None:
        """IDLE, READY, DONE, STOPPED -> PROVING -> READY, or back to IDLE with the problems told."""
        ...

    def unload(self) -> None:
        """READY, DONE, STOPPED -> IDLE."""
        ...

    def start(self, *, at_line: int | None = None) -> None:
        """READY -> PRINTING."""
        ...

    def open_stream(self, name: str) -> LineFeed:
        """IDLE, READY, DONE, STOPPED -> PRINTING: lines instead of a file; one at a time."""
        ...

    def hold(self, reason: str = "") -> None:
        """PRINTING, RESUMING -> HOLDING -> HELD; harmless in HOLDING and HELD."""
        ...

    def resume(self) -> None:
        """HELD -> RESUMING -> PRINTING."""
        ...

    def abort(self, reason: str = "") -> None:
        """PRINTING ... HELD -> STOPPING -> STOPPED: rest on the path, air vented, lift."""
        ...

    def emergency_stop(self, reason: str = "") -> None:
        """Any -> FAULT: the link's own stop at once, air off."""
        ...

    def acknowledge(self) -> None:
        """FAULT -> IDLE, on an operator's word only."""
        ...

    def override(self, *, feed: float | None = None, flow: float | None = None) -> None:
        """1.0 is 100 %; 0.01 to 3 each. Acts within 200 ms, at any time."""
        ...

    def run(self, text: str) -> "Future[Reply]":
        """G-code typed by a person or sent by a client: proven, then run, in order.

        Allowed whenever no program moves the machine (IDLE, READY, HELD, STOPPED, DONE); moves
        in HELD are refused unless they come back before ``resume`` (the printer takes care: it
        returns to the held point first). Never raises for bad text: the reply says it.
        """
        ...

    def step(self, distance: Array) -> "Future[Reply]":
        """(3,) m: one straight move from where the nozzle stands; as ``run``, modes stay as they are."""
        ...

    def step_slider(self, axis: int, distance: float) -> "Future[Reply]":
        """Slider ``axis`` (0 ... 5) alone by m, up to 1 mm, positive pays out; IDLE and STOPPED only.

        Slow, from rest to rest, the other five held: the nozzle goes where that takes it. Refused
        where it would leave the bed, a force window, travel or every pose; ended on its way when
        measured forces or torques say so. Raises JobError for another axis, distance or state.
        """
        ...

    def jog(self, velocity: Array) -> None:
        """(3,) m/s of the nozzle: go on so for a lease of 150 ms; zero ends it; renewed by calling again.

        Ends at rest, jerk-limited, when the lease ends; slows to rest at a limit and says which.
        """
        ...
