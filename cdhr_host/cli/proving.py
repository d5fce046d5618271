"""The whole file is proven before anything moves: what ``dry-run`` and ``stream`` share."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdhr_host.cli.progress import Progress, clock_text
from cdhr_host.cli.refusals import problem_lines, say, writing
from cdhr_host.cli.source import Source

if TYPE_CHECKING:
    from cdhr_host.pipeline import Checked, Proof
    from cdhr_host.profile import Profile
    from cdhr_host.report.log import Log


@dataclass(frozen=True, slots=True)
class LogWish:
    """The log a dry run is to write."""

    path: Path
    compact: bool = False


def proven(
    source: Source,
    machine: "Profile",
    *,
    rate: float | None = None,
    log: LogWish | None = None,
    see: "Callable[[Checked], None] | None" = None,
) -> "Proof":
    """Walk the staircase once without drives; the log is kept only when all is well.

    ``see`` is shown every block that is computed. Raises ProgramError for a program that is not understood.
    """
    from cdhr_host.pipeline import prove

    with _log(log, machine, rate, source.name) as (out, takes), checking(source, see) as watch:
        proof = prove(source.chunks(), machine, rate_hz=rate, watch=watch, **takes)
        if out is not None and proof.ok:
            out.keep()
    return proof


@contextmanager
def checking(
    source: Source, see: "Callable[[Checked], None] | None" = None
) -> "Iterator[Callable[[Checked], None]]":
    """Progress of a proof: a function to be shown every block; ``see`` is shown it too."""
    with Progress("checking") as progress:

        def watch(checked: "Checked") -> None:
            if see is not None:
                see(checked)
            if len(block := checked.setpoints):
                progress.show(source.fraction, f"line {block.line[-1]}  {clock_text(block.t[-1])} of motion")

        yield watch


@contextmanager
def _log(
    wish: LogWish | None, machine: "Profile", rate: float | None, program: str
) -> "Iterator[tuple[Log | None, dict[str, Any]]]":
    """The log, if there is to be one, and what of the proof it takes."""
    if wish is None:
        yield None, {}
        return
    from cdhr_host.report.compact import CompactLog
    from cdhr_host.report.log import SetpointLog, about

    known = about(machine, program)
    with writing(wish.path):
        if wish.compact:
            with CompactLog(wish.path, machine.drives.period if rate is None else 1.0 / rate, known) as small:
                yield small, {"trace": small.add_trace}
        else:
            with SetpointLog(wish.path, known) as full:
                yield full, {"sink": full.add_setpoints}


def tell_problems(proof: "Proof", source: Source) -> None:
    """Warnings and reasons to refuse, on standard error."""
    for line in problem_lines(proof.warnings, len(proof.warnings), source.name, "warning"):
        say(line)
    for line in problem_lines(proof.problems, proof.total_problems, source.name):
        say(line)
