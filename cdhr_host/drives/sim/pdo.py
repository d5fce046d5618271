"""Process data of a simulated node, as strict as the strictest stacks."""

import struct
from typing import Final

from cdhr_host.drives.sim.dictionary import BAD_VALUE, FORMATS, NO_OBJECT, Abort, Dictionary, Key

OFF: Final = 1 << 31
UNSUPPORTED: Final = 0x06010000
NOT_MAPPABLE: Final = 0x06040041


class Pdo:
    """One PDO: its COB-ID, transmission type, and the objects in it."""

    def __init__(self, dictionary: Dictionary, parameters: int, mapping: int) -> None:
        self._dictionary = dictionary
        self._parameters, self._mapping = parameters, mapping
        self.keys: list[Key] = []
        self.format = "<"
        self.latched: tuple[int, ...] | None = None
        self.heard: float | None = None
        self.sent = -1.0
        self.cycles = 0
        dictionary.hooks[parameters] = self._parameter_written
        dictionary.hooks[mapping] = self._mapping_written
        self.rebuild()

    @property
    def cob(self) -> int:
        """COB-ID; 0 when the PDO is off."""
        value = self._dictionary.values[self._parameters, 1]
        return 0 if value & OFF else value & 0x7FF

    @property
    def type(self) -> int:
        """Transmission type: 1-240 with SYNC, 254 and 255 by event."""
        return self._dictionary.values[self._parameters, 2]

    @property
    def event(self) -> float:
        """S of the event timer."""
        return self._dictionary.values.get((self._parameters, 5), 0) * 1e-3

    @property
    def length(self) -> int:
        """Bytes."""
        return struct.calcsize(self.format)

    def rebuild(self) -> None:
        """Follow the mapping in the dictionary."""
        values = self._dictionary.values
        entries = [values[self._mapping, k + 1] for k in range(values[self._mapping, 0])]
        self.keys = [(entry >> 16, entry >> 8 & 0xFF) for entry in entries]
        kinds = [FORMATS[self._dictionary.entries[key].type][1] for key in self.keys]
        self.format = "<" + "".join(kinds)
        self.latched = self.heard = None

    def packed(self) -> bytes:
        """The mapped values as they are now."""
        return struct.pack(self.format, *(self._dictionary.values[key] for key in self.keys))

    def apply(self, values: tuple[int, ...]) -> None:
        """Write received values to the mapped objects."""
        for key, value in zip(self.keys, values, strict=True):
            self._dictionary.values[key] = value

    def _parameter_written(self, key: Key, value: int) -> None:
        if key[1] == 1:
            if not value & OFF and not self._dictionary.values[self._mapping, 0]:
                raise Abort(BAD_VALUE)
            self.latched = self.heard = None
        elif self.cob and key[1] == 2:
            raise Abort(UNSUPPORTED)

    def _mapping_written(self, key: Key, value: int) -> None:
        if self.cob:
            raise Abort(UNSUPPORTED)
        values = self._dictionary.values
        if key[1] and values[self._mapping, 0]:
            raise Abort(UNSUPPORTED)
        if key[1]:
            entry = self._dictionary.entries.get((value >> 16, value >> 8 & 0xFF))
            if entry is None:
                raise Abort(NO_OBJECT)
            if value & 0xFF != 8 * entry.size:
                raise Abort(NOT_MAPPABLE)
        else:
            before, values[key] = values[key], value
            try:
                self.rebuild()
            finally:
                values[key] = before
            if self.length > 8:
                raise Abort(0x06040042)
