"""``cdhr jog``: move the machine by keys and typed G-code."""

import sys
from typing import Annotated

import typer

from cdhr_host.cli.interrupt import StopRequest
from cdhr_host.cli.machine import SIMULATED, open_machine, opened
from cdhr_host.cli.options import DrivesUrl, MaterialName, ProfileName, examples
from cdhr_host.cli.refusals import emit

EXAMPLES = examples(
    "cdhr jog",
    "cdhr jog --profile paper-wide",
    "printf 'G1 X10 F600\\nG28\\n' | cdhr jog",
)


def jog(
    *,
    profile: ProfileName = "paper",
    material: MaterialName = None,
    drives: DrivesUrl = SIMULATED,
    speed: Annotated[
        float, typer.Option(metavar="X", help="Run the simulated drives X times faster.", min=0.01)
    ] = 1.0,
) -> None:
    """Jog: arrow keys, PgUp, PgDn and typed G-code; every line is proven before it moves.

    Standard input that is no terminal is read as lines of G-code, each answered with ok and
    the position, or with its refusal.
    """
    from cdhr_host.console import Session, from_keys, from_lines
    from cdhr_host.pipeline import Staircase

    machine = open_machine(profile, material)
    link, clock = opened(drives, machine, speed)
    try:
        session = Session(Staircase(machine), link, clock, stops=StopRequest)
        code = from_keys(session) if sys.stdin.isatty() else from_lines(session, sys.stdin, emit)
    finally:
        link.close()
    raise typer.Exit(code)
