"""A compact log: integers, delta-packed, for runs of many million ticks.

Lengths are whole tenths of a micrometre, as drives take them; pressure is in pascals. Rows
are consecutive ticks from 0 on; the schema's metadata give the period.
"""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cdhr_host.pipeline.trace import Trace
from cdhr_host.report.log import Log
from cdhr_host.values import Array

TENTH_UM = 1e-7
"""m in a tenth of a micrometre"""
GROUP: Final = 65_536
"""rows written at a time"""
COMPACT_COLUMNS: tuple[str, ...] = (
    "line",
    *(f"{axis}_tenth_um" for axis in "xyz"),
    *(f"slider{i}_tenth_um" for i in range(1, 7)),
    "pressure_pa",
)


class _Packed:
    """Differences of neighbouring rows, in as many bits as they need."""

    def __init__(self, file: BinaryIO, schema: pa.Schema) -> None:
        self._writer = pq.ParquetWriter(
            file,
            schema,
            compression="none",
            use_dictionary=False,
            write_statistics=False,
            column_encoding=dict.fromkeys(schema.names, "DELTA_BINARY_PACKED"),
        )

    def write(self, table: pa.Table) -> None:
        """Append rows."""
        self._writer.write_table(table)

    def close(self) -> None:
        """Write the file's index."""
        self._writer.close()


WRITERS = {".parquet": _Packed}


class CompactLog(Log):
    """Sliders, nozzle and pressure of a dry run, one row a tick."""

    def __init__(self, path: Path, period: float, metadata: Mapping[str, str] = MappingProxyType({})) -> None:
        known: dict[bytes | str, bytes | str] = {"period_s": repr(period)}
        known.update(metadata.items())
        fields = [pa.field(name, pa.int32(), nullable=False) for name in COMPACT_COLUMNS]
        super().__init__(path, pa.schema(fields, metadata=known), WRITERS)
        self._filled = np.empty((len(COMPACT_COLUMNS), GROUP), dtype=np.int32)
        self._count = 0

    def add_trace(self, trace: Trace) -> None:
        """Append N ticks."""
        for first in range(0, len(trace), GROUP):
            self._fill(trace[first : first + GROUP])

    def keep(self) -> None:
        """Write what is held, and put the log in its place."""
        self._hand_on()
        super().keep()

    def _fill(self, trace: Trace) -> None:
        """Append ticks, GROUP at most."""
        if self._count + len(trace) > GROUP:
            self._hand_on()
        rows = self._filled[:, self._count : self._count + len(trace)]
        rows[0] = trace.line
        rows[1:4], rows[4:10] = _whole(trace.nozzle_G.T, TENTH_UM), _whole(trace.slider.T, TENTH_UM)
        rows[10] = _whole(trace.pressure, 1.0)
        self._count += len(trace)

    def _hand_on(self) -> None:
        """Write the rows filled in: their memory is used again."""
        self.add(dict(zip(COMPACT_COLUMNS, self._filled[:, : self._count], strict=True)))
        self.flush()
        self._count = 0


def _whole(values: Array, unit: float) -> Array:
    """The nearest whole number of units."""
    scaled = values * (1.0 / unit)
    return np.rint(scaled, out=scaled)
