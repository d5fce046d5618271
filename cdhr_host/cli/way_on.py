"""Where an interrupted print goes on, and what the machine will do to get there, in words."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cdhr_host.drives import MachineLink
    from cdhr_host.job.journal import Journal
    from cdhr_host.job.program import Program
    from cdhr_host.job.recovery import Recovery
    from cdhr_host.values import Array


@dataclass(frozen=True, slots=True)
class Wish:
    """Where the operator wants to go on."""

    overlap_mm: float
    line: int | None
    layer: int | None
    moved: bool
    """the machine does not stand where the print left it"""


@dataclass(frozen=True, slots=True)
class Found:
    """Where it goes on, and the way there."""

    recovery: "Recovery"
    places_G: "Array"
    """(N, 3) m, straight from one to the next; none where the nozzle is there"""


def way_on(past: "Journal", program: "Program", link: "MachineLink", wish: Wish) -> Found:
    """Where it goes on. Raises JobError where that is not known, or not there."""
    from cdhr_host.job.recovery import Resuming
    from cdhr_host.pipeline.rig import Rig
    from cdhr_host.units import MM

    rig = Rig.from_profile(link.profile)
    way, standing_G = Resuming(program, rig), rig.standing(link.slider)[0]
    line = wish.line if wish.layer is None else _line_of(wish.layer, program)
    if line is not None:
        recovery = way.at_line(line)
    elif wish.moved:
        recovery = way.moved(past, wish.overlap_mm * MM)
    else:
        recovery = way.found(past, standing_G, link.stop_rows, wish.overlap_mm * MM)
    clear = link.profile.bed.clear_height
    return Found(recovery, way.aside(recovery.tick).way_back(standing_G, clear))


def _line_of(layer: int, program: "Program") -> int:
    from cdhr_host.errors import JobError, Problem

    layers = program.proof.layers
    if layer > len(layers):
        message = f"there is no layer {layer}: the file names {len(layers)}"
        raise JobError(Problem("resume", message, hint="--from-line goes on at a line"))
    return layers[layer - 1][0]


def told(past: "Journal", found: Found, program: "Program", link: "MachineLink", *, again: bool) -> list[str]:
    """What will be done, line by line; ``again`` where the machine is simulated anew."""
    from cdhr_host.units import MM

    seam = found.recovery
    x, y, z = seam.nozzle_G / MM
    share = seam.tick * past.opened.period_s / max(program.proof.duration, past.opened.period_s)
    doubt = "" if seam.sure else "; where the bead ended is not known better"
    return [
        *_journal(past),
        *_machine(seam, again=again),
        f"goes on   at line {seam.line} of {program.proof.lines}, {share:.0%} done",
        f"          X{x:.3f} Y{y:.3f} Z{z:.3f}",
        f"overlap   {seam.overlap / MM:.2f} mm of bead at most{doubt}",
        f"approach  {_approach(found.places_G)}",
        f"prime     {_prime(link.profile.job.resume_prime)}",
    ]


def _journal(past: "Journal") -> list[str]:
    lines = [f"journal   {past.path}: {past.state}{f', {past.reason}' if past.reason else ''}"]
    if past.damage is not None:
        lost = past.damage
        lines.append(f"          {lost.dropped} bytes from record {lost.record} on are dropped: {lost.why}")
    return lines


def _machine(seam: "Recovery", *, again: bool) -> list[str]:
    from cdhr_host.units import MM

    if again:
        return ["machine   simulated anew: it stands at its reference pose"]
    return [f"machine   stands {seam.away / MM:.3f} mm from its path"] if seam.away else []


def _approach(places_G: "Array") -> str:
    """``up to Z35.000, over to X60.000 Y0.000, down to Z10.000``."""
    from cdhr_host.units import MM

    if not len(places_G):
        return "none: the nozzle stands there"
    steps = [f"X{x:.3f} Y{y:.3f} Z{z:.3f}" for x, y, z in (places_G / MM).tolist()]
    return "air off, straight to " + ", then ".join(steps)


def _prime(duration: float) -> str:
    from cdhr_host.units import MS

    if not duration:
        return "none ([job] resume_prime_ms = 0)"
    return f"{duration / MS:g} ms of clay, standing at the seam"


def record(past: "Journal", found: Found) -> dict[str, object]:
    """The same for a program."""
    from cdhr_host.units import MM

    seam = found.recovery
    return {
        "journal": str(past.path),
        "line": seam.line,
        "nozzle_mm": (seam.nozzle_G / MM).tolist(),
        "approach_mm": (found.places_G / MM).tolist(),
        "overlap_mm": seam.overlap / MM,
        "sure": seam.sure,
    }
