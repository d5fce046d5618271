"""What is read off the machine at one moment: the ``Status`` every surface shows."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.errors import MotionError
from cdhr_host.job.program import Program
from cdhr_host.job.surface import JobState, Progress, Status
from cdhr_host.mechanism import Cables, Loads
from cdhr_host.mechanism.pairs import Pairs, nine_tensions, shares
from cdhr_host.profile import Profile
from cdhr_host.values import Array, Feedback, Setpoints


@dataclass(slots=True)
class Count:
    """What a program has done so far."""

    program: Program
    started: float
    """s of the clock"""
    printing: float = 0.0
    """s of motion"""
    extruded: float = 0.0
    """m³"""
    line: int = 0
    plan: float = 0.0
    """s of the program as written"""

    def add(self, rows: Setpoints, period: float) -> None:
        """Rows of it that were executed."""
        self.printing += len(rows) * period
        self.extruded += float(rows.flow.sum()) * period
        self.line = max(self.line, int(rows.line[-1]))

    def progress(self, now: float, feed: float, *, over: bool) -> Progress:
        """How far it is at a time of the clock and a share of the feed."""
        proof = self.program.proof
        return Progress(
            file=self.program.file.name,
            lines=proof.lines,
            line=self.line,
            position=self.program.size if over else self.program.position(self.line),
            size=self.program.size,
            layer=self.program.layer(self.line),
            layers=len(proof.layers),
            elapsed=now - self.started,
            printing=self.printing,
            left=0.0 if over else max(proof.duration - self.plan, 0.0) / feed,
            duration=proof.duration,
            planned=proof.duration if over else self.plan,
            extruded=self.extruded,
            total=proof.extruded,
        )


@dataclass(frozen=True, slots=True)
class Seen:
    """What the drives told last; the reference pose before they told anything."""

    rows: Setpoints | None = None
    """the last two, or one, executed"""
    feedback: Feedback | None = None
    """of the last of them"""


class Reader:
    """Makes a ``Status`` of what was seen."""

    def __init__(self, profile: Profile) -> None:
        self._period = profile.drives.period
        self._cables, self._pairs = Cables.from_profile(profile), Pairs.from_profile(profile)
        self._loads = Loads.from_profile(profile)
        forces = profile.forces
        least = [forces.single_min] * 6 + [forces.upper_min] * 3
        greatest = [forces.single_max] * 6 + [forces.upper_max] * 3
        self._window = np.column_stack((least, greatest))

    def status(
        self,
        state: JobState,
        message: str,
        seen: Seen,
        *,
        standing: tuple[Array, Array, Array],
        overrides: tuple[float, float],
        homed: bool,
        referenced: bool,
        buffered: int,
        progress: Progress | None,
    ) -> Status:
        """All of it; cheap. ``standing``: nozzle, upper platform, sliders before anything was executed."""
        rows, feedback = seen.rows, seen.feedback
        nothing = rows is None or feedback is None
        nozzle, upper, slider = standing
        return Status(
            state=state,
            message=message,
            line=0 if rows is None else int(rows.line[-1]),
            nozzle_G=nozzle if rows is None else rows.nozzle_G[-1],
            upper=upper if rows is None else rows.upper[-1],
            velocity=self._speed(rows),
            slider=slider if feedback is None else feedback.slider[-1],
            slider_setpoint=slider if rows is None else rows.slider[-1],
            tension=self._resting(nozzle, upper) if rows is None else self._nine(rows),
            window=self._window,
            force=np.full(3, np.nan) if feedback is None or not len(feedback.force) else feedback.force[-1],
            torque=np.zeros(6) if feedback is None else feedback.torque[-1],
            flow=0.0 if rows is None else float(rows.flow[-1]),
            pressure=0.0 if feedback is None else float(feedback.pressure[-1]),
            pressure_setpoint=0.0 if rows is None else float(rows.pressure[-1]),
            feed_override=overrides[0],
            flow_override=overrides[1],
            referenced=referenced,
            homed=homed,
            tick=-1 if nothing or rows is None else int(rows.tick[-1]),
            buffered=buffered,
            progress=progress,
        )

    def _speed(self, rows: Setpoints | None) -> float:
        if rows is None or len(rows) < 2:
            return 0.0
        return float(np.linalg.norm(rows.nozzle_G[-1] - rows.nozzle_G[-2]) / self._period)

    def _resting(self, nozzle_G: Array, upper: Array) -> Array:
        """(9,) N with both platforms standing, before anything has moved; NaN where none hold them."""
        q = (nozzle_G - self._cables.reference_G)[None]
        try:
            nine = nine_tensions(self._cables, self._loads, self._pairs, q, upper[None])[0]
        except MotionError:
            return np.full(9, np.nan)
        return np.concatenate((nine[:6].reshape(2, 3).T.ravel(), nine[6:]))

    def _nine(self, rows: Setpoints) -> Array:
        """(9,) N: left and right cable of each pair in turn, then the upper ones."""
        q = rows.nozzle_G[-1:] - self._cables.reference_G
        shared = shares(self._cables, self._pairs, q, rows.tension[-1:, :3])
        pairs = np.column_stack((shared.left[0], shared.right[0])).ravel()
        return np.concatenate((pairs, rows.tension[-1, 3:]))
