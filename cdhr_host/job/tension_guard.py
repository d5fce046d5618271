"""Measured cable forces and motor torques while one slider moves alone."""

from typing import Final

from cdhr_host.errors import Problem
from cdhr_host.job.watchdogs import Lasting, Watchdogs
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Feedback, Setpoints

HINT: Final = "look at the cable, its pulley and its sensor; then step the slider back"


class TensionGuard:
    """Force sensors against the windows, and all that a print's watchdogs watch. One run's."""

    def __init__(self, profile: Profile) -> None:
        forces, watch = profile.forces, profile.watch
        self._least, self._greatest = forces.lower_min, forces.lower_max
        self._outside = Lasting(watch.force_settling, profile.drives.period)
        self._dogs = Watchdogs(profile)

    def found(self, rows: Setpoints, feedback: Feedback) -> Problem | None:
        """Executed rows and what was measured at each -> what is wrong, once it lasts; else None."""
        problem = self._window(rows, feedback.force) if len(feedback.force) else None
        alarm = self._dogs.executed(rows, feedback)
        return problem or (alarm.problem if alarm is not None else None)

    def _window(self, rows: Setpoints, force: Array) -> Problem | None:
        """(N, 3) N measured: the first cable out of its window for as long as a force may settle."""
        at = self._outside.first((force < self._least) | (force > self._greatest))
        return None if at is None else self._problem(at[1], float(force[at]), int(rows.tick[at[0]]))

    def _problem(self, cable: int, force: float, tick: int) -> Problem:
        low = force < self._least
        limit = self._least if low else self._greatest
        side = "less" if low else "more"
        message = (
            f"the sensor of cable {cable + 1} shows {force:.3g} N at tick {tick}, {side} than {limit:g} N"
        )
        return Problem("force", message, value=force, limit=limit, unit="N", hint=HINT)
