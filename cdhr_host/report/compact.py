"""A compact log: integers, delta-packed, for runs of many million ticks.

Lengths are whole tenths of a micrometre, as drives take them; pressure is in pascals. Rows
are consecutive ticks from 0 on; the schema's metadata give the period.
"""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cdhr_host.pipeline.trace import Trace
from cdhr_host.report.log import Log
from cdhr_host.values import Array

TENTH_UM = 1e-7
"""m in a tenth of a micrometre"""
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
        schema = pa.schema([(name, pa.int32()) for name in COMPACT_COLUMNS], metadata=known)
        super().__init__(path, schema, WRITERS)

    def add_trace(self, trace: Trace) -> None:
        """Append N ticks."""
        lengths = [*trace.nozzle_G.T, *trace.slider.T]
        columns = [trace.line.astype(np.int32), *(_whole(row, TENTH_UM) for row in lengths)]
        self.add(dict(zip(COMPACT_COLUMNS, [*columns, _whole(trace.pressure, 1.0)], strict=True)))


def _whole(values: Array, unit: float) -> np.ndarray:
    """(N,) -> (N,) int32, the nearest whole number of units."""
    scaled = values * (1.0 / unit)
    return np.rint(scaled, out=scaled).astype(np.int32)
