"""What a slicer wrote about its program in the comments at both ends of the file."""

import re
from typing import Any, Final

from cdhr_host.serve.folder import Folder

END: Final = 1 << 16
"""bytes looked at, at each end"""
_SLICERS: Final = (
    ("PrusaSlicer", r"PrusaSlicer (\S+)"),
    ("OrcaSlicer", r"OrcaSlicer (\S+)"),
    ("Cura", r"Cura_SteamEngine (\S+)"),
)
_NUMBERS: Final = {
    "layer_height": r"(?m)^;\s*(?:layer_height = |Layer height: )([\d.]+)",
    "layer_count": r"(?m)^;(?:LAYER_COUNT:| total layer number: ?)(\d+)",
    "object_height": r"(?m)^;(?:MAXZ:| max_z_height: )([\d.]+)",
    "filament_total": r"(?m)^; filament used \[mm\] = ([\d.]+)",
}
_TIME: Final = re.compile(r"estimated printing time.*?= (?:(\d+)d )?(?:(\d+)h )?(?:(\d+)m )?(?:(\d+)s)?")
_CURA_TIME: Final = re.compile(r"(?m)^;TIME:(\d+)")


def described(folder: Folder, name: str) -> dict[str, Any]:
    """Size, age, and what the slicer tells; fields it does not tell are left out."""
    entry = folder.entry(name)
    text = folder.read(name, END).decode("latin-1")
    if entry.size > END:
        text += folder.read(name, END, at=max(END, entry.size - END)).decode("latin-1")
    found: dict[str, Any] = {"filename": entry.name, "size": entry.size, "modified": entry.modified}
    for slicer, pattern in _SLICERS:
        if version := re.search(pattern, text):
            found |= {"slicer": slicer, "slicer_version": version[1]}
    for key, pattern in _NUMBERS.items():
        if value := re.search(pattern, text):
            found[key] = int(value[1]) if value[1].isdigit() else float(value[1])
    seconds = _seconds(text)
    return found | ({"estimated_time": seconds} if seconds else {})


def _seconds(text: str) -> int | None:
    if cura := _CURA_TIME.search(text):
        return int(cura[1])
    found = _TIME.search(text)
    if found is None:
        return None
    days, hours, minutes, seconds = (int(part or 0) for part in found.groups())
    return ((days * 24 + hours) * 60 + minutes) * 60 + seconds
