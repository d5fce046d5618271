"""Where the reference pose is, for each drive by its serial number."""

import json
import os
from pathlib import Path
from typing import Final

import numpy as np

from cdhr_host.errors import DriveError, Problem
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Ints

NEXT_STEP: Final = {
    "homing": "G28, or cdhr drives home: one slider after the other finds its home, with little torque",
    "stored": "bring the machine to its reference pose, then: cdhr drives reference",
    "drive": "check the encoder and the drive's zero, then open the drives again",
}
"""by ``[canopen] reference``"""


def default_store() -> Path:
    """``$XDG_STATE_HOME/cdhr/references.json``."""
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "cdhr" / "references.json"


class ReferenceStore:
    """Position units at the reference pose, kept in a file, one entry a drive."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def load(self) -> dict[str, int]:
        """All entries; raises DriveError for a damaged file."""
        try:
            entries = json.loads(self.path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            raise DriveError(
                Problem(
                    "reference", f"{self.path} cannot be used: {error}", hint="reference the drives again"
                )
            ) from error
        if not isinstance(entries, dict) or not all(type(value) is int for value in entries.values()):
            raise DriveError(Problem("reference", f"{self.path} is not a table of references"))
        return entries

    def save(self, profile: Profile, serials: list[int], position: Ints) -> None:
        """Remember (6,) position units as the reference pose of these drives."""
        entries = self.load()
        entries |= {_key(profile, s): int(at) for s, at in zip(serials, position, strict=True)}
        self._write(entries)

    def forget(self, profile: Profile, serials: list[int]) -> None:
        """These drives are unreferenced from now on."""
        gone = {key(profile, serial) for serial in serials for key in (_key, _marked)}
        self._write({key: value for key, value in self.load().items() if key not in gone})

    def known(self, profile: Profile, serials: list[int]) -> bool:
        """Whether all these drives have a reference."""
        entries = self.load()
        return all(_key(profile, serial) in entries for serial in serials)

    def zero(self, profile: Profile, serials: list[int]) -> Ints:
        """(6,) position units at the reference pose; raises DriveError with the drives that have none."""
        entries = self.load()
        absent = [k + 1 for k, serial in enumerate(serials) if _key(profile, serial) not in entries]
        if absent:
            raise unreferenced(absent, "stored")
        return np.array([entries[_key(profile, serial)] for serial in serials], dtype=np.int64)

    def mark(self, profile: Profile, serials: list[int], marks: list[int]) -> None:
        """Remember what homing left in each drive's volatile memory."""
        entries = self.load()
        entries |= {_marked(profile, s): mark for s, mark in zip(serials, marks, strict=True)}
        self._write(entries)

    def marked(self, profile: Profile, serials: list[int], marks: list[int]) -> bool:
        """Whether all drives still have what homing left in them: they had power ever since."""
        entries = self.load()
        return all(entries.get(_marked(profile, s)) == mark for s, mark in zip(serials, marks, strict=True))

    def _write(self, entries: dict[str, int]) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        fresh = self.path.with_suffix(".new")
        fresh.write_text(json.dumps(entries, indent=1, sort_keys=True) + "\n", encoding="utf-8")
        fresh.replace(self.path)


def unreferenced(axes: list[int], mode: str) -> DriveError:
    """Motion is refused; numbers from 1, and ``[canopen] reference``, which knows the next step."""
    names = ", ".join(map(str, axes))
    return DriveError(
        Problem("unreferenced", f"not referenced: drive {names}; nothing may move", hint=NEXT_STEP[mode])
    )


def _key(profile: Profile, serial: int) -> str:
    return f"{profile.canopen.drive_vendor:08x}:{profile.canopen.drive_product:08x}:{serial}"


def _marked(profile: Profile, serial: int) -> str:
    return _key(profile, serial) + ":homed"
