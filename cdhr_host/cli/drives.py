"""``cdhr drives``: commissioning, one object at a time."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from cdhr_host.cli.machine import open_machine
from cdhr_host.cli.options import Json, ProfileName, examples
from cdhr_host.cli.refusals import Refusal, emit, say

if TYPE_CHECKING:
    from cdhr_host.drives.access import ObjectAccess
    from cdhr_host.drives.sender import SenderLink

app = typer.Typer(
    help="Scan, read, write and reset drives on the bus; nothing moves but by `home`.",
    epilog=examples(
        "cdhr drives scan --drives slcan:/dev/ttyACM0@1000000",
        "cdhr drives read 3 0x6065 --drives socketcan:can0",
        "cdhr drives write 3 'following error window' 10000 --drives socketcan:can0",
        "cdhr drives reset 3 --drives socketcan:can0",
    ),
    no_args_is_help=True,
)
Url = Annotated[str, typer.Option("--drives", metavar="URL", help="slcan:PATH@BITRATE or socketcan:CHANNEL.")]
NodeId = Annotated[int, typer.Argument(metavar="NODE", help="Node id, 1-127.", min=1, max=127)]
Object = Annotated[str, typer.Argument(metavar="OBJECT", help="0x6065, 0x1018:4, or its name in quotes.")]


@app.command(epilog=examples("cdhr drives scan --drives slcan:/dev/ttyACM0@1000000"))
def scan(*, drives: Url, json_: Json = False) -> None:
    """Every node that answers, with its identity."""
    from cdhr_host.drives.commission import scan as scanned

    with _bus(drives) as bus:
        nodes = scanned(bus)
    if json_:
        emit(json.dumps([{name: getattr(node, name) for name in type(node).__slots__} for node in nodes]))
        return
    for node in nodes:
        emit(
            f"{node.id:>3}  {node.kind}  vendor 0x{node.vendor:X}  product 0x{node.product:X}"
            f"  serial {node.serial}"
        )
    if not nodes:
        emit("no node answers")


@app.command(epilog=examples("cdhr drives status --drives slcan:/dev/ttyACM0@1000000"))
def status(*, drives: Url, profile: ProfileName = "paper") -> None:
    """State, position and error of the six drives."""
    from cdhr_host.drives.commission import status as statuses
    from cdhr_host.units import MM

    machine = open_machine(profile)
    with _bus(drives) as bus:
        for axis in statuses(bus, machine.canopen):
            emit(
                f"drive {axis.node}  {axis.state.value:<22} {axis.position / MM:>12.4f} mm"
                f"  mode {axis.mode}  error {axis.error}"
            )


@app.command(epilog=examples("cdhr drives read 3 0x6065 --drives socketcan:can0"))
def read(node: NodeId, object_: Object, *, drives: Url) -> None:
    """One object, with its name."""
    from cdhr_host.drives.canopen.bus import object_place
    from cdhr_host.drives.commission import read_object

    place = object_place(node, object_)
    with _bus(drives) as bus:
        emit(read_object(bus, node, *place))


@app.command(epilog=examples("cdhr drives write 3 0x6065 10000 --drives socketcan:can0"))
def write(
    node: NodeId,
    object_: Object,
    value: Annotated[str, typer.Argument(metavar="VALUE", help="Number, decimal or 0x...")],
    *,
    drives: Url,
) -> None:
    """Write one object and show what is read back."""
    from cdhr_host.drives.canopen.bus import object_place
    from cdhr_host.drives.commission import write_object

    place, number = object_place(node, object_), _number(value)
    with _bus(drives) as bus:
        emit(write_object(bus, node, *place, number))


@app.command(epilog=examples("cdhr drives reset 3 --drives socketcan:can0"))
def reset(node: NodeId, *, drives: Url) -> None:
    """Take a drive out of fault; it stays switched off."""
    from cdhr_host.drives.commission import reset as cleared

    with _bus(drives) as bus:
        emit(f"drive {node}: {cleared(bus, node).value}")


@app.command(epilog=examples("cdhr drives reference --drives socketcan:can0"))
def reference(*, drives: Url, profile: ProfileName = "paper") -> None:
    """The machine stands at its reference pose: remember it for each drive's serial number."""
    from cdhr_host.drives.reference import default_store

    _real(drives)
    _expect_reference(profile, "stored", 'reference = "stored", where drives do not know their place')
    with _link(drives, profile) as link:
        link.set_reference()
    emit(f"reference kept for six drives in {default_store()}")


@app.command(epilog=examples("cdhr drives home --drives socketcan:can0"))
def home(*, drives: Url, profile: ProfileName = "paper") -> None:
    """Home every slider in turn, with little torque. The machine moves."""
    _real(drives)
    _expect_reference(profile, "homing", 'cdhr drives reference, or reference = "homing"')
    with _link(drives, profile) as link:
        link.home(lambda drive: say(f"homing drive {drive} of 6"))
    emit("six sliders homed, until the drives lose their power")


def _expect_reference(profile: str, wanted: str, hint: str) -> None:
    """Raises Refusal where the profile's drives find their reference otherwise."""
    found = open_machine(profile).canopen.reference
    if found != wanted:
        raise Refusal(
            f"cdhr: error: [canopen] reference of {profile} is '{found}', not '{wanted}'\nhint: {hint}"
        )


@contextmanager
def _bus(url: str) -> "Iterator[ObjectAccess]":
    from cdhr_host.drives import MonotonicClock
    from cdhr_host.drives.access import connect

    if url.partition(":")[0] in ("loopback", ""):
        raise Refusal(f"cdhr: error: '{url}' has no drives to look at\nhint: --drives slcan:PATH@BITRATE")
    bus = connect(url, MonotonicClock())
    try:
        yield bus
    finally:
        bus.close()


@contextmanager
def _link(url: str, profile: str) -> "Iterator[SenderLink]":
    from cdhr_host.drives.reference import default_store
    from cdhr_host.drives.sender import SenderLink

    _real(url)
    link = SenderLink(url, open_machine(profile), default_store())
    link.open()
    try:
        yield link
    finally:
        link.close()


def _real(url: str) -> None:
    if url.partition(":")[0] in ("loopback", "link", ""):
        raise Refusal(f"cdhr: error: '{url}' is no CAN bus\nhint: --drives slcan:PATH@BITRATE")


def _number(text: str) -> int:
    try:
        return int(text, 0)
    except ValueError:
        raise Refusal(f"cdhr: error: '{text}' is not a number") from None
