"""``cdhr serve``: a printer for other people's clients."""

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdhr_host.cli.machine import SIMULATED, open_machine, opened
from cdhr_host.cli.options import DrivesUrl, Json, MaterialName, ProfileName, Speed, examples
from cdhr_host.cli.refusals import INTERRUPTED, Refusal, emit, say

if TYPE_CHECKING:
    from cdhr_host.profile import Profile
    from cdhr_host.serve.server import Doors, Server
    from cdhr_host.serve.web.keys import ApiKey

SWITCH = 0.0005
"""s until the planning thread gives way to a client's line; Python's own 5 ms would be felt in each answer"""
EXAMPLES = examples(
    "cdhr serve",
    "cdhr serve --marlin /tmp/printer --tcp 8023 --http 7125 --klippy-socket /tmp/klippy.sock",
    "cdhr serve --bind 0.0.0.0 --name clay.local --drives slcan:/dev/ttyACM0@1000000",
    "cdhr serve --origin http://mainsail.local",
    more="OctoPrint, printcore, Cura: --marlin or --tcp. Slicers, Mainsail, Fluidd, a browser: --http. "
    "The real Moonraker: --klippy-socket. See docs/serve.md.",
)

MarlinPath = Annotated[
    Path | None, typer.Option(metavar="PATH", help="Marlin's line protocol on a pseudo-terminal; its name.")
]
TcpPort = Annotated[
    int | None,
    typer.Option(metavar="PORT", help="The same on a TCP port of this machine only.", min=0, max=65535),
]
HttpPort = Annotated[
    int, typer.Option(metavar="PORT", help="Uploads, Moonraker's API and the page.", min=0, max=65535)
]
NoHttp = Annotated[bool, typer.Option("--no-http", help="No HTTP port.")]
KlippyPath = Annotated[
    Path | None, typer.Option(metavar="PATH", help="Klipper's unix socket, for the real Moonraker.")
]
Bind = Annotated[
    str,
    typer.Option(metavar="ADDRESS", help="Where the HTTP port listens; beyond loopback a key is asked for."),
]
Files = Annotated[
    Path | None, typer.Option(metavar="DIR", help="The upload folder (default: in your data folder).")
]
Names = Annotated[
    list[str] | None, typer.Option(metavar="HOST", help="A name by which clients call this machine.")
]
Origins = Annotated[
    list[str] | None, typer.Option(metavar="URL", help="Another page that may speak to the HTTP port.")
]
KeyFile = Annotated[Path | None, typer.Option(metavar="FILE", help="Where the API key's hash is kept.")]
NewKey = Annotated[bool, typer.Option("--new-key", help="Make a new API key; the old one ends.")]


def serve(
    *,
    profile: ProfileName = "paper",
    material: MaterialName = None,
    drives: DrivesUrl = SIMULATED,
    speed: Speed = 1.0,
    marlin: MarlinPath = None,
    tcp: TcpPort = None,
    http: HttpPort = 7125,
    no_http: NoHttp = False,
    klippy_socket: KlippyPath = None,
    bind: Bind = "127.0.0.1",
    files: Files = None,
    name: Names = None,
    origin: Origins = None,
    key_file: KeyFile = None,
    new_key: NewKey = False,
    json_: Json = False,
) -> None:
    """Serve OctoPrint, slicers, Mainsail, Fluidd, Moonraker and browsers until interrupted.

    Ctrl-C and SIGTERM hold a print on its path (exit code 130 if there was one), then end.
    """
    _need_framework()
    from cdhr_host.serve.server import Doors

    doors = Doors(
        files=files or _data_folder(),
        marlin=marlin,
        tcp=tcp,
        http=None if no_http else http,
        klippy=klippy_socket,
        address=bind,
        key=_key(bind, key_file, new=new_key),
        names=frozenset(name or ()),
        origins=frozenset(each.rstrip("/") for each in origin or ()),
    )
    interrupted = _serve(
        open_machine(profile, material), (profile, material), drives, speed, doors, json_=json_
    )
    if interrupted:
        say("cdhr: the print rests on its path; cdhr resume goes on with it, if it was an uploaded program")
        raise typer.Exit(INTERRUPTED)


def _serve(
    machine: "Profile",
    names: tuple[str, str | None],
    drives: str,
    speed: float,
    doors: "Doors",
    *,
    json_: bool,
) -> bool:
    """Run to the end; whether a print was interrupted. ``names`` are those of profile and material."""
    import asyncio
    import logging

    from cdhr_host.job.printer import Printer
    from cdhr_host.job.recorder import Names, Recorder
    from cdhr_host.serve.server import Server

    logging.basicConfig(level=logging.WARNING, format="cdhr: %(message)s")
    sys.setswitchinterval(SWITCH)
    link, clock = opened(drives, machine, speed)
    try:
        printer = Printer(link, clock, recorder=Recorder(link, Names(*names, drives)))
        printer.begin()
        try:
            server = Server(printer, doors)
            asyncio.run(server.run(lambda: _told(server, json_=json_)))
        except OSError as error:
            raise Refusal(
                f"cdhr: error: cannot open a door: {_what_failed(error)}\n"
                "hint: cdhr serve --help tells what names and moves each door"
            ) from error
        finally:
            printer.close()
    finally:
        link.close()
    return server.interrupted


def _what_failed(error: OSError) -> str:
    """With the name that it is about, where there is one."""
    name = error.filename2 or error.filename
    where = f"{name}: " if name is not None else ""
    return f"{where}{error.strerror or error}"


def _told(server: "Server", *, json_: bool) -> None:
    """Where each door is."""
    if json_:
        emit(json.dumps({**server.addresses, "files": str(server.host.folder.root)}))
        return
    for door, where in server.addresses.items():
        emit(f"{door:7} {where}")
    emit(f"files   {server.host.folder.root}")
    say("cdhr: serving; Ctrl-C ends")


def _key(bind: str, key_file: Path | None, *, new: bool) -> "ApiKey | None":
    """The stored key; a new one is made where it is wanted or needed, and shown this once."""
    from cdhr_host.serve.web.guard import is_loopback
    from cdhr_host.serve.web.keys import ApiKey, default_key_file

    path = key_file or default_key_file()
    stored = ApiKey.stored(path)
    if not new and (stored is not None or is_loopback(bind)):
        return stored
    try:
        key, text = ApiKey.make(path)
    except OSError as error:
        raise Refusal(
            f"cdhr: error: cannot write {path}: {error.strerror}\nhint: name another --key-file"
        ) from error
    say(f"cdhr: API key, shown only now: {text}")
    return key


def _data_folder() -> Path:
    base = os.environ.get("XDG_DATA_HOME") or str(Path.home() / ".local" / "share")
    return Path(base) / "cdhr" / "programs"


def _need_framework() -> None:
    """Refuse before anything moves where the web framework is not installed."""
    from importlib.util import find_spec

    if find_spec("aiohttp") is None:
        raise Refusal(
            "cdhr: error: aiohttp is not installed\nhint: python3 -m pip install 'cdhr-host[serve]'"
        )
