"""The far side as a process of its own, behind a pseudo-terminal."""

import gc
import json
import os
import select
import time
import tty
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Final, Protocol

from cdhr_host.drives.sim.adapter import Adapter
from cdhr_host.drives.sim.station import Station
from cdhr_host.profile.schema import Profile

IDLE: Final = 2e-3
"""s after which time alone is looked at"""
PRIORITY: Final = 40
GRACE: Final = 0.05
"""s the kernel may take to hand a pseudo-terminal's bytes over, on a machine that is busy"""


class Serial(Protocol):
    """What stands at the other end of a serial line."""

    def exchange(self, now: float, data: bytes) -> bytes:
        """Bytes from the host -> bytes to it, by the time ``now``."""
        ...

    def report(self) -> dict[str, object]:
        """What was received, in numbers."""
        ...

    def record(self) -> list[tuple[int, ...]]:
        """Six position units and the raw pressure of each executed setpoint."""
        ...

    @property
    def trace(self) -> list[tuple[float, ...]]:
        """Each period: monotonic time, six real positions, raw pressure, whether fresh, clay in mm³/s."""
        ...


class SlcanStation:
    """A station behind a serial CAN adapter."""

    def __init__(self, profile: Profile, now: float) -> None:
        self.station = Station(profile, grace=GRACE)
        self._adapter = Adapter()
        self.station.start(now)

    def exchange(self, now: float, data: bytes) -> bytes:
        """See ``Serial``."""
        return self._adapter.text(self.station.exchange(now, self._adapter.frames(data)))

    def report(self) -> dict[str, object]:
        """See ``Serial``."""
        return {
            "cycles": self.station.syncs,
            "received": len(self.station.received),
            "lost_ticks": self.station.lost,
            "at_rest": self.station.resting,
            "pressure_raw": self.station.coupler.output,
            "states": [drive.drive_state.name.lower() for drive in self.station.drives],
        }

    def record(self) -> list[tuple[int, ...]]:
        """See ``Serial``."""
        return self.station.received

    @property
    def trace(self) -> list[tuple[float, ...]]:
        """See ``Serial``."""
        return self.station.trace


class Terminal:
    """A pseudo-terminal; ``path`` is what the host opens, ``link`` a symbolic link to it."""

    def __init__(self, link: Path | None = None) -> None:
        self.fd, self._slave = os.openpty()
        self._plugged = True
        tty.setraw(self._slave)
        os.set_blocking(self.fd, False)
        self.path = os.ttyname(self._slave)
        self.link = link
        if link is not None:
            fresh = link.with_name(link.name + ".new")
            fresh.symlink_to(self.path)
            fresh.replace(link)

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.unplug()
        if self.link is not None:
            self.link.unlink(missing_ok=True)

    def unplug(self) -> None:
        """The plug is pulled: nobody hears anything any more."""
        if self._plugged:
            self._plugged = False
            os.close(self.fd)
            os.close(self._slave)

    def read(self) -> bytes:
        """What the host wrote; waits for IDLE at most."""
        if not self._plugged:
            time.sleep(IDLE)
            return b""
        ready, _, _ = select.select([self.fd], [], [], IDLE)
        return os.read(self.fd, 65536) if ready else b""

    def write(self, data: bytes) -> None:
        """To the host; what it does not take is lost, as on a bus."""
        if not self._plugged:
            return
        try:
            os.write(self.fd, data)
        except BlockingIOError:
            return


def serve(
    terminal: Terminal, far: Serial, stopped: Callable[[], bool], unplugged: Callable[[], bool]
) -> None:
    """Be the far side until ``stopped``, behind a plug that is pulled once ``unplugged``."""
    gc.collect()
    gc.freeze()
    _hurry()
    while not stopped():
        if unplugged():
            terminal.unplug()
        data = terminal.read()
        answer = far.exchange(time.monotonic(), data)
        if answer:
            terminal.write(answer)
    gc.unfreeze()


def keep_record(far: Serial, path: Path) -> None:
    """Write what the far side received as CSV, and its report as JSON beside it."""
    columns = [*(f"slider{k + 1}_counts" for k in range(6)), "pressure_raw"]
    lines = [",".join(columns), *(",".join(map(str, row)) for row in far.record())]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    path.with_suffix(".json").write_text(json.dumps(far.report()) + "\n", encoding="ascii")


def keep_trace(far: Serial, path: Path) -> None:
    """Write what the simulated machine did, period by period, as CSV."""
    sliders = [f"slider{k + 1}_counts" for k in range(6)]
    header = ",".join(["time_s", *sliders, "pressure_raw", "fresh", "deposited_mm3_s"])
    rows = (
        f"{row[0]:.6f}," + ",".join(str(int(value)) for value in row[1:-1]) + f",{row[-1]:.6g}"
        for row in far.trace
    )
    path.write_text("\n".join([header, *rows]) + "\n", encoding="ascii")


def _hurry() -> None:
    """Real-time priority below the sender's, where that is allowed."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except (PermissionError, AttributeError):
        return
