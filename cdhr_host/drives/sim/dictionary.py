"""An object dictionary read from an EDS file: values, types, access, SDO abort codes."""

import configparser
import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Final

Key = tuple[int, int]
"""index and sub-index"""

FORMATS: Final = {0x2: "<b", 0x3: "<h", 0x4: "<i", 0x5: "<B", 0x6: "<H", 0x7: "<I"}
TEXT: Final = 0x9

READ_ONLY: Final = 0x06010002
NO_OBJECT: Final = 0x06020000
NO_SUB_INDEX: Final = 0x06090011
WRONG_LENGTH: Final = 0x06070010
BAD_VALUE: Final = 0x06090030


class Abort(Exception):  # noqa: N818 - an answer, not an error of the program
    """An SDO transfer ends with this abort code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"0x{code:08X}")
        self.code = code


@dataclass(frozen=True, slots=True)
class Entry:
    """One variable of the dictionary."""

    type: int
    access: str
    default: int | str

    @property
    def size(self) -> int:
        """Bytes of a number."""
        return struct.calcsize(FORMATS[self.type])


class Dictionary:
    """What one node knows; ``values`` is its state, ``hooks`` may refuse or act on a download."""

    def __init__(self, eds: str, node_id: int) -> None:
        self.entries = _entries(eds, node_id)
        self.values: dict[Key, int] = {}
        self.texts: dict[Key, str] = {}
        self.hooks: dict[int, Callable[[Key, int], None]] = {}
        self.overrides: dict[Key, int] = {}
        self.restore()

    def restore(self, below: int = 0x10000) -> None:
        """All values with an index below this as they were at power-on."""
        for key, entry in self.entries.items():
            if key[0] >= below:
                continue
            if isinstance(entry.default, str):
                self.texts[key] = entry.default
            else:
                self.values[key] = self.overrides.get(key, entry.default)

    def fixed(self, key: Key, value: int) -> None:
        """A value that survives ``restore``."""
        self.overrides[key] = self.values[key] = value

    def upload(self, key: Key) -> bytes:
        """What an SDO client reads; raises Abort."""
        entry = self._entry(key)
        if entry.type == TEXT:
            return self.texts[key].encode()
        return struct.pack(FORMATS[entry.type], self.values[key])

    def download(self, key: Key, data: bytes) -> None:
        """What an SDO client writes; raises Abort."""
        entry = self._entry(key)
        if entry.access in ("ro", "const"):
            raise Abort(READ_ONLY)
        if len(data) != entry.size:
            raise Abort(WRONG_LENGTH)
        (value,) = struct.unpack(FORMATS[entry.type], data)
        if hook := self.hooks.get(key[0]):
            hook(key, value)
        self.values[key] = value

    def _entry(self, key: Key) -> Entry:
        if entry := self.entries.get(key):
            return entry
        raise Abort(NO_SUB_INDEX if any(index == key[0] for index, _ in self.entries) else NO_OBJECT)


def _entries(eds: str, node_id: int) -> dict[Key, Entry]:
    return {
        key: Entry(kind, access, text if kind == TEXT else _number(text, node_id))
        for key, kind, access, text in _variables(eds)
    }


@cache
def _variables(eds: str) -> tuple[tuple[Key, int, str, str], ...]:
    """Key, type, access and default of each; six drives are described by one file."""
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(resources.files("cdhr_host.drives").joinpath("eds", eds).read_text(encoding="utf-8"))
    found = []
    for name in parser.sections():
        index, _, sub = name.partition("sub")
        section = parser[name]
        if len(index) != 4 or "DataType" not in section:
            continue
        key = (int(index, 16), int(sub or "0", 16))
        found.append((key, int(section["DataType"], 16), section["AccessType"], section["DefaultValue"]))
    return tuple(found)


def _number(text: str, node_id: int) -> int:
    plain = text.replace("$NODEID+", "")
    return int(plain, 0) + (node_id if plain != text else 0)
