"""Answers a client reads by pattern: temperatures, position, capabilities, progress, host actions."""

from collections.abc import Iterator
from typing import Final

from cdhr_host import __version__
from cdhr_host.job.surface import JobState, Status
from cdhr_host.serve.marlin.bench import Bench
from cdhr_host.serve.model import ACTIVE, PAUSED, filament_mm
from cdhr_host.units import KPA, MM

BUSY: Final = 2.0
"""s between two ``busy`` unless M113 says otherwise"""
CAPABILITIES: Final = (
    "AUTOREPORT_TEMP",
    "AUTOREPORT_POS",
    "AUTOREPORT_SD_STATUS",
    "EMERGENCY_PARSER",
    "BUSY_PROTOCOL",
    "PROMPT_SUPPORT",
    "EXTENDED_M20",
)


def temperatures(status: Status) -> str:
    """No heater; the air as a sensor, kPa."""
    pressure, command = status.pressure / KPA, status.pressure_setpoint / KPA
    return f"T:0.0 /0.0 B:0.0 /0.0 P:{pressure:.2f} /{command:.2f} @:0 B@:0"


def position(bench: Bench) -> str:
    """M114: where the nozzle's setpoint is; Count has the sliders, mm."""
    status = bench.status()
    x, y, z = (value / MM + 0.0 for value in status.nozzle_G.tolist())
    sliders = " ".join(
        f"{letter}:{value / MM:.3f}" for letter, value in zip("XYZUVW", status.slider, strict=True)
    )
    e = bench.modes.e or filament_mm(bench.host.view())
    return f"X:{x:.3f} Y:{y:.3f} Z:{z:.3f} E:{e:.3f} Count {sliders}"


def identity(name: str) -> Iterator[str]:
    """M115, all lines directly one after the other."""
    yield (
        f"FIRMWARE_NAME:cdhr_host {__version__} SOURCE_CODE_URL:local PROTOCOL_VERSION:1.0 "
        f"MACHINE_TYPE:{name} EXTRUDER_COUNT:1 UUID:00000000-0000-4000-8000-636468720001"
    )
    for capability in CAPABILITIES:
        yield f"Cap:{capability}:1"


def sd_status(status: Status) -> str:
    """M27."""
    progress = status.progress
    if status.state not in ACTIVE or progress is None or not progress.size:
        return "Not SD printing"
    return f"SD printing byte {min(progress.position, progress.size)}/{progress.size}"


def _paused(status: Status) -> Iterator[str]:
    yield "//action:paused"
    if status.message:
        yield f"//action:notification {' '.join(status.message.split())}"


def _prompt(status: Status) -> Iterator[str]:
    yield f"//action:prompt_begin {' '.join(status.message.split()) or 'The print is held'}"
    yield "//action:prompt_button Resume"
    yield "//action:prompt_button Cancel"
    yield "//action:prompt_show"


class Reports:
    """What is said from time to time, and ``busy`` while an answer is owed."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._every = {"temperature": 0.0, "position": 0.0, "sd": 0.0}
        self._next = dict(self._every)
        self._busy_every = BUSY
        self._busy_next = 0.0
        self._state = bench.state()
        self.prompts = False
        """whether the client shows dialogues (M876 P1)"""

    def changes(self) -> list[str]:
        """What the host tells its client when the job's state has changed since the last look."""
        before, after = self._state, self._bench.state()
        if before is after:
            return []
        self._state, status = after, self._bench.status()
        if after in PAUSED and before not in PAUSED:
            return [*_paused(status), *(_prompt(status) if self.prompts else ())]
        if before in PAUSED and after in ACTIVE - PAUSED:
            return ["//action:prompt_end", "//action:resumed"]
        if after in {JobState.STOPPING, JobState.STOPPED} and before in ACTIVE:
            return ["//action:prompt_end", "//action:cancel"]
        if after is JobState.FAULT:
            return [f"Error:Printer halted. kill() called! {status.message}".rstrip()]
        done = after is JobState.DONE and status.progress is not None and status.progress.size > 0
        return ["Done printing file"] if done else []

    def set_every(self, what: str, seconds: float) -> None:
        """M155, M154, M27 with S; 0 ends it."""
        self._every[what] = min(max(seconds, 0.0), 3600.0)

    def set_busy(self, seconds: float) -> None:
        """M113 S; 0 says nothing."""
        self._busy_every = min(max(seconds, 0.0), 60.0)

    def due(self, now: float) -> list[str]:
        """Reports whose time has come."""
        return [
            self._text(what) for what, every in self._every.items() if every and self._comes(what, every, now)
        ]

    def busy_from(self, now: float) -> None:
        """A line has been taken up."""
        self._busy_next = now + self._busy_every

    def busy(self, now: float) -> list[str]:
        """A line is still being worked on."""
        if not self._busy_every or now < self._busy_next:
            return []
        self._busy_next = now + self._busy_every
        return ["echo:busy: paused for user" if self._bench.state() in PAUSED else "echo:busy: processing"]

    def _comes(self, what: str, every: float, now: float) -> bool:
        if now < self._next[what]:
            return False
        self._next[what] = now + every
        return True

    def _text(self, what: str) -> str:
        if what == "temperature":
            return f" {temperatures(self._bench.status())}"
        return position(self._bench) if what == "position" else sd_status(self._bench.status())
