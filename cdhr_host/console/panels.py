"""What the console shows of a ``Status``, as lines of text."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cdhr_host.console.gauges import gauge, outside, progress_bar, span
from cdhr_host.job.surface import JobState, Progress, Status
from cdhr_host.profile.schema import Profile
from cdhr_host.units import KPA, MM, MM3
from cdhr_host.values import Array

CABLES: Final = ("1L", "1R", "2L", "2R", "3L", "3R", "4 ", "5 ", "6 ")
NARROW: Final = 12
"""characters of a bar"""
NEXT: Final = {
    JobState.IDLE: "F3 loads a file, : types G-code, arrows jog",
    JobState.PROVING: "the file is being proven, nothing moves",
    JobState.READY: "F5 starts the print",
    JobState.PRINTING: "space holds, F8 aborts",
    JobState.HOLDING: "coming to rest on the path",
    JobState.HELD: "space resumes, F8 aborts",
    JobState.RESUMING: "space holds again",
    JobState.STOPPING: "coming to rest for good",
    JobState.STOPPED: "F3 loads a file; cdhr resume goes on with this one",
    JobState.FAULT: "F9 acknowledges, after a look at the machine",
    JobState.DONE: "done; F3 loads the next file",
}
"""what the operator can do now"""


def positions(status: Status) -> str:
    """Both platforms and the speed."""
    x, y, z = rounded(status.nozzle_G)
    u, v, w = rounded(status.upper)
    return (
        f"nozzle X{x:9.3f} Y{y:9.3f} Z{z:9.3f} mm  {status.velocity / MM:6.1f} mm/s\n"
        f"upper  U{u:9.3f} V{v:9.3f} W{w:9.3f} mm  {'referenced' if status.referenced else 'NOT REFERENCED'}"
    )


def rounded(place: Array) -> Array:
    """(3,) m -> (3,) mm to a thousandth, without a minus before zero."""
    return np.round(place / MM, 3) + 0.0


def sliders(status: Status, profile: Profile) -> str:
    """Travel, measured place, torque of the six sliders."""
    low, high = profile.sliders.travel_min, profile.sliders.travel_max
    rows = zip(status.slider, status.torque, strict=True)
    lines = (
        f"{i} {gauge(place, low, high, NARROW)}{place / MM:9.2f} {torque:6.3f} {outside(place, low, high)}"
        for i, (place, torque) in enumerate(rows, 1)
    )
    return "\n".join(("sliders         mm      N m", *lines))


def cables(status: Status) -> str:
    """The nine planned forces inside their windows, measured ones beside them where there are any."""
    return "\n".join(("cables          N    window", *_cables(status)))


def _cables(status: Status) -> Iterator[str]:
    for i, name in enumerate(CABLES):
        force, (least, most) = float(status.tension[i]), status.window[i]
        bar = gauge(force, least, most, NARROW)
        yield f"{name}{bar}{force:6.2f} {least:4.1f}–{most:<4.1f} {outside(force, least, most)}"


def measured(force: Array) -> str:
    """(3,) N of the sensors; nothing where there are none."""
    if np.isnan(force).all():
        return ""
    return "  sensors " + " ".join(f"{each:.2f}" for each in force) + " N"


def air(status: Status) -> str:
    """Pressure, flow and both overrides."""
    return (
        f"air {status.pressure / KPA:6.1f} of {status.pressure_setpoint / KPA:6.1f} kPa  "
        f"flow {status.flow / MM3:7.1f} mm³/s{measured(status.force)}\n"
        f"feed {status.feed_override:4.0%}  flow {status.flow_override:4.0%}"
    )


def job(status: Status) -> str:
    """State, what can be done now, and how far the program is."""
    why = f": {status.message}" if status.message else ""
    head = f"{status.state.value.upper()}{why}  – {NEXT[status.state]}"
    return head if status.progress is None else f"{head}\n{progress(status.progress)}"


def progress(done: Progress) -> str:
    """One line."""
    layer = f"layer {done.layer}/{done.layers} " if done.layers else ""
    return (
        f"{done.file} {progress_bar(done.fraction, 14)} {done.fraction:4.0%} {layer}"
        f"line {done.line}/{done.lines} {span(done.elapsed)} gone, {span(done.left)} left"
    )
