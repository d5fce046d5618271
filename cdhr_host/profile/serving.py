"""[serve]: what other people's clients may do here."""

import re
from typing import Annotated, Final

from pydantic import AfterValidator, Field

from cdhr_host.profile.fields import Section, key

_NAME: Final = re.compile(r"[A-Z][A-Z0-9_]{2,39}")
RESERVED: Final = frozenset(
    {
        "CANCEL_PRINT",
        "CLEAR_PAUSE",
        "FIRMWARE_RESTART",
        "HELP",
        "PAUSE",
        "RESPOND",
        "RESTART",
        "RESTORE_GCODE_STATE",
        "RESUME",
        "SAVE_GCODE_STATE",
        "SDCARD_PRINT_FILE",
        "SDCARD_RESET_FILE",
        "STATUS",
    }
)
"""scripts that are there already"""


def _macros(macros: dict[str, str]) -> dict[str, str]:
    for name, text in macros.items():
        if not _NAME.fullmatch(name):
            raise ValueError(f"'{name}' is no macro name: capitals, digits and _, 3 to 40, as in LOAD_CLAY")
        if name in RESERVED:
            raise ValueError(f"'{name}' is there already")
        if not text.strip():
            raise ValueError(f"'{name}' has no G-code")
    return macros


class Serve(Section):
    """[serve]: uploads, clients, and scripts of this machine."""

    upload_max: Annotated[int, key("upload_max_bytes", "greatest program taken", ge=1024, le=2**40)]
    files_max: Annotated[int, Field(description="programs in the upload folder", ge=1, le=100_000)]
    client_silence: Annotated[
        float,
        key("client_silence_s", "silence of a printing client after which the print holds", ge=1, le=3600),
    ]
    macros: Annotated[
        dict[str, str],
        AfterValidator(_macros),
        Field(description="scripts by name: G-code, several lines separated by a line end"),
    ]
