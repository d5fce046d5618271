"""A jog session: each line is proven as a whole before it moves, then run through the job."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

import numpy as np

from cdhr_host.drives import Clock, MachineLink
from cdhr_host.errors import CdhrError, DriveError, JobError
from cdhr_host.job import stream
from cdhr_host.pipeline import Staircase
from cdhr_host.units import MINUTE, MM
from cdhr_host.values import Array, Feedback, Setpoints

JOG_SPEED = 25 * MM
"""m/s of a jog key"""


@dataclass(frozen=True, slots=True)
class Reply:
    """What became of a line."""

    ok: bool
    text: str
    """where the machine stands, or why the line was refused"""
    exit_code: int = 0


def _never() -> AbstractContextManager[Callable[[], bool]]:
    return nullcontext(lambda: False)


class Session:
    """One machine under an operator's hands.

    ``stops`` is entered for each move and gives what is asked while the machine moves; once
    that is true it comes to rest on its path and stands there for the next line.
    """

    def __init__(
        self,
        staircase: Staircase,
        link: MachineLink,
        clock: Clock,
        *,
        stops: Callable[[], AbstractContextManager[Callable[[], bool]]] = _never,
    ) -> None:
        self._staircase = staircase
        self._link = link
        self._clock = clock
        self._stops = stops
        self._slider: Array = np.zeros(6)
        self._standing: Setpoints | None = None

    def run(self, line: str) -> Reply:
        """Prove a line of G-code, then move; a refused line leaves the machine as it was."""
        try:
            blocks = [block for block in self._staircase.prepare([f"{line}\n".encode()]) if len(block)]
            interrupted = self._move(blocks) if blocks else False
        except CdhrError as error:
            return Reply(False, "\n".join(_refusal_lines(error)), error.exit_code)
        return Reply(True, f"stopped on the path: {self.where()}" if interrupted else self.where())

    def jog(self, axis: str, distance_mm: float) -> Reply:
        """Move along one axis; the modes that typed lines have set stay as they are."""
        back = "\nG90" if self._staircase.modal.absolute else ""
        inch = self._staircase.modal.unit / MM
        feed = self._staircase.modal.feed
        speed = f"F{JOG_SPEED / MM * MINUTE / inch:.6f}"
        reply = self.run(f"G91\nG1 {axis}{distance_mm / inch:.6f} {speed}{back}")
        if reply.ok and feed is not None:
            self._staircase.prepare([f"G1 F{feed / MM * MINUTE / inch:.6f}\n".encode()])
        return reply

    def where(self) -> str:
        """Nozzle, sliders and cable forces of the last row that was executed."""
        if self._standing is None:
            return "X0 Y0 Z0, the reference pose"
        row = self._standing
        nozzle = " ".join(
            f"{axis}{value:.3f}" for axis, value in zip("XYZ", row.nozzle_G[-1] / MM + 0.0, strict=True)
        )
        slider = " ".join(f"{value:.3f}" for value in row.slider[-1] / MM + 0.0)
        force = " ".join(f"{value:.2f}" for value in row.tension[-1])
        return f"{nozzle} | sliders {slider} mm | cables {force} N"

    def _move(self, blocks: list[Setpoints]) -> bool:
        """Run setpoints; says whether they were stopped on the way."""
        try:
            with self._stops() as asked:
                summary = stream(
                    iter(blocks),
                    self._link,
                    self._clock,
                    start=self._slider,
                    on_rows=self._moved,
                    should_stop=asked,
                )
        except (DriveError, JobError):
            self._stopped_short()
            raise
        if summary.interrupted:
            self._stopped_short()
        return summary.interrupted

    def _moved(self, rows: Setpoints, _: Feedback) -> None:
        self._standing = rows[-1:]
        self._slider = rows.slider[-1]

    def _stopped_short(self) -> None:
        """Stand where the last executed row left the nozzle."""
        if self._standing is not None:
            self._staircase.stand_at(self._standing.nozzle_G[-1])


def _refusal_lines(error: CdhrError) -> Iterator[str]:
    for problem in error.problems:
        yield f"error: {problem.message}"
        if problem.hint:
            yield f"hint: {problem.hint}"
