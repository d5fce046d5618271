"""A BridgeLink that a thread keeps talking while its owner plans.

The bridge buffers, so that a thread of ordinary priority is enough: when the owner hangs the
buffer runs dry, when the process hangs the bridge's watchdog runs out, and both stop the
machine on its path.
"""

import threading
import time
from typing import Final

from cdhr_host.drives.bridge.host import BridgeLink
from cdhr_host.drives.bridge.line import BridgeLine
from cdhr_host.drives.bridge.talker import TURN
from cdhr_host.drives.clock import MonotonicClock
from cdhr_host.drives.link import LinkState, Told, untold
from cdhr_host.drives.timing import CycleTiming
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Feedback, Setpoints

PATIENCE: Final = 5.0


class PumpedBridge:
    """MachineLink; see ``BridgeLink``. Every call waits for the thread's turn to end, some 1 ms."""

    def __init__(self, profile: Profile, path: str, baud: int) -> None:
        self.profile = profile
        self.resolution = profile.canopen.position_unit
        self._link = BridgeLink(profile, MonotonicClock(), lambda: BridgeLine(path, baud))
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def state(self) -> LinkState:
        """Where the link is in its life."""
        return self._link.state

    @property
    def free(self) -> int:
        """Rows that ``feed`` would accept."""
        with self._lock:
            return self._link.free

    @property
    def buffered(self) -> int:
        """Rows accepted whose outcome has not come back."""
        with self._lock:
            return self._link.buffered

    @property
    def stop_tick(self) -> int | None:
        """First tick of the stop."""
        return self._link.stop_tick

    @property
    def slider(self) -> Array:
        """(6,) m, as last told."""
        with self._lock:
            return self._link.slider

    @property
    def notes(self) -> list[str]:
        """What an operator should know."""
        return self._link.notes

    def timing(self) -> CycleTiming | None:
        """The bridge keeps time."""
        return self._link.timing()

    def stop_rows(self, ahead: Setpoints) -> Setpoints:
        """What the bridge plays instead of ``ahead``."""
        return self._link.stop_rows(ahead)

    def open(self) -> None:
        """CLOSED -> OPEN."""
        with self._lock:
            self._link.open()
        self._ended.clear()
        self._thread = threading.Thread(target=self._pump, name="bridge", daemon=True)
        self._thread.start()

    @property
    def referenced(self) -> bool:
        """The bridge's encoders are absolute."""
        return self._link.referenced

    def home(self, told: Told = untold) -> None:
        """Nothing to find."""
        with self._lock:
            self._link.home(told)

    def interrupt(self) -> None:
        """Nothing to end."""
        self._link.interrupt()

    def arm(self, start: Array) -> None:
        """OPEN or STOPPED -> ARMED."""
        with self._lock:
            self._link.arm(start)

    def feed(self, setpoints: Setpoints) -> int:
        """Take the first rows there is credit for; how many."""
        with self._lock:
            return self._link.feed(setpoints)

    @property
    def revisable(self) -> int:
        """First tick that ``revise`` may still replace."""
        with self._lock:
            return self._link.revisable

    def revise(self, rows: Setpoints) -> None:
        """Replace what is buffered from ``rows.tick[0]`` on."""
        with self._lock:
            self._link.revise(rows)

    def feedback(self) -> Feedback:
        """What was executed since the last call."""
        with self._lock:
            return self._link.feedback()

    def stop(self) -> None:
        """Come to rest on the path, air off."""
        with self._lock:
            self._link.stop()

    def close(self) -> None:
        """-> CLOSED."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join(PATIENCE)
            self._thread = None
        with self._lock:
            self._link.close()

    def _pump(self) -> None:
        while not self._ended.is_set():
            with self._lock:
                self._link.poll()
            time.sleep(TURN)
