"""What a compact log holds of each tick: where sliders and nozzle are, and the air."""

from dataclasses import dataclass, fields

from cdhr_host.values import Array, Flags, Ints


@dataclass(frozen=True, slots=True)
class Trace:
    """N consecutive ticks."""

    tick: Ints
    """(N,)"""
    line: Ints
    """(N,)"""
    nozzle_G: Array
    """(N, 3) m"""
    slider: Array
    """(N, 6) m"""
    flow: Array
    """(N,) m³/s"""
    pressure: Array
    """(N,) Pa"""

    def __len__(self) -> int:
        return len(self.tick)

    def __getitem__(self, rows: slice | Flags) -> "Trace":
        return Trace(*(getattr(self, field.name)[rows] for field in fields(self)))
