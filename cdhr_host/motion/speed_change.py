"""One speed change as constant-jerk pieces: the only door to ruckig.

Ruckig's velocity interface needs no position and so cannot overshoot one; its tolerances
are absolute, which is one more reason to work in metres.
"""

import ruckig

from cdhr_host.errors import MotionError, Problem

_solver = ruckig.Ruckig(1)
_request = ruckig.InputParameter(1)
_request.control_interface = ruckig.ControlInterface.Velocity
_request.current_position = [0.0]
_answer = ruckig.Trajectory(1)


def speed_change(v0: float, v1: float, a: float, j: float) -> tuple[list[float], list[float]]:
    """m/s, m/s, m/s², m/s³ -> durations (s) and jerks (m/s³) of the fastest change from v0 to v1.

    The acceleration is zero at both ends. Raises MotionError with the input that failed.
    """
    _request.current_velocity, _request.target_velocity = [v0], [v1]
    _request.max_acceleration, _request.max_jerk = [a], [j]
    try:
        result = _solver.calculate(_request, _answer)
    except ruckig.RuckigError as error:
        raise _unplannable(v0, v1, a, j, str(error)) from error
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise _unplannable(v0, v1, a, j, str(result))
    profile = _answer.profiles[0][0]
    return profile.t, profile.j


def _unplannable(v0: float, v1: float, a: float, j: float, why: str) -> MotionError:
    message = f"no speed change from {v0!r} to {v1!r} m/s with {a!r} m/s² and {j!r} m/s³: {why.strip()}"
    return MotionError(Problem("unplannable", message, hint="please report this as a bug"))
