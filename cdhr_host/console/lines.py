"""A console without a terminal: lines of G-code from a pipe, each answered in one line."""

from collections.abc import Callable, Iterable
from concurrent.futures import Future, wait
from typing import Final

from cdhr_host.job.surface import Reply, Status, Surface
from cdhr_host.units import MM

QUIT: Final = frozenset({"q", "quit", "exit"})
LOOK: Final = 0.05
"""s between two looks at a request to stop"""


def from_lines(
    surface: Surface, lines: Iterable[str], write: Callable[[str], None], should_stop: Callable[[], bool]
) -> int:
    """Answer each line ``ok ...`` or with its refusal; the exit code of the first refusal.

    Once ``should_stop`` says so the machine comes to rest on its path, and no further line is read.
    """
    code = 0
    for line in lines:
        text = line.strip()
        if text in QUIT or should_stop():
            break
        if not text:
            continue
        reply = _settled(surface, surface.run(text), should_stop)
        write(f"ok {where(surface.status())}" if reply.ok else "\n".join(reply.lines))
        code = code or reply.exit_code
    return code


def where(status: Status) -> str:
    """Nozzle, sliders and the nine cable forces."""
    places = zip("XYZ", status.nozzle_G / MM + 0.0, strict=True)
    nozzle = " ".join(f"{axis}{value:.3f}" for axis, value in places)
    slider = " ".join(f"{value:.3f}" for value in status.slider_setpoint / MM + 0.0)
    force = " ".join(f"{value:.2f}" for value in status.tension)
    return f"{nozzle} | sliders {slider} mm | cables {force} N"


def _settled(surface: Surface, answer: "Future[Reply]", should_stop: Callable[[], bool]) -> Reply:
    """What became of a line, once the machine stands."""
    held = False
    while not wait([answer], timeout=LOOK).done:
        if should_stop() and not held:
            held = True
            surface.hold("interrupted")
    return answer.result()
