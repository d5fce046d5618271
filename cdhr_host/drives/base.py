"""What links have in common that keep their rows in this process: state, buffer, outcome, one fault."""

from typing import Final

from cdhr_host.drives.buffer import RowBuffer
from cdhr_host.drives.link import LinkState, Told, untold
from cdhr_host.drives.rows import joined, no_feedback
from cdhr_host.drives.timing import CycleTiming
from cdhr_host.errors import DriveError, Problem
from cdhr_host.motion.hold import path_true_stop
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Feedback, Setpoints

TAKING: Final = (LinkState.ARMED, LinkState.RUNNING)
"""states in which rows are taken"""


class BufferedLink:
    """The half of a MachineLink that only keeps books; whoever derives from it plays the rows."""

    def __init__(self, profile: Profile, speed: float, lead: int = 0) -> None:
        self.profile = profile
        self.state = LinkState.CLOSED
        self.stop_tick: int | None = None
        self._buffer = RowBuffer(profile, speed, lead)
        self._executed: list[Feedback] = []
        self._fault: DriveError | None = None
        self._told = True
        self.interrupted = False
        """whether homing is to end"""

    @property
    def free(self) -> int:
        """Rows that ``feed`` would accept."""
        return self._buffer.free if self.state in TAKING else 0

    @property
    def buffered(self) -> int:
        """Rows accepted whose outcome has not come back."""
        return len(self._buffer)

    @property
    def notes(self) -> list[str]:
        """What an operator should know: nothing."""
        return []

    def timing(self) -> CycleTiming | None:
        """Who has no cycles of its own is never late."""
        return None

    @property
    def referenced(self) -> bool:
        """Absolute encoders know the reference pose."""
        return True

    def home(self, told: Told = untold) -> None:  # noqa: ARG002
        """Nothing to find: the machine knows its reference pose."""
        self._expect(LinkState.OPEN, LinkState.STOPPED)

    def interrupt(self) -> None:
        """End homing within a cycle."""
        self.interrupted = True

    def stop_rows(self, ahead: Setpoints) -> Setpoints:
        """What is played instead of ``ahead`` once the link stops."""
        return path_true_stop(ahead, self.profile)

    def feedback(self) -> Feedback:
        """What was executed since the last call."""
        self._catch_up()
        self._raise_fault()
        executed, self._executed = self._executed, []
        return joined(executed) if executed else no_feedback()

    def _catch_up(self) -> None:
        """Do what is due by now; nothing where someone else turns the link."""

    def _forget(self) -> None:
        """A new life: no fault, nothing executed."""
        self._fault, self._told, self._executed = None, True, []

    def _note(self, found: DriveError) -> bool:
        """Keep a fault to be raised once; whether it is the first one."""
        if self._fault is not None:
            return False
        self._fault, self._told = found, False
        return True

    def _raise_fault(self) -> None:
        if self._fault is not None and not self._told:
            self._told = True
            raise self._fault

    def _expect(self, *states: LinkState) -> None:
        if self.state is LinkState.FAULT and self._fault is not None:
            raise self._fault
        if self.state not in states:
            wanted = " or ".join(state.value for state in states)
            raise DriveError(Problem("state", f"the drives are {self.state.value}, not {wanted}"))
