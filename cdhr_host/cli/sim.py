"""``cdhr sim``: the simulated machine on the far side of a pseudo-terminal."""

import json
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cdhr_host.cli.machine import open_machine
from cdhr_host.cli.options import MaterialName, ProfileName, examples
from cdhr_host.cli.refusals import emit, writing

if TYPE_CHECKING:
    from cdhr_host.drives.sim.serve import Serial
    from cdhr_host.profile import Profile

EXAMPLES = examples(
    "cdhr sim --link /tmp/machine",
    "cdhr stream gcode/paper_ring_double.gcode --drives slcan:/tmp/machine@1000000 --yes",
    "cdhr sim --bus link --record received.csv",
)


def sim(
    *,
    profile: ProfileName = "paper",
    material: MaterialName = None,
    bus: Annotated[
        Literal["slcan", "link"],
        typer.Option(help="CANopen drives behind a serial CAN adapter, or a motion bridge."),
    ] = "slcan",
    link: Annotated[
        Path | None, typer.Option(metavar="PATH", help="Make a symbolic link to the pseudo-terminal.")
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(metavar="CSV", help="At the end write what the drives received, and a report beside."),
    ] = None,
    trace: Annotated[
        Path | None,
        typer.Option(
            metavar="CSV", help="At the end write where the sliders were and what clay was laid, by periods."
        ),
    ] = None,
) -> None:
    """Be six drives, a pressure regulator and the machine behind them, until interrupted.

    SIGUSR1 pulls the plug: the line is gone, the drives and the machine go on by themselves.
    """
    from cdhr_host.drives.sim.serve import Terminal, keep_record, keep_trace, serve

    machine = open_machine(profile, material)
    stopped: list[int] = []
    pulled: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda n, _: stopped.append(n))
    signal.signal(signal.SIGUSR1, lambda n, _: pulled.append(n))
    with writing(link or Path("pseudo-terminal")), Terminal(link) as terminal:
        far = _far(bus, machine)
        rate = "1000000" if bus == "slcan" else "921600"
        emit(f"{bus}:{terminal.link or terminal.path}@{rate}")
        serve(terminal, far, lambda: bool(stopped), lambda: bool(pulled))
    if record is not None:
        with writing(record):
            keep_record(far, record)
    if trace is not None:
        with writing(trace):
            keep_trace(far, trace)
    emit(json.dumps(far.report()))


def _far(bus: str, machine: "Profile") -> "Serial":
    import time

    from cdhr_host.drives.sim.bridge import Bridge
    from cdhr_host.drives.sim.serve import GRACE, SlcanStation

    now = time.monotonic()
    return SlcanStation(machine, now) if bus == "slcan" else Bridge(machine, now, grace=GRACE)
