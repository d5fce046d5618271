"""Names of uploaded programs: what a client may call a file, and nothing else."""

import re
from pathlib import PurePosixPath
from typing import Final

from cdhr_host.errors import JobError, Problem

SUFFIXES: Final = (".gcode", ".gco", ".g", ".nc", ".gcode.gz")
DEPTH_MAX: Final = 4
"""folders inside the upload folder, the file's name included"""
PART_MAX: Final = 180
"""bytes of UTF-8 in one part of a name; file systems end at 255"""

_FORBIDDEN: Final = re.compile(r'[\x00-\x1f\x7f-\x9f<>:";|?*\\\u202a-\u202e\u2066-\u2069]')
_DEVICES: Final = re.compile(r"(?i)(?:con|prn|aux|nul|com[0-9]|lpt[0-9])(?:\..*)?\Z")


def refused(message: str, hint: str | None = None, *, kind: str = "name") -> JobError:
    """A refusal of the door."""
    return JobError(Problem(kind, message, hint=hint))


def confined(name: str) -> PurePosixPath:
    """A client's name -> a relative path inside the upload folder. JobError says what is wrong.

    Refused are empty and absolute names, ``..``, hidden parts, control and direction
    characters, reserved device names, and anything deep or long.
    """
    parts = name.removeprefix("/").split("/") if not name.startswith("//") else [""]
    for part in parts:
        wrong = _wrong(part)
        if wrong:
            raise refused(
                f"'{shown(name)}' is no name for a program: {wrong}", "use a plain name: vase.gcode"
            )
    if len(parts) > DEPTH_MAX:
        raise refused(
            f"'{shown(name)}' is {len(parts)} folders deep", f"{DEPTH_MAX - 1} folders and a name at most"
        )
    return PurePosixPath(*parts)


def program_name(name: str) -> PurePosixPath:
    """As ``confined``, and it must end like a program."""
    path = confined(name)
    if not path.name.lower().endswith(SUFFIXES):
        raise refused(f"'{shown(name)}' is no G-code file", f"names end in {', '.join(SUFFIXES)}")
    return path


def shown(text: str, length: int = 80) -> str:
    """A client's text, safe to print: no control characters, not long."""
    plain = "".join(character if character.isprintable() else "?" for character in text[:length])
    return plain if len(text) <= length else f"{plain}..."


def _wrong(part: str) -> str | None:
    if part in {"", ".", ".."}:
        return "a part of it is empty or leads elsewhere"
    if part.startswith((".", " ")) or part.endswith((".", " ")):
        return "a part begins or ends with a dot or a space"
    if _FORBIDDEN.search(part):
        return "it holds a character that is not allowed"
    if _DEVICES.match(part):
        return "it is the name of a device"
    try:
        size = len(part.encode("utf-8"))
    except UnicodeEncodeError:
        return "it is no text"
    return f"it is longer than {PART_MAX} bytes" if size > PART_MAX else None
