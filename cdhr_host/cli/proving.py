"""The whole file is proven before anything moves: what ``dry-run`` and ``stream`` share."""

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from cdhr_host.cli.progress import Progress, clock_text
from cdhr_host.cli.refusals import problem_lines, say, writing
from cdhr_host.cli.source import Source

if TYPE_CHECKING:
    from cdhr_host.pipeline import Proof
    from cdhr_host.profile import Profile
    from cdhr_host.values import Setpoints


def proven(
    source: Source, machine: "Profile", *, rate: float | None = None, log: Path | None = None
) -> "Proof":
    """Walk the staircase once without drives; the log is kept only when all is well.

    Raises ProgramError for a program that is not understood.
    """
    from cdhr_host.pipeline import prove
    from cdhr_host.report.log import SetpointLog

    with writing(log) if log else nullcontext(), SetpointLog(log) if log else nullcontext() as out:
        with Progress("checking") as progress:

            def watch(block: "Setpoints") -> None:
                if len(block):
                    progress.show(
                        source.fraction, f"line {block.line[-1]}  {clock_text(block.t[-1])} of motion"
                    )

            sink = out.add_setpoints if out is not None else None
            proof = prove(source.chunks(), machine, rate_hz=rate, sink=sink, watch=watch)
        if out is not None and proof.ok:
            out.keep()
    return proof


def tell_problems(proof: "Proof", source: Source) -> None:
    """Warnings and reasons to refuse, on standard error."""
    for line in problem_lines(proof.warnings, len(proof.warnings), source.name, "warning"):
        say(line)
    for line in problem_lines(proof.problems, proof.total_problems, source.name):
        say(line)
