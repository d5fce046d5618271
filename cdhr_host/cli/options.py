"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer


def examples(*lines: str, more: str = "") -> str:
    """Worked examples for the end of a help page, one a line."""
    block = "\n".join(["\b", "Examples:", *(f"  {line}" for line in lines)])
    return f"{block}\n\n{more}" if more else block


ProfileName = Annotated[
    str,
    typer.Option(
        "--profile", "-p", metavar="P", help="Name of an installed profile, or the path of a .toml file."
    ),
]
MaterialName = Annotated[
    str | None,
    typer.Option(
        "--material", metavar="M", help="The clay: an installed material (cdhr profile list), or a path."
    ),
]
DrivesUrl = Annotated[
    str,
    typer.Option("--drives", metavar="URL", help="Where the drives are; loopback: simulates them here."),
]
Speed = Annotated[float, typer.Option(metavar="X", help="Run the simulated drives X times faster.", min=0.01)]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
LogPath = Annotated[
    Path | None,
    typer.Option("--log", "-l", metavar="LOG", help="Write the log there: .csv or .parquet, by suffix."),
]
Program = Annotated[
    str, typer.Argument(metavar="FILE", help="The G-code to run; may be gzip-compressed.", show_default=False)
]
